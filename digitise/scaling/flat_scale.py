"""The scale of a photo that is taken to be square to the face: by two points of a ruler, or as given."""

from pathlib import Path

import numpy as np

from digitise.geometry.polyline import depth_inside
from digitise.scaling.view import Scale, View
from digitise.settings import Pixel
from sealtwin.errors import InputError

CLICK_PX = 1.0
"""Standard deviation of each coordinate of a click."""
SHORTEST_RULER_PX = 50.0
"""Below it, two clicks leave 3 % of every length open."""
TILT_COST = 0.0035
"""Of a degree of tilt, standard uncertainty of the scale for a camera held by hand: three degrees, and 0.12 % each over
a face of 160 mm at 260 mm. Measured on synthetic photos, as are the figures of ``TILT_WARNING``.
"""
TILT_WARNING = (
    "a ruler does not show tilt: with the camera 5 degrees off square, lengths are wrong by up to 3.5 %, with 10 by "
    "7 %; markers or the face's corners would tell"
)


def scale_by_ruler(ends_px: tuple[Pixel, Pixel], length_mm: float, size_px: tuple[int, int], file: Path) -> Scale:
    """From two points and their distance. Raises InputError where they lie outside the photo or hardly apart."""
    points_px = np.array(ends_px, dtype=float)
    if np.any(depth_inside(points_px, (-0.5, -0.5, size_px[0] - 0.5, size_px[1] - 0.5)) < 0):
        raise InputError(
            f"{file}: ruler_px has a point outside the photo of {size_px[0]} x {size_px[1]} px; x runs right and y "
            "down, from 0."
        )
    length_px = float(np.linalg.norm(points_px[1] - points_px[0]))
    if length_px < SHORTEST_RULER_PX:
        raise InputError(
            f"{file}: the points of ruler_px are {length_px:.1f} px apart, need {SHORTEST_RULER_PX:g}: give two marks "
            "of the ruler that lie far apart."
        )
    mm_per_px = length_mm / length_px
    return Scale(
        view=_square_view(mm_per_px, size_px),
        mm_per_px=mm_per_px,
        source=f"ruler of {length_mm:g} mm over {length_px:.0f} px",
        # Only what a click strays along the ruler counts, at both ends.
        uncertainty=float(np.hypot(np.sqrt(2) * CLICK_PX / length_px, TILT_COST)),
        warnings=(TILT_WARNING,),
    )


def given_scale(mm_per_px: float, assumed: bool, size_px: tuple[int, int]) -> Scale:
    """As the user says; nothing in the photo tells how well."""
    return Scale(
        view=_square_view(mm_per_px, size_px),
        mm_per_px=mm_per_px,
        source=f"given: {mm_per_px:g} mm/px{' (assumed)' if assumed else ''}",
        warnings=("the scale is assumed: every length is only as good as it",) if assumed else (),
    )


def _square_view(mm_per_px: float, size_px: tuple[int, int]) -> View:
    """With its origin in the lower left pixel, and y up."""
    return View(np.array([[mm_per_px, 0, 0], [0, -mm_per_px, mm_per_px * (size_px[1] - 1)], [0, 0, 1.0]]))
