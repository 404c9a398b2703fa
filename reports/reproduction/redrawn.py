"""The readings once more, as the paper's prose allows them to have been."""

import numpy as np

from fixtures.generate.paper_trial import DESCRIBED_MM, REPEATS, SCATTER_MM, STATION_MM
from sealtwin.core.records import Floats, Profile
from validate.study_figures.chart import Chart, errors_on_grid
from validate.uncertainty.budget import hats, mean_absolute

SETS = 500
"""Of readings: a share is known to 2 %."""
ALONG_MM, LEVEL_MM = 3.0, 0.5
"""Standard deviations of a corner of the described line: "several millimetres" along the crack and "about 0.5" in level
are what the fixture's README says of reading them off prose."""
LEAST_STEP_MM = 2.0
"""Between two corners: the line is described from left to right."""


def redraw() -> list[Profile]:
    """Sets of readings from a fixed seed, each its corners moved and its stations scattered as the caliper scatters.

    The line begins at the floor, below which nothing is read.
    """
    random = np.random.default_rng(0)
    corners_mm = np.array(DESCRIBED_MM)
    s_mm = np.arange(corners_mm[0, 0], corners_mm[-1, 0] + STATION_MM / 2, STATION_MM)
    sets = []
    while len(sets) < SETS:
        moved_mm = corners_mm + random.normal(0.0, (ALONG_MM, LEVEL_MM), corners_mm.shape)
        moved_mm[[0, -1], 0] = corners_mm[[0, -1], 0]
        if (np.diff(moved_mm[:, 0]) < LEAST_STEP_MM).any():
            continue
        level_mm = np.interp(s_mm, *moved_mm.T) + random.normal(0.0, SCATTER_MM / np.sqrt(REPEATS), len(s_mm))
        sets.append(Profile(s_mm, np.maximum(level_mm, corners_mm[0, 1]), data="reconstructed", source="redrawn"))
    return sets


def errors_against(chart: Chart, redrawn: list[Profile]) -> Floats:
    """Mean error of each run against each set, (sets, r), exact; the stations of all sets are the readings' own."""
    s_mm, error_mm = errors_on_grid(chart.runs, chart.readings)
    hat = hats(s_mm, chart.readings.s_mm)
    moved_mm = np.array([readings.level_mm for readings in redrawn]) - chart.readings.level_mm
    return np.array([mean_absolute(s_mm, error_mm - off_mm) for off_mm in moved_mm @ hat.T])
