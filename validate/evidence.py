"""All that a report rests on."""

from dataclasses import dataclass
from pathlib import Path

from sealtwin.records import Comparison, DataKind, Frame, Outline, Profile, Run, Solid, Trajectory


@dataclass(frozen=True)
class Sheet:
    """Which readings these are, so that whoever signs knows."""

    name: str
    """Of the file, as the user or the lab named it."""
    sha256: str
    operator: str | None = None
    """Who read; None where no note of the lab says."""
    date: str | None = None
    """When it was read, as the lab writes it."""


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
    commands: tuple[str, ...]
    """What makes this report again, one after the other."""
    sheet: Sheet | None = None
    """The file of the readings; None where there are none."""
    edited: tuple[str, ...] = ()
    """Files that this rests on and that are not as their stage wrote them."""
    frames: tuple[Frame, ...] = ()
    """Snapshots of the run, in the order of time."""
