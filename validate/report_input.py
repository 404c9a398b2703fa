"""Input of a report: one trial with its readings and their comparison."""

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sealtwin.core.records import DataKind, JsonRecord, Outline, Profile, Run, Solid, Trajectory
from sealtwin.core.stage_keys import number_words
from sealtwin.core.vtk_files import Frame
from validate.result import Comparison, PredictedLevel, SeedRuns


class ReadingsSheet(JsonRecord):
    """The file of the readings, for the person who signs the report."""

    name: str
    """Name of the file, as the user or the lab gave it."""
    sha256: str
    """SHA-256 of the file's content."""
    operator: str | None
    """Name of the person who took the readings; None if no note has it."""
    date: str | None
    """Date of the readings, as the lab writes it; None if no note has it."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """One trial with the results of its stages."""

    name: str
    note: str = ""
    outline: Outline
    solid: Solid
    trajectory: Trajectory
    run: Run
    profile: Profile  # The simulated level
    seeds: SeedRuns | None = None  # Runs whose mean is ``profile``; None for a single run
    readings: Profile | None = None  # None without a caliper sheet; the report then shows only the simulation
    comparison: Comparison | None = None  # Comparison of profile and readings; None without readings
    prediction: PredictedLevel | None = None  # Of a run without readings; None without extra runs
    volume_ratio: float
    overlay_path: Path
    straight_path: Path  # Picture of the photo along the crack
    photo_data: DataKind
    provenance: dict[str, str]  # Versions, device, seed, times and hashes, in the order of the report
    commands: tuple[str, ...] = ()  # Commands that make this report again, in order
    sheet: ReadingsSheet | None = None  # File of the readings; None without readings
    edited: tuple[str, ...] = ()  # Files of the run that were changed after their stage wrote them
    extra_runs: str = ""  # Time in words that 'sealtwin validate RUN --uncertainty' takes; empty if unknown
    frames: tuple[Frame, ...] = ()  # Snapshots of the run, in the order of time
    can_be_planned: bool = False  # True if 'sealtwin plan' takes the sealant


def provenance(
    facts: dict[str, str], device: str, seed: Any, versions: dict[str, str], numbers: Mapping[str, int]
) -> dict[str, str]:
    """Return the origin of a report: program, machine, ``facts``, and the device, seed and versions of the run.

    ``numbers`` are the stage numbers with which the results were computed.
    """
    return {
        "sealtwin": version("sealtwin"),
        "stage numbers": number_words(numbers),
        "system": f"{platform.system()} {platform.machine()}",
        **facts,
        "device": device,
        **({} if seed is None else {"seed": str(seed)}),
        **{name: text for name, text in versions.items() if name != "sealtwin"},
    }
