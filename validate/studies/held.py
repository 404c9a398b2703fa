"""Runs of a study, each held against the same readings: where it stands, how far off it is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Floats, Profile
from validate.comparison.curves import Difference
from validate.comparison.distances import CLOSE_MM
from validate.studies.axis import Axis


@dataclass(frozen=True)
class Finished:
    """A run that is done, as its study keeps it."""

    number: int
    settings: Mapping[str, Any]
    """What varies, by dotted name."""
    profile: Profile
    wall_s: float
    volume_ratio: float
    """What the settled sealant fills over what was dispensed."""


@dataclass(frozen=True)
class Excluded:
    """A run without a result."""

    number: int
    settings: Mapping[str, Any]
    reason: str


@dataclass(frozen=True)
class Held:
    """A run against the readings. Errors are simulated minus measured level, exact over their common stretch of s."""

    run: Finished
    at: tuple[float, float]
    """On the map's two axes."""
    mean_error_mm: float
    bias_mm: float
    worst_error_mm: float
    worst_at_mm: float
    share_under_1_mm: float


def hold(run: Finished, readings: Profile, axes: tuple[Axis, Axis]) -> Held:
    """Raises InputError where profile and readings have no stretch of s in common."""
    error = Difference(run.profile.s_mm, run.profile.level_mm, readings.s_mm, readings.level_mm)
    size = np.abs(error.value)
    worst = int(np.argmax(size))
    across, up = axes
    return Held(
        run=run,
        at=(across.place(run.settings), up.place(run.settings)),
        mean_error_mm=float(np.trapezoid(size, error.x) / error.length_mm),
        bias_mm=error.mean(),
        worst_error_mm=float(size[worst]),
        worst_at_mm=float(error.x[worst]),
        share_under_1_mm=error.share_within(CLOSE_MM),
    )


def errors_on_grid(runs: Sequence[Finished], readings: Profile) -> tuple[Floats, Floats]:
    """All stations of profiles and readings in their common stretch, (k,); simulated less measured level there, (r, k).

    Straight between them; where a run crosses the readings is not among them.

    Raises InputError where some run has no stretch of s in common with the readings.
    """
    low = max(readings.s_mm[0], *(run.profile.s_mm[0] for run in runs))
    high = min(readings.s_mm[-1], *(run.profile.s_mm[-1] for run in runs))
    if not low < high:
        raise InputError(
            f"Profiles and readings have no stretch of s in common: all have begun at {low:g} mm, the first "
            f"one ends at {high:g} mm. Check that the readings count s from the end where the nozzle starts, in mm."
        )
    s_mm = np.unique(np.concatenate([readings.s_mm, *(run.profile.s_mm for run in runs)]))
    s_mm = s_mm[(s_mm >= low) & (s_mm <= high)]
    measured_mm = np.interp(s_mm, readings.s_mm, readings.level_mm)
    return s_mm, np.array([np.interp(s_mm, run.profile.s_mm, run.profile.level_mm) - measured_mm for run in runs])
