"""How U and D change the mean error: stages, reach, plateaus, fluctuation and regions of the map."""

from typing import Any

import numpy as np

from reports.reproduction.surface import Surface
from sealtwin.core.records import Floats

LOW, HIGH = 1.0, 100.0
"""U at which the paper's stages change."""
PLATEAU_CM, WIDE_CM = 0.001, 0.3
"""D up to which the paper sees a plateau, and from which we call it large."""
LEVEL = 1 / 3
"""Most that a plateau's slope may have of the slope beside it."""
LITTLE = 1 / 2
"""Most that little influence may have of what is clear."""
ACCURATE = 1 / 3
"""Lower part of the range of mean errors that counts as accurate: what the colours of the paper's map have purple."""
LEAST_PAIRS = 2
"""Fewest neighbouring pairs that are a region: one alone may be scatter."""


def stages(surface: Surface, d_cm: float) -> tuple[float, float, float]:
    """Slope of the mean error over U at one D, mm a power of ten: up to U = 1, from 1 to 100, from 100 on."""
    u, error_mm = surface.along_u(d_cm)
    return _slope(u, error_mm, 0.0, LOW), _slope(u, error_mm, LOW, HIGH), _slope(u, error_mm, HIGH, np.inf)


def three_stages(surface: Surface) -> list[bool]:
    """Whether U has a plateau, then lowers the error, then raises it, at each D."""
    slopes = [stages(surface, float(d_cm)) for d_cm in np.unique(surface.d_cm)]
    return [second < 0 and abs(first) < -LEVEL * second and third > 0 for first, second, third in slopes]


def told_stages(surface: Surface) -> str:
    d_cm, holds = np.unique(surface.d_cm), np.array(three_stages(surface))
    if holds.all():
        return f"so at all {len(holds)} D"
    return f"so at {holds.sum()} of {len(holds)} D; not at {', '.join(f'{value:g}' for value in d_cm[~holds])} cm"


def reach_of_drag(surface: Surface) -> tuple[float, float, float]:
    """What D from 0.3 cm on does to the mean error against D up to 0.001 cm, mm: U below 1, between, above 100."""
    return _drag(surface, 0.0, LOW * 0.99), _drag(surface, LOW * 1.01, HIGH * 0.99), _drag(surface, HIGH * 1.01, np.inf)


def drag_reaches_the_middle(surface: Surface) -> bool:
    low, middle, high = reach_of_drag(surface)
    return middle < 0 and max(abs(low), abs(high)) < -LITTLE * middle


def plateau_of_drag(surface: Surface) -> tuple[float, float]:
    """Slope of the mean error over D, mean of all U, mm a power of ten: up to 0.001 cm, and from there to 0.3 cm."""
    d_cm, error_mm = surface.by_d()
    return _slope(d_cm, error_mm, 0.0, PLATEAU_CM), _slope(d_cm, error_mm, PLATEAU_CM, WIDE_CM)


def drag_begins_level(surface: Surface) -> bool:
    below, above = plateau_of_drag(surface)
    return above < 0 and abs(below) < -LEVEL * above


def fluctuation(surface: Surface) -> tuple[float, float]:
    """How far the mean error goes back and forth as D grows, mm, a mean over U: between 1 and 100, and above 100.

    It is the path less the way: what all steps sum up to without their signs, less what they sum up to with them.
    """
    u = np.unique(surface.u)
    between, above = u[(u > LOW) & (u < HIGH)], u[u > HIGH]
    return _back_and_forth(surface, between), _back_and_forth(surface, above)


def fluctuates_above(surface: Surface) -> bool:
    between, above = fluctuation(surface)
    return above > between


def accurate_regions(surface: Surface) -> list[int]:
    """Numbers of pairs in each region of neighbouring pairs with an error in the lower third, largest first."""
    from scipy.ndimage import label

    grid_mm = surface.on_grid()
    limit_mm = surface.error_mm.min() + ACCURATE * np.ptp(surface.error_mm)
    regions: Any = label(grid_mm <= limit_mm)
    sizes = np.bincount(regions[0].ravel())[1:]
    return sorted((int(size) for size in sizes if size >= LEAST_PAIRS), reverse=True)


def _slope(setting: Floats, error_mm: Floats, low: float, high: float) -> float:
    inside = (setting >= low) & (setting <= high)
    return float(np.polyfit(np.log10(setting[inside]), error_mm[inside], 1)[0])


def _drag(surface: Surface, low: float, high: float) -> float:
    return surface.mean_mm((low, high), (WIDE_CM, np.inf)) - surface.mean_mm((low, high), (0.0, PLATEAU_CM))


def _back_and_forth(surface: Surface, u: Floats) -> float:
    steps = [np.diff(surface.along_d(float(value))[1]) for value in u]
    return float(np.mean([np.abs(one).sum() - abs(one.sum()) for one in steps]))
