"""What similaritymeasures gives when its two curves are sampled unequally, as the paper may have fed it.

The paper divides the library's area between the curves by the length, and does not say on which points. The library
pads the curve with fewer points by halving its longest pieces, then pairs point with point: on one common grid that is
exact.
"""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.figures.chart import Chart, HeldRun

SAMPLINGS = (17, 41, 81, 161, 401)
"""Points of the profile along the crack; the readings have 17. The last are all that a profile holds."""
OF_ALL = 81
"""For all runs of a study: a point every millimetre. The time grows with its square."""


@dataclass(frozen=True)
class Careless:
    """One profile, by its number of points."""

    points: int
    error_mm: float
    """The library's area over the length."""


def by_sampling(run: HeldRun, readings: Profile) -> list[Careless]:
    return [Careless(points, careless_error_mm(run.profile, readings, points)) for points in SAMPLINGS]


def of_all(chart: Chart) -> Floats:
    """Of each run with the same number of points, (r,)."""
    return np.array([careless_error_mm(run.profile, chart.readings, OF_ALL) for run in chart.runs])


def careless_error_mm(profile: Profile, readings: Profile, points: int) -> float:
    """Mean error as the library gives it for a profile of so many even points against the readings as they are."""
    import similaritymeasures

    s_mm = np.linspace(readings.s_mm[0], readings.s_mm[-1], points)
    simulated = np.column_stack([s_mm, np.interp(s_mm, profile.s_mm, profile.level_mm)])
    measured = np.column_stack([readings.s_mm, readings.level_mm])
    area_mm2 = similaritymeasures.area_between_two_curves(simulated, measured)
    return float(area_mm2 / (readings.s_mm[-1] - readings.s_mm[0]))
