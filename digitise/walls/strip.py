"""Straighten the photo along a line: brightness on its rays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from digitise.photo import Photo
from digitise.walls.patch import Patch
from sealtwin.records import Floats, arc_length

FINEST_PX, COARSEST_PX = 0.5, 1.5
"""Between samples across the crack, in pixels of the photo: an edge, blurred, is three wide."""
SAMPLES = 48
"""Across one crack width; more cost time and show nothing."""


@dataclass(frozen=True)
class Strip:
    """Brightness on both sides of a line, (stations, offsets)."""

    line_mm: Floats
    ray: Floats
    """To the left, (stations, 2), as long as reaches 1 mm square to the line."""
    offset_mm: Floats
    """Square to the line; increasing, evenly; positive to the left, 0 in the middle."""
    light: Floats
    valid: NDArray[np.bool_]
    """On the sample, and in the photo."""
    mm_per_px: float

    @property
    def sample_px(self) -> float:
        """Between neighbours across."""
        return float(self.offset_mm[1] - self.offset_mm[0]) / self.mm_per_px

    @property
    def station_px(self) -> float:
        """Between neighbours along."""
        return float(arc_length(self.line_mm)[-1]) / (len(self.line_mm) - 1) / self.mm_per_px

    @property
    def middle(self) -> int:
        """Column of the line itself."""
        return len(self.offset_mm) // 2

    def places_mm(self, offset_mm: Floats) -> Floats:
        """One place on each ray, (stations, 2)."""
        return self.line_mm + offset_mm[:, None] * self.ray


def straighten(photo: Photo, patch: Patch, line_mm: Floats, ray: Floats, step_mm: float, reach_mm: float) -> Strip:
    """Sample the photo every ``step_mm`` up to ``reach_mm`` to either side of the line."""
    count = int(np.ceil(reach_mm / step_mm))
    offset_mm = np.arange(-count, count + 1.0) * step_mm
    place_mm = line_mm[:, None] + offset_mm[:, None] * ray[:, None]
    place_px = photo.to_px(place_mm.reshape(-1, 2)).reshape(place_mm.shape)
    return Strip(line_mm, ray, offset_mm, patch.light(place_px), patch.on_sample(place_px, place_mm), photo.mm_per_px)


def sample_step_mm(width_mm: float, mm_per_px: float) -> float:
    """Between samples across a crack about ``width_mm`` wide."""
    return float(np.clip(width_mm / SAMPLES, FINEST_PX * mm_per_px, COARSEST_PX * mm_per_px))
