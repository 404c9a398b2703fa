"""A photo with a scale: the one place where pixels become millimetres."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import rectangle
from digitise.image.decoding import Decoded, Pixels, read_mask, read_photo
from digitise.image.raster import Map
from digitise.image.second_light import darker_of_both
from digitise.scale.scale import find_scale
from digitise.scale.view import Scale
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

DISPLAY_GAMMA = 2.2  # Exponent from stored brightness to light, about a camera's: half contrast is half the light
BLACK = 15  # Darkest usable brightness of the brightest parts, of 255
RING_POINTS = 32  # Points on each side of the face: between two, a lens of k1 = -0.2 bends the side by 0.01 px


@dataclass(frozen=True, kw_only=True)
class Photo(Pixels, Scale):
    """Pixels with a scale."""

    def to_mm(self, points_px: Floats) -> Floats:
        """Map pixels to places on the face, (n, 2) to (n, 2)."""
        return self.view.to_mm(points_px)

    def to_px(self, points_mm: Floats) -> Floats:
        """Map places on the face to pixels, (n, 2) to (n, 2)."""
        return self.view.to_px(points_mm)

    @cached_property
    def face_px(self) -> Floats | None:
        """Corners of the face: lower left, lower right, upper right, upper left."""
        return None if self.face_mm is None else self.to_px(rectangle(self.face_mm))

    @cached_property
    def face_ring_px(self) -> Floats | None:
        """Edge of the face, which a lens bends, as a ring of points from the lower left corner."""
        if self.face_mm is None:
            return None
        corners_mm = rectangle(self.face_mm)
        share = np.arange(RING_POINTS)[:, None] / RING_POINTS
        sides = zip(corners_mm, np.roll(corners_mm, -1, axis=0), strict=True)
        return self.to_px(np.concatenate([start + share * (end - start) for start, end in sides]))


def load_photo(settings: PhotoInput, folder: Path) -> Photo:
    """Read the photo, whose path is in ``folder`` or absolute, and find its scale; raise InputError if that fails."""
    return scaled(read_pixels(settings, folder), settings)


def read_pixels(settings: PhotoInput, folder: Path) -> Pixels:
    """Read the pixels of ``load_photo``, which takes longer than finding their scale."""
    path = folder / settings.file
    decoded = read_photo(path)
    second = None if settings.second_photo is None else folder / settings.second_photo
    other = None if second is None else (read_photo(second, "photo.second_photo"), second)
    drawn = None if settings.mask is None else read_mask(folder / settings.mask, decoded.image.shape[1::-1])
    return pixels_of(decoded, path, other, drawn)


def pixels_of(
    decoded: Decoded, file: Path, second: tuple[Decoded, Path] | None = None, drawn: NDArray[np.bool_] | None = None
) -> Pixels:
    """Combine pictures in memory: each pixel's brightness is the darker one's, its colour the first one's.

    ``second`` is lit from the other side, ``drawn`` the mask of the crack, (height, width). Raises InputError where a
    picture is black, or both do not show the same scene.
    """
    brightness, warnings = _light(decoded.image, file), decoded.warnings
    if second is not None:
        other, name = second
        brightness, remarks = darker_of_both(brightness, _light(other.image, name), name)
        warnings += remarks
    return Pixels(
        file=file, image=decoded.image, brightness=brightness, focal_px=decoded.focal_px, drawn=drawn, warnings=warnings
    )


def scaled(pixels: Pixels, settings: PhotoInput) -> Photo:
    """Give pixels the scale that ``settings`` ask for. Raises InputError where the photo does not show it."""
    scale = find_scale(pixels, settings)
    return Photo(**{**vars(pixels), **vars(scale), "warnings": (*pixels.warnings, *scale.warnings)})


def _light(image: NDArray[np.uint8], file: Path) -> Map:
    """Return the linear luminance of each pixel. Raises InputError for a black picture."""
    to_light = (np.arange(256) / 255.0) ** DISPLAY_GAMMA
    light = np.zeros(image.shape[:2], dtype=np.float32)
    for channel, weight in enumerate((0.2126, 0.7152, 0.0722)):
        light += (weight * to_light).astype(np.float32)[image[..., channel]]
    if np.percentile(light[::2, ::2], 99.5) < (BLACK / 255) ** DISPLAY_GAMMA:
        raise InputError(f"{file}: the photo is black; take it with more light or a longer exposure.")
    return light
