"""The readings once more, as the paper's prose allows them to have been. RECONSTRUCTED, all of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fixtures.generate.paper_trial import DESCRIBED_MM, REPEATS, SCATTER_MM, STATION_MM
from reports.reproduction.surface import Along, along
from sealtwin.core.records import Floats, Profile
from validate.figures.chart import Finished, errors_on_grid
from validate.uncertainty.budget import hats, mean_absolute

SETS = 500
"""Of readings: a share is known to 2 %."""
ALONG_MM, LEVEL_MM = 3.0, 0.5
"""Standard deviations of a corner of the described line: "several millimetres" along the crack and "about 0.5" in level
are what the fixture's README says of reading them off prose."""
FIRST_MM = (-16.0, -5.0)
"""Range of the first corner's level, all alike. "Significant underfill is observed at the left side" is
all that the paper says of it: the floor is at -16 mm, and the plateau that follows at -4 mm.
"""
FIRST_READINGS_MM = tuple(float(level) for level in range(-16, -4))
LEAST_STEP_MM = 2.0
"""Between two corners: the line is described from left to right."""


@dataclass(frozen=True)
class FirstReading:
    """What the chosen pair is off by, if the line began at one level."""

    level_mm: float
    error: Along


def redraw() -> list[Profile]:
    """Sets of readings from a fixed seed, each its corners moved and its stations scattered as the caliper scatters.

    The line begins anywhere in ``FIRST_MM``; moved to the left the first corner lies before the crack, moved to the
    right the line is level up to it. Nothing is read below the floor.
    """
    random = np.random.default_rng(0)
    corners_mm = np.array(DESCRIBED_MM)
    s_mm = np.arange(corners_mm[0, 0], corners_mm[-1, 0] + STATION_MM / 2, STATION_MM)
    sets: list[Profile] = []
    while len(sets) < SETS:
        moved_mm = corners_mm + random.normal(0.0, (ALONG_MM, LEVEL_MM), corners_mm.shape)
        moved_mm[0, 1] = random.uniform(*FIRST_MM)
        moved_mm[-1, 0] = corners_mm[-1, 0]
        if (np.diff(moved_mm[:, 0]) < LEAST_STEP_MM).any():
            continue
        level_mm = np.interp(s_mm, *moved_mm.T) + random.normal(0.0, SCATTER_MM / np.sqrt(REPEATS), len(s_mm))
        sets.append(Profile(s_mm, np.maximum(level_mm, FIRST_MM[0]), data="reconstructed", source="redrawn"))
    return sets


def errors_against(runs: Sequence[Finished], readings: Profile, redrawn: Sequence[Profile]) -> Floats:
    """Mean error of each run against each set, (sets, r), exact; the stations of all sets are the readings' own."""
    s_mm, error_mm = errors_on_grid(runs, readings)
    hat = hats(s_mm, readings.s_mm)
    moved_mm = np.array([one.level_mm for one in redrawn]) - readings.level_mm
    return np.array([mean_absolute(s_mm, error_mm - off_mm) for off_mm in moved_mm @ hat.T])


def beginning_at(level_mm: float, readings: Profile) -> Profile:
    """Return the readings as they would be if the described line began at another level."""
    described = np.array(DESCRIBED_MM)
    moved = described.copy()
    moved[0, 1] = level_mm
    by_mm = np.interp(readings.s_mm, *moved.T) - np.interp(readings.s_mm, *described.T)
    return Profile(readings.s_mm, readings.level_mm + by_mm, data="reconstructed", source="another beginning")


def first_readings(chosen: Profile, readings: Profile) -> list[FirstReading]:
    """What the profile of the chosen pair is off by for each level at which the line may have begun."""
    return [FirstReading(level, along(chosen, beginning_at(level, readings))) for level in FIRST_READINGS_MM]
