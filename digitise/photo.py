"""A photo with a scale: the one place where pixels become millimetres."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import Box, rectangle
from digitise.pictures.decoding import read_mask, read_photo
from digitise.pictures.raster import Map
from digitise.pictures.second_light import darker_of_both
from digitise.scaling.scale import find_scale
from digitise.scaling.view import View
from digitise.settings import PhotoInput
from sealtwin.errors import InputError
from sealtwin.records import Floats

DISPLAY_GAMMA = 2.2
"""Cameras store the 2.2th root of light, near enough. Half contrast is half the light, not half the number."""
BLACK = 15
"""Of 255. A photo whose brightest parts are darker shows nothing."""

RING_POINTS = 32
"""On each side of the face: a lens of k1 = -0.2 bends what lies between two of them by a hundredth of a pixel."""


@dataclass(frozen=True)
class Photo:
    """Pixels and where they lie on the face."""

    file: Path
    image: NDArray[np.uint8]
    """(height, width, 3), RGB, as the camera stored it."""
    brightness: Map
    """Proportional to light, 0 to 1."""
    view: View
    """The only mapping between pixels and millimetres."""
    face_mm: Box | None
    mm_per_px: float
    """At the centre of the face, or of the photo where the face is not known."""
    scale_source: str
    scale_residual_mm: float | None
    scale_uncertainty: float | None = None
    """Standard uncertainty of a length for the scale alone, over the length; None where nothing tells it."""
    camera_tilt_deg: float | None = None
    """Between the camera's axis and the normal of the face, where the photo shows it."""
    markers_px: tuple[Floats, ...] = ()
    """Corners of the markers found: they are not part of the sample."""
    drawn: NDArray[np.bool_] | None = None
    """Where the user has painted the crack, (height, width); None where it is to be found."""
    warnings: tuple[str, ...] = ()

    @property
    def size_px(self) -> tuple[int, int]:
        """Width, height."""
        return self.brightness.shape[1], self.brightness.shape[0]

    def to_mm(self, points_px: Floats) -> Floats:
        """(n, 2) to (n, 2)."""
        return self.view.to_mm(points_px)

    def to_px(self, points_mm: Floats) -> Floats:
        """(n, 2) to (n, 2)."""
        return self.view.to_px(points_mm)

    def mm_per_px_at(self, points_px: Floats) -> Floats:
        """Local scale at each point, (n,): by tilt and lens it is not the same everywhere."""
        return self.view.mm_per_px_at(points_px)

    @cached_property
    def face_px(self) -> Floats | None:
        """Corners of the face: lower left, lower right, upper right, upper left."""
        return None if self.face_mm is None else self.to_px(rectangle(self.face_mm))

    @cached_property
    def face_ring_px(self) -> Floats | None:
        """The face's edge, which a lens bends, as a ring of many points from the same corner."""
        if self.face_mm is None:
            return None
        corners_mm = rectangle(self.face_mm)
        share = np.arange(RING_POINTS)[:, None] / RING_POINTS
        sides = zip(corners_mm, np.roll(corners_mm, -1, axis=0), strict=True)
        return self.to_px(np.concatenate([start + share * (end - start) for start, end in sides]))


@dataclass(frozen=True)
class Pixels:
    """What a photo's file shows, whatever its scale; the fields are those of ``Photo``."""

    file: Path
    image: NDArray[np.uint8]
    brightness: Map
    focal_px: float | None
    """As the camera noted it."""
    drawn: NDArray[np.bool_] | None = None
    warnings: tuple[str, ...] = ()


def load_photo(settings: PhotoInput, folder: Path) -> Photo:
    """Read the photo, which lies in ``folder`` unless its path is absolute, and find its scale.

    A second photo lends its darker pixels to the brightness; the colours are the first one's. Raises InputError where a
    picture cannot be read or is black, or the photo shows too little to measure by.
    """
    return scaled(read_pixels(settings, folder), settings)


def read_pixels(settings: PhotoInput, folder: Path) -> Pixels:
    """The first, and slower, half of ``load_photo``."""
    path = folder / settings.file
    decoded = read_photo(path)
    brightness, warnings = _light(decoded.image, path), decoded.warnings
    if settings.second_photo is not None:
        second = folder / settings.second_photo
        other = _light(read_photo(second, "photo.second_photo").image, second)
        brightness, remarks = darker_of_both(brightness, other, second)
        warnings += remarks
    return Pixels(
        file=path,
        image=decoded.image,
        brightness=brightness,
        focal_px=decoded.focal_px,
        drawn=None if settings.mask is None else read_mask(folder / settings.mask, decoded.image.shape[1::-1]),
        warnings=warnings,
    )


def scaled(pixels: Pixels, settings: PhotoInput) -> Photo:
    """The second half of ``load_photo``: pixels with the scale that ``settings`` give."""
    scale = find_scale(pixels.image, pixels.brightness, settings, pixels.focal_px, pixels.file)
    return Photo(
        file=pixels.file,
        image=pixels.image,
        brightness=pixels.brightness,
        view=scale.view,
        face_mm=scale.face_mm,
        mm_per_px=scale.mm_per_px,
        scale_source=scale.source,
        scale_residual_mm=scale.residual_mm,
        scale_uncertainty=scale.uncertainty,
        camera_tilt_deg=scale.camera_tilt_deg,
        markers_px=scale.markers_px,
        drawn=pixels.drawn,
        warnings=(*pixels.warnings, *scale.warnings),
    )


def _light(image: NDArray[np.uint8], file: Path) -> Map:
    """Luminance of each pixel, linear. Raises InputError where there is none to speak of."""
    to_light = (np.arange(256) / 255.0) ** DISPLAY_GAMMA
    light = np.zeros(image.shape[:2], dtype=np.float32)
    for channel, weight in enumerate((0.2126, 0.7152, 0.0722)):
        light += (weight * to_light).astype(np.float32)[image[..., channel]]
    if np.percentile(light[::2, ::2], 99.5) < (BLACK / 255) ** DISPLAY_GAMMA:
        raise InputError(f"{file}: the photo is all black; give it more light or a longer exposure.")
    return light
