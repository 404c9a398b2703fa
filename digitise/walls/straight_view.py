"""The photo of a crack, straightened along its centreline."""

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import at_arc_length, left_normals
from digitise.photo import Photo
from sealtwin.core.records import Outline

AROUND = 1.5  # Half of the shown height over the crack's mean width: as much ground on each side as the crack is wide
MOST_PX = 1400  # Largest length of the picture: a report shows it 800 px long


def straight_view(photo: Photo, outline: Outline) -> NDArray[np.uint8]:
    """Return the photo along the crack, (height, width, 3): s runs right from 0 to the length, left of the crack is up.

    The first and the last column are at both ends, and the centreline is half way up; a pixel has the same size along
    and across. What is outside the photo is white.
    """
    mm_per_px = max(photo.mm_per_px, outline.length_mm / (MOST_PX - 1))
    columns = max(2, 1 + round(outline.length_mm / mm_per_px))
    s_mm = np.linspace(0.0, outline.length_mm, columns)
    half_px = max(1, round(AROUND * outline.mean_width_mm / mm_per_px))
    across_mm = np.arange(half_px, -half_px - 1, -1) * (s_mm[1] - s_mm[0])
    middle_mm = at_arc_length(outline.centreline_mm, outline.s_mm, s_mm)
    places_mm = middle_mm + across_mm[:, None, None] * left_normals(middle_mm)
    places_px = photo.to_px(places_mm.reshape(-1, 2)).reshape(places_mm.shape).astype(np.float32)
    straight = cv2.remap(
        photo.image, places_px[..., 0], places_px[..., 1], cv2.INTER_LINEAR, None, cv2.BORDER_CONSTANT, (255,) * 3
    )
    return np.asarray(straight if straight.ndim == 3 else np.repeat(straight[..., None], 3, 2), dtype=np.uint8)
