"""All that a report rests on."""

from dataclasses import dataclass
from pathlib import Path

from sealtwin.records import Comparison, DataKind, Frame, Outline, Profile, Run, Solid, Trajectory


@dataclass(frozen=True)
class Evidence:
    """One trial, as its stages left it."""

    name: str
    note: str
    outline: Outline
    solid: Solid
    trajectory: Trajectory
    run: Run
    profile: Profile
    readings: Profile | None
    """None where the trial has no caliper sheet: the report then shows the simulation alone."""
    comparison: Comparison | None
    """Of profile and readings; there when they are."""
    volume_ratio: float
    overlay_path: Path
    photo_data: DataKind
    provenance: dict[str, str]
    """Versions, device, seed, times, hashes: shown in this order."""
    command: str
    """What makes this report again."""
    frames: tuple[Frame, ...] = ()
    """Snapshots of the run, in the order of time."""
