"""Where pixels lie on the face: by markers in its plane, by its own four edges, or as the user says. Never guessed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from digitise.pictures.raster import Map
from digitise.scaling.face_scale import scale_by_face
from digitise.scaling.flat_scale import given_scale, scale_by_ruler
from digitise.scaling.marker_scale import scale_by_markers
from digitise.scaling.view import Scale
from digitise.settings import COARSEST_MM_PER_PX, FINEST_MM_PER_PX, PhotoInput
from sealtwin.errors import InputError

UNSURE = 0.01
"""Standard uncertainty above which a scale is worth a warning: a crack's width is told to twice that."""


def find_scale(
    image: NDArray[np.uint8], brightness: Map, settings: PhotoInput, focal_px: float | None, file: Path
) -> Scale:
    """The one scale that ``settings`` give. Raises InputError where the photo does not show it, or contradicts it."""
    scale = _find(image, brightness, settings, focal_px, file)
    if not FINEST_MM_PER_PX <= scale.mm_per_px <= COARSEST_MM_PER_PX:
        raise InputError(
            f"{file}: by its {scale.source}, a pixel of the photo is {scale.mm_per_px:.2g} mm; "
            f"{FINEST_MM_PER_PX:g} to {COARSEST_MM_PER_PX:g} can be. Check the lengths and pixels that give the scale."
        )
    if scale.uncertainty is None or scale.uncertainty < UNSURE:
        return scale
    unsure = f"the scale is known to {scale.uncertainty:.1%} only (one sigma): every length may be off by that and more"
    return replace(scale, warnings=(*scale.warnings, unsure))


def _find(image: NDArray[np.uint8], brightness: Map, settings: PhotoInput, focal_px: float | None, file: Path) -> Scale:
    size_px = (image.shape[1], image.shape[0])
    face_mm = None if settings.face_mm is None else (0.0, 0.0, *settings.face_mm)
    if settings.markers is not None:
        return scale_by_markers(image, brightness, settings, settings.markers, face_mm, focal_px, file)
    if face_mm is not None:
        return scale_by_face(brightness, settings, face_mm, focal_px, file)
    if settings.ruler_px is not None and settings.ruler_mm is not None:
        return scale_by_ruler(settings.ruler_px, settings.ruler_mm, size_px, file)
    if settings.mm_per_px is None:
        raise InputError(f"{file}: no scale: give [photo.markers], face_mm, ruler_px or mm_per_px.")
    return given_scale(settings.mm_per_px, settings.scale_is == "assumed", size_px)
