"""Read the lightness on both sides of a crack's walls, and how light the crack and the ground are there."""

from dataclasses import dataclass
from functools import partial
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from digitise.geometry.polyline import left_normals, smoothed
from digitise.image.raster import lightness
from digitise.photo import Photo
from digitise.walls.straightened import Strip, patch_around, straighten
from digitise.walls.wall_profile import outward, steadied
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats

# Constants of the levels beside walls. "widths" are crack widths. Chosen on 86 drawn roads.
ALONG = 0.25  # Widths of the median along the crack
CORE = 0.15  # Distance inside a wall, over its distance from the line, plus ``CORE_PX``, from which on is crack
CORE_PX = 0.5
CORE_PERCENTILE = 30.0  # Of the lightness between the walls: the crack's own
GROUND = 0.35  # Widths beside a wall, plus ``GROUND_PX``, from which on is ground
GROUND_PX = 2.0
STEADY = 3.0  # Widths along which both levels are medians


@dataclass(frozen=True)
class Along:
    """Both walls of a crack as distances from the line between them."""

    photo: Photo
    line_mm: Floats  # (stations, 2)
    ray: Floats  # Unit vectors to the left, (stations, 2)
    walls_px: Floats  # Distance of the left and of the right wall, (2, stations), positive outward
    width_px: float
    station_px: float  # Spacing of stations

    @classmethod
    def of(cls, photo: Photo, line_mm: Floats, left_mm: Floats, right_mm: Floats) -> Self:
        station_px = float(arc_length(line_mm)[-1]) / (len(line_mm) - 1) / photo.mm_per_px
        width_px = max(float(np.median(np.linalg.norm(left_mm - right_mm, axis=1))) / photo.mm_per_px, 4.0)
        ray = left_normals(smoothed(line_mm, width_px / station_px))
        walls_px = np.stack([((left_mm - line_mm) * ray).sum(axis=1), ((line_mm - right_mm) * ray).sum(axis=1)])
        return cls(photo, line_mm, ray, walls_px / photo.mm_per_px, width_px, station_px)

    def places_mm(self, aside_px: Floats) -> Floats:
        """Return the place at a distance to the left of each station, (stations, 2)."""
        return self.line_mm + (aside_px * self.photo.mm_per_px)[:, None] * self.ray

    def odd(self, widths: float) -> int:
        """Return the odd number of stations, 3 or more, in a length of crack widths."""
        return int(max(3, widths * self.width_px / self.station_px)) | 1


@dataclass(frozen=True)
class Levels:
    """Lightness from the line outward, (2, stations, samples), and that of crack and ground."""

    strip: Strip
    even: Floats  # Evened along the crack
    valid: NDArray[np.bool_]
    dark: Floats  # Lightness of the crack, (stations,)
    bright: Floats  # Lightness of the ground beside each wall, (2, stations)

    @classmethod
    def of(cls, along: Along, reach_px: float, step_px: float = 1.0) -> Self:
        """Read up to ``reach_px`` from the line, every ``step_px``."""
        photo, px = along.photo, along.photo.mm_per_px
        patch = patch_around(photo, photo.to_px(along.line_mm), reach_px)
        strip = straighten(photo, patch, along.line_mm, along.ray, step_px * px, reach_px * px)
        even = median_filter(lightness(outward(strip, strip.light)), (1, along.odd(ALONG), 1), mode="nearest")
        valid = outward(strip, strip.valid)
        walls_px = along.walls_px[..., None]
        over_px = np.arange(even.shape[2]) * strip.sample_px - walls_px
        core, ground = over_px < -CORE_PX - CORE * walls_px, over_px > GROUND * along.width_px + GROUND_PX
        own = np.concatenate(list(np.where(core & valid, even, np.nan)), axis=1)[None]
        darkest = partial(np.nanpercentile, q=CORE_PERCENTILE)
        dark = steadied(own, along.odd(STEADY), darkest)[0]
        bright = steadied(np.where(ground & valid, even, np.nan), along.odd(STEADY))
        return cls(strip, even, valid, dark, bright)
