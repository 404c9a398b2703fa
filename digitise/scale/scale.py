"""Scale of a photo by markers in the face's plane, the face's four edges or a ruler, or as given; never guessed."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from digitise.geometry.polyline import depth_inside
from digitise.image.decoding import Pixels
from digitise.scale.face_scale import scale_by_face
from digitise.scale.marker_scale import scale_by_markers
from digitise.scale.view import Scale, View
from digitise.settings import COARSEST_MM_PER_PX, FINEST_MM_PER_PX, PhotoInput, Pixel
from sealtwin.core.errors import InputError

CLICK_PX = 1.0  # Standard deviation of each coordinate of a click
SHORTEST_RULER_PX = 50.0  # Shortest ruler: two clicks on it are uncertain by 3 % of every length
TILT_COST = 0.0035  # Standard uncertainty for a camera held by hand: 3 degrees at 0.12 % each, on synthetic photos
TILT_WARNING = (
    "a ruler does not show tilt: with the camera 5 degrees off square, lengths are wrong by up to 3.5 %, with 10 by "
    "7 %; markers or the face's corners show it"
)
UNSURE = 0.01  # Standard uncertainty of a scale that gives a warning; a crack's width is reported to twice that


def scale_by_ruler(ends_px: tuple[Pixel, Pixel], length_mm: float, size_px: tuple[int, int], file: Path) -> Scale:
    """Return the scale by two points and their distance. Raises InputError for bad points."""
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
            "of the ruler that are farther apart."
        )
    mm_per_px = length_mm / length_px
    return replace(
        given_scale(mm_per_px, False, size_px),
        scale_source=f"ruler of {length_mm:g} mm over {length_px:.0f} px",
        # Errors of both clicks along the ruler; those across it do not count.
        scale_uncertainty=float(np.hypot(np.sqrt(2) * CLICK_PX / length_px, TILT_COST)),
        warnings=(TILT_WARNING,),
    )


def given_scale(mm_per_px: float, assumed: bool, size_px: tuple[int, int]) -> Scale:
    """Return a scale, of unknown uncertainty, with a view square to the face, its origin in the lower left pixel."""
    return Scale(
        view=View(np.array([[mm_per_px, 0, 0], [0, -mm_per_px, mm_per_px * (size_px[1] - 1)], [0, 0, 1.0]])),
        mm_per_px=mm_per_px,
        scale_source=f"given: {mm_per_px:g} mm/px{' (assumed)' if assumed else ''}",
        warnings=("the scale is assumed: every length has its error",) if assumed else (),
    )


def find_scale(pixels: Pixels, settings: PhotoInput) -> Scale:
    """Find the scale that ``settings`` give. Raises InputError where the photo does not show it, or contradicts it."""
    face_mm = None if settings.face_mm is None else (0.0, 0.0, *settings.face_mm)
    if settings.markers is not None:
        scale = scale_by_markers(pixels, settings, settings.markers, face_mm)
    elif face_mm is not None:
        scale = scale_by_face(pixels, settings, face_mm)
    elif settings.ruler_px is not None and settings.ruler_mm is not None:
        scale = scale_by_ruler(settings.ruler_px, settings.ruler_mm, pixels.size_px, pixels.file)
    else:
        assert settings.mm_per_px is not None, "PhotoInput has a scale"
        scale = given_scale(settings.mm_per_px, settings.scale_is == "assumed", pixels.size_px)
    if not FINEST_MM_PER_PX <= scale.mm_per_px <= COARSEST_MM_PER_PX:
        raise InputError(
            f"{pixels.file}: by its {scale.scale_source}, a pixel of the photo is {scale.mm_per_px:.2g} mm, outside "
            f"{FINEST_MM_PER_PX:g} to {COARSEST_MM_PER_PX:g} mm. Correct the lengths and pixels that give the scale."
        )
    if scale.scale_uncertainty is None or scale.scale_uncertainty < UNSURE:
        return scale
    unsure = f"the scale's standard uncertainty is {scale.scale_uncertainty:.1%}, and so is that of every length"
    return replace(scale, warnings=(*scale.warnings, unsure))
