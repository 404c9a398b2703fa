"""Options of commands that are no settings of a trial: a model for each command, imported when the command needs it."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from sealtwin.core.settings import Settings


class FluidRun(Settings):
    """Options of 'sealtwin run' and 'sealtwin simulate'."""

    threads: int | None = Field(default=None, ge=1, le=64)
    """CPU threads of the fluid run, which do not change its result; default: one for each core, up to 8."""


class Digitising(Settings):
    """Options of 'sealtwin digitise'."""

    jobs: int = Field(default=1, ge=1, le=64)
    """Number of photos digitised at the same time."""
    explain: float | None = Field(default=None, ge=0)
    """Explain why each wall is there, at this s in mm, in a run folder that TRIAL|PHOTO or --out names."""


class Tracing(Settings):
    """Options of 'sealtwin trace'."""

    port: int | None = Field(default=None, ge=1024, le=65535)
    """Port of the page; default: any free port."""
    no_browser: bool = False
    """Print the page's address and do not open a browser."""


class DrawnCracks(Settings):
    """Options of 'sealtwin export'."""

    formats: tuple[Literal["mask", "coco", "dxf"], ...]
    """mask: a PNG of the photo's size with the crack in white; coco: one JSON file for all; dxf: lines in mm."""


class Ingestion(Settings):
    """Options of 'sealtwin ingest'."""

    dry_run: bool = False
    """Pair, read and report; trace and write nothing."""
    jobs: int = Field(default=1, ge=1, le=64)
    """Samples traced at the same time."""


class StudyMap(Settings):
    """Options of 'sealtwin map'."""

    caliper: Path | None = None
    """Readings to compare the runs with, in the format of the trial's readings; default: the trial's."""
    data: Literal["measured", "reconstructed", "synthetic"] | None = None
    """Origin of the readings of --caliper."""
    any_volume: bool = False
    """Include runs whose volume error is over 5 %, as with preset "paper"."""
    fills: bool = True
    """Draw how the crack fills in about nine runs, as the sweep kept it."""


class WorkerProcesses(Settings):
    """Options of 'sealtwin plan' and 'sealtwin lab run'."""

    jobs: int | None = Field(default=None, ge=1, le=512)
    """Processes for fluid runs; default: one for each core, one on a GPU."""


class StudyRuns(WorkerProcesses):
    """Options of the runs of a study."""

    accurate: bool = False
    """Compute with the trial's own solver settings, which takes three times as long as drafts."""


class Sweeping(StudyRuns):
    """Options of 'sealtwin sweep'."""

    batch: int | None = Field(default=None, ge=1, le=4096)
    """Number of runs in one launch, which may differ only in the fluid; default: 1, or 256 on a GPU."""
    scheduler: str | None = None
    """Compute on the workers of this Dask scheduler instead of this machine; needs the pip extra 'cluster'."""
    retry: bool = False
    """Compute failed runs again."""
    dry_run: bool = False
    """Check all settings, digitise and estimate the time, but run no fluid."""
