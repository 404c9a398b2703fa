"""Models of the command options that are not settings of a trial. A command imports its model only when it runs."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from sealtwin.core.settings import Settings


class FluidRun(Settings):
    """Options of 'sealtwin run' and 'sealtwin simulate'."""

    threads: int | None = Field(default=None, ge=1, le=64)
    """Number of CPU threads of the fluid run. It does not change the result. Default: one per core, up to 8."""


class Tracing(Settings):
    """Options of 'sealtwin trace'."""

    port: int | None = Field(default=None, ge=1024, le=65535)
    """Port of the page. Default: any free port."""
    no_browser: bool = False
    """Print the address of the page, and do not open a browser."""


class DrawnCrack(Settings):
    """Options of 'sealtwin export'."""

    formats: tuple[Literal["mask", "dxf"], ...]
    """File formats. mask: a PNG of the photo's size with the crack in white; dxf: a drawing with lines in mm."""


class Ingestion(Settings):
    """Options of 'sealtwin ingest'."""

    dry_run: bool = False
    """Pair and read the files and report, but do not trace photos or write files."""
    jobs: int = Field(default=1, ge=1, le=64)
    """Number of samples traced at the same time."""


class StudyMap(Settings):
    """Options of 'sealtwin map'."""

    caliper: Path | None = None
    """Sheet of readings with which the runs are compared, in the format of the trial's sheet. Default: that sheet."""
    data: Literal["measured", "reconstructed", "synthetic"] | None = None
    """Origin of the readings in --caliper."""
    any_volume: bool = False
    """Include runs with a volume error above 5 %, such as runs with the preset "paper"."""
    fills: bool = True
    """Draw how the crack fills in about nine of the runs."""


class WorkerProcesses(Settings):
    """Options of 'sealtwin plan' and 'sealtwin lab'."""

    jobs: int | None = Field(default=None, ge=1, le=512)
    """Number of processes for fluid runs. Default: one per core, or one on a GPU."""


class StudyRuns(WorkerProcesses):
    """Options of a study's runs."""

    accurate: bool = False
    """Compute with the trial's solver settings instead of drafts. This takes three times as long."""


class Sweeping(StudyRuns):
    """Options of 'sealtwin sweep'."""

    batch: int | None = Field(default=None, ge=1, le=4096)
    """Number of runs that are computed together. They may differ only in the fluid. Default: 1, or 256 on a GPU."""
    scheduler: str | None = None
    """Dask scheduler whose workers compute the runs instead of this machine. Requires the pip extra 'cluster'."""
    retry: bool = False
    """Compute failed runs again."""
    dry_run: bool = False
    """Check all settings, digitise and estimate the time, but do not compute fluid runs."""
