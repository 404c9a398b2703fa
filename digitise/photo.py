"""A photo with a scale, made from one or two pictures. Only this module converts pixels to millimetres."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import depth_inside, rectangle
from digitise.image.decoding import BLACK, BRIGHT_PART, Decoded, Pixels, read_photo
from digitise.image.painted import read_mask
from digitise.image.raster import Map, moved
from digitise.image.tone_curve import DISPLAY_GAMMA
from digitise.scale.face_scale import scale_by_face
from digitise.scale.marker_scale import scale_by_markers, unused_markers
from digitise.scale.view import Scale, View
from digitise.settings import COARSEST_MM_PER_PX, FINEST_MM_PER_PX, PhotoInput, Pixel
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats

RING_POINTS = 32  # Points on each side of the face: between two, a lens of k1 = -0.2 bends the side by 0.01 px
TILES = 3  # Tiles along each side in which a second photo is compared; a rotated camera shifts each differently
TILE_PX = 512
GRAIN_PX, LIGHT_PX = 1, 17  # Blur that preserves a tile's grain; width above which light varies more than grain
GRAINS = 2.0  # Largest difference that counts, over the median grain; more is a difference in light
LEAST_PEAK = 0.2  # Least peak of a tile's phase correlation: over 0.7 for the same grain in both photos, 0.02 for other
MOST_MOVED_PX = 2.0  # Largest shift that is corrected, as of a tripod that was touched
MOST_APART_PX = 1.0  # Largest difference of a tile's shift from the median; more is a rotation, which no shift corrects
LEAST_MOVED_PX = 0.1  # Smallest shift that is corrected; resampling for less would blur more than it corrects
CLICK_PX = 1.0  # Standard deviation of each coordinate of a click
SHORTEST_RULER_PX = 50.0  # Shortest ruler: two clicks on it are uncertain by 3 % of every length
TILT_COST = 0.0035  # Standard uncertainty for a camera held by hand: 3 degrees at 0.12 % each, on synthetic photos
TILT_WARNING = (
    "a ruler does not show tilt: lengths are wrong by up to 3.5 % if the camera is 5 degrees off square, and by up "
    "to 7 % at 10 degrees; give markers or the face's corners to measure it"
)
UNSURE = 0.01  # Least standard uncertainty of a scale with a warning; a crack's width is reported to twice that


@dataclass(frozen=True, kw_only=True)
class Photo(Pixels, Scale):
    """Pixels with a scale."""

    def to_mm(self, points_px: Floats) -> Floats:
        """Map pixels to places on the face, (n, 2) to (n, 2)."""
        return self.view.to_mm(points_px)

    def to_px(self, points_mm: Floats) -> Floats:
        """Map places on the face to pixels, (n, 2) to (n, 2)."""
        return self.view.to_px(points_mm)

    def in_both_units(self, **lines_mm: Floats) -> dict[str, Any]:
        """Return lines on the face as a dict with two keys each: the name plus ``_mm`` and, in pixels, plus ``_px``."""
        in_px = {f"{name}_px": self.to_px(line_mm) for name, line_mm in lines_mm.items()}
        return {f"{name}_mm": line_mm for name, line_mm in lines_mm.items()} | in_px

    @property
    def facts_of_outline(self) -> dict[str, Any]:
        """Return the fields of an ``Outline`` that come from the photo."""
        names = ("face_mm", "mm_per_px", "scale_source", "scale_residual_mm", "scale_uncertainty", "camera_tilt_deg")
        return {name: getattr(self, name) for name in names} | {"photo_size_px": self.size_px}

    @cached_property
    def face_px(self) -> Floats | None:
        """Corners of the face: lower left, lower right, upper right, upper left."""
        return None if self.face_mm is None else self.to_px(rectangle(self.face_mm))

    @cached_property
    def face_ring_px(self) -> Floats | None:
        """Edge of the face as a ring of points from the lower left corner. A lens bends it."""
        if self.face_mm is None:
            return None
        start = rectangle(self.face_mm)[:, None]
        share = np.arange(RING_POINTS)[:, None] / RING_POINTS
        return self.to_px((start + share * (np.roll(start, -1, axis=0) - start)).reshape(-1, 2))


def load_photo(settings: PhotoInput, folder: Path) -> Photo:
    """Read the photo in ``folder``, unless its path is absolute, and find its scale. Raises InputError on failure."""
    photo = scaled(read_pixels(settings, folder), settings)
    return replace(photo, warnings=(*photo.warnings, *beside_markers(photo, settings)))


def beside_markers(photo: Photo, settings: PhotoInput) -> tuple[str, ...]:
    """Return a warning if the photo shows markers but its scale is typed or from a ruler."""
    if settings.mm_per_px is not None:
        return unused_markers(photo, photo.mm_per_px, f"photo.mm_per_px = {settings.mm_per_px:g}")
    if settings.ruler_px is not None:
        return unused_markers(photo, photo.mm_per_px, f"photo.ruler_px ({photo.mm_per_px:.4g} mm/px)")
    return ()


def read_pixels(settings: PhotoInput, folder: Path) -> Pixels:
    """Read the pixels for ``load_photo``. This takes longer than finding their scale."""
    path = folder / settings.file
    decoded = read_photo(path)
    second = None if settings.second_photo is None else folder / settings.second_photo
    other = None if second is None else (_another(second, path, decoded), second)
    drawn = None if settings.mask is None else read_mask(folder / settings.mask, decoded.image.shape[1::-1])
    return pixels_of(decoded, path, other, drawn)


def _another(second: Path, path: Path, decoded: Decoded) -> Decoded:
    """Read the second photo. Raises InputError if it is the same as the first one."""
    other = read_photo(second, "photo.second_photo")
    if np.array_equal(other.image, decoded.image):
        raise InputError(
            f"{second}: photo.second_photo shows the same pixels as {path.name}; give a photo lit from the other side, "
            "or leave it out."
        )
    return other


def pixels_of(
    decoded: Decoded, file: Path, second: tuple[Decoded, Path] | None = None, drawn: NDArray[np.bool_] | None = None
) -> Pixels:
    """Combine pictures in memory: brightness is that of the darker one at each pixel, colour that of the first.

    ``second`` is lit from the other side, and ``drawn`` is the mask of the crack, (height, width). Raises InputError if
    a picture is black, or if the second picture does not show the scene of the first.
    """
    brightness, warnings = _light(decoded.image, file), decoded.warnings
    if second is not None:
        other, name = second
        brightness, remarks = darker_of_both(brightness, _light(other.image, name), name)
        warnings += (*(f"{name.name}: {warning}" for warning in other.warnings), *remarks)
    return Pixels(**{**vars(decoded), "warnings": warnings}, file=file, brightness=brightness, drawn=drawn)


def scaled(pixels: Pixels, settings: PhotoInput) -> Photo:
    """Return the pixels with the scale that ``settings`` give. Raises InputError if the photo does not show it."""
    scale = find_scale(pixels, settings)
    return Photo(**{**vars(pixels), **vars(scale), "warnings": (*pixels.warnings, *scale.warnings)})


def _light(image: NDArray[np.uint8], file: Path) -> Map:
    """Return the linear luminance of each pixel. Raises InputError for a black picture."""
    to_light = (np.arange(256) / 255.0) ** DISPLAY_GAMMA
    light = np.zeros(image.shape[:2], dtype=np.float32)
    for channel, weight in enumerate((0.2126, 0.7152, 0.0722)):
        light += (weight * to_light).astype(np.float32)[image[..., channel]]
    if np.percentile(light[::2, ::2], BRIGHT_PART) < (BLACK / 255) ** DISPLAY_GAMMA:
        raise InputError(f"{file}: the photo is black; take it with more light or a longer exposure.")
    return light


def darker_of_both(light: Map, second: Map, file: Path) -> tuple[Map, tuple[str, ...]]:
    """Align the second photo, and return the darker light at each pixel and warnings.

    The photos are lit from opposite sides, so that each wall is dark in one of them. Raises InputError, which names the
    second one's ``file``, if the two photos do not show the same scene.
    """
    if second.shape != light.shape:
        raise InputError(
            f"{file}: the second photo is {second.shape[1]} x {second.shape[0]} px, the first {light.shape[1]} x "
            f"{light.shape[0]}: take both with the same camera, and do not crop them."
        )
    shifts_px, matched = _shifts(light, second)
    if np.mean(matched) < 0.5:
        raise InputError(
            f"{file}: the second photo does not show the scene of the first; leave the camera in place, and move "
            "only the lamp."
        )
    shift_px = np.median(shifts_px[matched], axis=0)
    (x_px, y_px), moved_px = shift_px, float(np.linalg.norm(shift_px))
    apart_px = float(np.linalg.norm(shifts_px[matched] - shift_px, axis=1).max())
    if moved_px > MOST_MOVED_PX or apart_px > MOST_APART_PX:
        raise InputError(
            f"{file}: the camera has moved by {moved_px + apart_px:.1f} px since the first photo; at most "
            f"{MOST_MOVED_PX:g} can be corrected. Take both from a tripod, with a remote release or a timer."
        )
    aligned = second * np.float32(np.median(light[::4, ::4]) / np.median(second[::4, ::4]))
    warnings: list[str] = []
    if moved_px > LEAST_MOVED_PX:
        aligned = moved(aligned, -x_px, -y_px, cv2.INTER_CUBIC, cv2.BORDER_REPLICATE)
        warnings.append(f"the second photo was moved by {moved_px:.1f} px onto the first; a tripod avoids that")
    if not np.all(matched):
        warnings.append(
            f"in {np.sum(~matched)} of {len(matched)} parts, the second photo does not show the scene of the first: "
            "check that both are of one sample"
        )
    return np.minimum(light, aligned), tuple(warnings)


def _shifts(light: Map, second: Map) -> tuple[Floats, np.ndarray]:
    """Return the shift of the second photo in each tile, px (n, 2), and which tiles show the same scene."""
    tiles = [(light[part], second[part]) for part in _parts(light.shape)]
    window = np.asarray(cv2.createHanningWindow(tiles[0][0].shape[::-1], cv2.CV_32F))
    # Roots of light, so that glare does not outweigh grain.
    own = [cv2.phaseCorrelate(np.sqrt(tile), np.sqrt(other), window) for tile, other in tiles]
    shifts_px = np.array([shift_px for shift_px, _ in own])
    matched = np.array([height_of_peak > LEAST_PEAK for _, height_of_peak in own])
    likeliest_px = shifts_px.copy()
    for i in np.flatnonzero(matched):
        likeliest_px[i] = _likeliest(shifts_px[matched], *tiles[i])
    return likeliest_px, matched


def _parts(shape: tuple[int, ...]) -> list[tuple[slice, slice]]:
    """Return rows and columns of each tile."""
    height, width = shape
    most = min(TILE_PX, height // TILES, width // TILES)
    # OpenCV pads a tile to a length that is quick to transform; if that is odd, the shift is half a pixel off.
    side = max(length for length in range(2, most + 1, 2) if cv2.getOptimalDFTSize(length) == length)
    return [
        np.s_[top : top + side, left : left + side]
        for top in np.linspace(0, height - side, TILES).astype(int)
        for left in np.linspace(0, width - side, TILES).astype(int)
    ]


def _likeliest(shifts_px: Floats, tile: Map, other: Map) -> Floats:
    """Return the shift at which the grain of both tiles differs least."""
    grain, others = _grain(tile), _grain(other)
    most = GRAINS * np.median(np.abs(grain))
    back = (moved(others, -x_px, -y_px, cv2.INTER_CUBIC, cv2.BORDER_REPLICATE) for x_px, y_px in shifts_px)
    return shifts_px[int(np.argmin([np.minimum(np.abs(grain - other), most).mean() for other in back]))]


def _grain(tile: Map) -> Map:
    """Return a tile in which the effects of exposure and of slow changes of light are removed."""
    root = cv2.GaussianBlur(np.sqrt(tile / np.mean(tile)), (0, 0), GRAIN_PX)
    return np.asarray(root - cv2.blur(root, (LIGHT_PX, LIGHT_PX)), dtype=np.float32)


def scale_by_ruler(ends_px: tuple[Pixel, Pixel], length_mm: float, size_px: tuple[int, int], file: Path) -> Scale:
    """Return the scale from two points and their distance. Raises InputError for points outside or too close."""
    points_px = np.array(ends_px, dtype=float)
    if np.any(depth_inside(points_px, (-0.5, -0.5, size_px[0] - 0.5, size_px[1] - 0.5)) < 0):
        raise InputError(
            f"{file}: ruler_px has a point outside the photo of {size_px[0]} x {size_px[1]} px; x counts from the "
            "left and y from the top."
        )
    length_px = float(np.linalg.norm(points_px[1] - points_px[0]))
    if length_px < SHORTEST_RULER_PX:
        raise InputError(
            f"{file}: the points of ruler_px are {length_px:.1f} px apart, under {SHORTEST_RULER_PX:g}: give two marks "
            "of the ruler that are farther apart."
        )
    mm_per_px = length_mm / length_px
    return replace(
        given_scale(mm_per_px, False, size_px),
        scale_source=f"ruler of {length_mm:g} mm over {length_px:.0f} px",
        # Both clicks are uncertain along the ruler; across it does not count.
        scale_uncertainty=float(np.hypot(np.sqrt(2) * CLICK_PX / length_px, TILT_COST)),
        warnings=(TILT_WARNING,),
    )


def given_scale(mm_per_px: float, assumed: bool, size_px: tuple[int, int]) -> Scale:
    """Return a scale of unknown uncertainty for a view square to the face, with the origin in the lower left pixel."""
    return Scale(
        view=View(np.array([[mm_per_px, 0, 0], [0, -mm_per_px, mm_per_px * (size_px[1] - 1)], [0, 0, 1.0]])),
        mm_per_px=mm_per_px,
        scale_source=f"given: {mm_per_px:g} mm/px{' (assumed)' if assumed else ''}",
        warnings=("the scale is assumed: every length has the error of the scale",) if assumed else (),
    )


def find_scale(pixels: Pixels, settings: PhotoInput) -> Scale:
    """Find the scale that ``settings`` give. Raises InputError if the photo does not show or contradicts it."""
    face_mm = None if settings.face_mm is None else (0.0, 0.0, *settings.face_mm)
    if settings.markers is not None:
        scale = scale_by_markers(pixels, settings, settings.markers, face_mm)
    elif face_mm is not None:
        scale = scale_by_face(pixels, settings, face_mm)
    elif settings.ruler_px is not None and settings.ruler_mm is not None:
        scale = scale_by_ruler(settings.ruler_px, settings.ruler_mm, pixels.size_px, pixels.file)
    else:
        mm_per_px = present(settings.mm_per_px, "photo.mm_per_px")
        scale = given_scale(mm_per_px, settings.scale_is == "assumed", pixels.size_px)
    if not FINEST_MM_PER_PX <= scale.mm_per_px <= COARSEST_MM_PER_PX:
        raise InputError(
            f"{pixels.file}: according to the scale ({scale.scale_source}), a pixel of the photo is "
            f"{scale.mm_per_px:.2g} mm wide; {FINEST_MM_PER_PX:g} to {COARSEST_MM_PER_PX:g} mm is allowed. Correct "
            "the lengths and pixels that give the scale."
        )
    if scale.scale_uncertainty is None or scale.scale_uncertainty < UNSURE:
        return scale
    warning = f"the scale's standard uncertainty is {scale.scale_uncertainty:.1%}, and so is that of every length"
    return replace(scale, warnings=(*scale.warnings, warning))
