"""Measure how much a line that was found without clicks looks like a crack.

A crack is dark between two sides alike, all along, and it wanders.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from digitise.crack_path.darkness import DarkMap
from digitise.crack_path.joints import straight_share
from digitise.crack_path.profiles import profiles_across
from digitise.image.raster import Map, blurred, lightness
from digitise.photo import Photo
from sealtwin.core.records import Floats

CORE, CORE_PX = 0.25, 1.0  # Widths and least px from the line that are its own light
SIDES, SIDES_PX = (0.9, 2.2), (2.0, 5.0)  # Widths, plus px, between which its sides are
AVERAGED, AVERAGED_SHARE, AVERAGED_PX = 3.0, 0.06, 6.0  # Widths, share of the line and px over which light is averaged
WORST = 10  # Percentile of the step along the line that is its worst stretch
GRAIN_CELLS, EVEN_CELLS = 1.5, 30.0  # Sigma of the blur before grain is measured, and of the mean that is taken away
MOST_UNLIKE = 0.20  # Largest difference of both sides over the step of a crack: 93 % of 102 cracks, 29 % of 34 others
LEAST_WORST = 1.5  # Least worst step over the grain of a line that is taken alone: with both, 82 % and 15 %
MOST_STRAIGHT = 0.3  # Largest straight share of a line that is surely no joint, chosen on 127 real photos


@dataclass(frozen=True)
class Likeness:
    """Figures of one line, in lightness."""

    unlike: float
    """Difference between the two sides, divided by the median step from the line to the darker side."""
    worst: float
    """Step to the darker side in the line's worst stretch, divided by the grain of the ground."""

    straight: float
    """Share of the line that its longest straight stretch takes."""

    @property
    def two_sided(self) -> bool:
        """True if both sides are alike. They are not along a marking, a patch or an edge."""
        return self.unlike <= MOST_UNLIKE

    @property
    def may_be_joint(self) -> bool:
        return self.straight > MOST_STRAIGHT

    @property
    def sure(self) -> bool:
        """True if the line may be taken without a question."""
        return self.two_sided and not self.may_be_joint and self.worst >= LEAST_WORST


def grain_of(field: DarkMap) -> float:
    """Return the standard deviation of the ground's lightness in the search map, by its median deviation."""
    light = lightness(field.light)
    soft = blurred(light - blurred(light, EVEN_CELLS), GRAIN_CELLS)[field.allowed]
    return float(1.4826 * np.median(np.abs(soft - np.median(soft)))) if len(soft) else 0.0


def likeness(photo: Photo, line_px: Floats, width_px: float, grain: float, cells: Floats) -> Likeness:
    """Measure a line about ``width_px`` wide in a photo with ``grain``. ``cells`` is the line on the search map."""
    near_px, far_px = (widths * width_px + px for widths, px in zip(SIDES, SIDES_PX, strict=True))
    profiles = profiles_across(photo, line_px, width_px, far_px)
    light, offset_px = lightness(profiles.light), profiles.offset_px
    own = np.nanmean(light[:, np.abs(offset_px) <= max(CORE_PX, CORE * width_px)], axis=1)
    beside = (np.abs(offset_px) >= near_px) & (np.abs(offset_px) <= far_px)
    sides = [_filled_median(light[:, beside & (sign * offset_px > 0)]) for sign in (1, -1)]
    over = int(max(AVERAGED * width_px, AVERAGED_SHARE * len(own), AVERAGED_PX)) | 1
    step = np.minimum(*(uniform_filter1d(side - own, over, mode="nearest") for side in sides))
    middle = max(float(np.median(step)), 1e-3)
    unlike = abs(float(np.median(sides[0]) - np.median(sides[1]))) / middle
    worst = float(np.percentile(step, WORST)) / max(grain, 1e-3)
    return Likeness(unlike, worst, straight_share(cells))


def _filled_median(light: Map) -> Floats:
    """Return the median of each station; one out of the photo has that of the whole side."""
    shown = np.isfinite(light).any(axis=1)
    if not shown.any():
        return np.zeros(len(light))
    medians = np.zeros(len(light))
    medians[shown] = np.nanmedian(light[shown], axis=1)
    medians[~shown] = np.median(medians[shown])
    return medians
