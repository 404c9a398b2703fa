"""A photo with a scale. Only this module converts pixels to millimetres."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from digitise.geometry.polyline import depth_inside, rectangle
from digitise.image.decoding import BLACK, BRIGHT_PART, Decoded, Pixels, read_mask, read_photo
from digitise.image.raster import DISPLAY_GAMMA, Mask, Size, filled_polygon, shrunk
from digitise.scale.face_scale import scale_by_face
from digitise.scale.marker_scale import scale_by_markers, seen_markers
from digitise.scale.view import Lens, Scale, View
from digitise.settings import COARSEST_MM_PER_PX, FINEST_MM_PER_PX, PhotoInput, PixelPair
from sealtwin.core.errors import InputError, present
from sealtwin.core.facts import doubt
from sealtwin.core.records import Booleans, Floats

RING_POINTS = 32  # Points on each side of the face. Between two, a lens with k1 = -0.2 bends the side by 0.01 px
CLICK_PX = 1.0  # Standard deviation of each coordinate of a click
SHORTEST_RULER_PX = 50.0  # Shortest ruler: two clicks on it make every length uncertain by 3 %
TILT_COST = 0.0035  # Relative standard uncertainty from tilt: 3 degrees by hand, 0.12 % each, on synthetic photos
TILT_WARNING = (
    "a ruler does not show tilt: lengths are wrong by up to 3.5 % if the camera is 5 degrees off square, and by up "
    "to 7 % at 10 degrees. Give markers or the face's corners to measure the tilt"
)
EDGE_PX = 3  # Number of pixels along the edge of the face that mix with the surroundings
MARKER_MARGIN = 1.3  # Size of a marker with its white rim, divided by the size of its black square
# A larger relative standard uncertainty of the scale gives a warning. Widths are reported with twice this uncertainty
SCALE_ERROR = 0.01


@dataclass(frozen=True, kw_only=True)
class Photo(Pixels, Scale):
    """Pixels of a photo with their scale."""

    def to_mm(self, points_px: Floats) -> Floats:
        """Map pixels, (..., 2), to points on the face in mm, (..., 2)."""
        return self.view.to_mm(points_px.reshape(-1, 2)).reshape(points_px.shape)

    def to_px(self, points_mm: Floats) -> Floats:
        """Map points on the face in mm, (..., 2), to pixels, (..., 2)."""
        return self.view.to_px(points_mm.reshape(-1, 2)).reshape(points_mm.shape)

    def in_both_units(self, **lines_mm: Floats) -> dict[str, Any]:
        """Return a dict of lines on the face. A line has two keys: ``<name>_mm``, and ``<name>_px`` in pixels."""
        in_px = {f"{name}_px": self.to_px(line_mm) for name, line_mm in lines_mm.items()}
        return {f"{name}_mm": line_mm for name, line_mm in lines_mm.items()} | in_px

    def length(self, length_px: float) -> str:
        """Return a length as text, such as "9.4 mm (94 px)", or "94 px" if the photo has no scale."""
        in_px = f"{length_px:.0f} px"
        return in_px if self.unit == "px" else f"{length_px * self.mm_per_px:.2g} mm ({in_px})"

    @property
    def facts_of_outline(self) -> dict[str, Any]:
        """Return the fields of an ``Outline`` that come from the photo."""
        names = ("face_mm", "mm_per_px", "scale_source", "scale_residual_mm", "scale_uncertainty", "camera_tilt_deg")
        return {name: getattr(self, name) for name in names} | {"photo_size_px": self.size_px}

    @cached_property
    def face_ring_px(self) -> Floats | None:
        """Edge of the face as a ring of points from the lower left corner, in px, (n, 2). A lens bends the edge."""
        if self.face_mm is None:
            return None
        start = rectangle(self.face_mm)[:, None]
        share = np.arange(RING_POINTS)[:, None] / RING_POINTS
        return self.to_px((start + share * (np.roll(start, -1, axis=0) - start)).reshape(-1, 2))

    def sample_mask(self) -> Mask:
        """Return a mask, (height, width), with 255 on the sample's face except on markers, and 0 elsewhere."""
        mask = np.full(self.brightness.shape, 255, np.uint8)
        if self.face_ring_px is not None:
            mask = filled_polygon(self.brightness.shape, self.face_ring_px)
            disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * EDGE_PX + 1, 2 * EDGE_PX + 1))
            mask = np.asarray(cv2.erode(mask, disc), np.uint8)
        self.blank_markers(mask)
        return mask

    def blank_markers(self, mask: Mask, offset_px: tuple[int, int] = (0, 0)) -> None:
        """Set a mask to 0 on markers and their white rims. The mask's first pixel is at ``offset_px`` in the photo."""
        for quad in self.markers_px:
            middle = quad.mean(axis=0)
            corners = middle + MARKER_MARGIN * (quad - middle) - offset_px
            cv2.fillPoly(mask, [np.rint(corners * 16).astype(np.int32)], [0], shift=4)


def load_photo(settings: PhotoInput, folder: Path) -> Photo:
    """Read the photo and find its scale. The photo is in ``folder`` unless its path is absolute.

    Raises InputError if the photo cannot be read, or if its scale cannot be found.
    """
    return scaled(read_pixels(settings, folder), settings)


def offer_of_markers(photo: Path) -> str:
    """Return a sentence about the markers in a photo without a scale. The sentence begins with a space.

    Returns an empty text if the photo shows no markers or cannot be read.
    """
    with suppress(InputError):
        dictionary, corners_px = seen_markers(pixels_of(read_photo(photo), photo))
        if corners_px:
            return (
                f" The photo shows {len(corners_px)} markers of {dictionary}: 'sealtwin markers --face-mm WxH "
                f"--dictionary {dictionary} --out frame.pdf --toml markers.toml' writes their table."
            )
    return ""


def read_pixels(settings: PhotoInput, folder: Path) -> Pixels:
    """Read the pixels for ``load_photo``. This takes longer than finding their scale."""
    path = folder / settings.file
    decoded = read_photo(path)
    drawn = None if settings.mask is None else read_mask(folder / settings.mask, decoded.image.shape[1::-1])
    return pixels_of(decoded, path, drawn)


def pixels_of(decoded: Decoded, file: Path, drawn: Booleans | None = None) -> Pixels:
    """Add the linear luminance of each pixel and the mask of the crack, ``drawn``, (height, width).

    Raises InputError if the picture is black.
    """
    to_light = ((np.arange(256) / 255) ** DISPLAY_GAMMA).astype(np.float32)
    light = np.zeros(decoded.image.shape[:2], np.float32)
    for channel, weight in enumerate((0.2126, 0.7152, 0.0722)):
        light += cv2.LUT(cv2.extractChannel(decoded.image, channel), weight * to_light)
    if np.percentile(light[::2, ::2], BRIGHT_PART) < to_light[BLACK]:
        raise InputError(f"{file}: the photo is black. Take it with more light or a longer exposure.")
    return Pixels(**vars(decoded), file=file, brightness=light, drawn=drawn)


def scaled(pixels: Pixels, settings: PhotoInput) -> Photo:
    """Return the pixels with the scale that ``settings`` define. Raises InputError if the photo does not show it."""
    scale = find_scale(pixels, settings)
    return Photo(**{**vars(pixels), **vars(scale), "warnings": (*pixels.warnings, *scale.warnings)})


def scale_by_ruler(ends_px: PixelPair, length_mm: float, size_px: Size, file: Path) -> Scale:
    """Return the scale from two points and their distance.

    Raises InputError if a point is outside the photo or if the points are too close together.
    """
    points_px = np.array(ends_px, float)
    length_px = float(np.linalg.norm(points_px[1] - points_px[0]))
    inside = np.all(depth_inside(points_px, (-0.5, -0.5, size_px[0] - 0.5, size_px[1] - 0.5)) >= 0)
    if not inside or length_px < SHORTEST_RULER_PX:
        raise InputError(
            f"{file}: the two points of ruler_px are {length_px:.1f} px apart. Give two marks of the ruler that are "
            f"at least {SHORTEST_RULER_PX:g} px apart and both in the photo of {size_px[0]} x {size_px[1]} px. x "
            "counts from the left and y from the top."
        )
    mm_per_px = length_mm / length_px
    return replace(
        given_scale(mm_per_px, False, size_px),
        scale_source=f"ruler of {length_mm:g} mm over {length_px:.0f} px",
        # Both clicks are uncertain along the ruler. Errors across the ruler have no effect.
        scale_uncertainty=float(np.hypot(np.sqrt(2) * CLICK_PX / length_px, TILT_COST)),
        warnings=(doubt("scale.tilt-unknown", TILT_WARNING),),
    )


def given_scale(mm_per_px: float, assumed: bool, size_px: Size) -> Scale:
    """Return a scale of unknown uncertainty for a view square to the face. The origin is the lower left pixel."""
    return Scale(
        view=View(np.array([[mm_per_px, 0, 0], [0, -mm_per_px, mm_per_px * (size_px[1] - 1)], [0, 0, 1.0]])),
        mm_per_px=mm_per_px,
        scale_source=f"given: {mm_per_px:g} mm/px{' (assumed)' if assumed else ''}",
        warnings=(doubt("scale.assumed", "the scale is assumed, so every length has the error of the scale"),)
        if assumed
        else (),
    )


def find_scale(pixels: Pixels, settings: PhotoInput) -> Scale:
    """Find the scale that ``settings`` define. Raises InputError if the photo contradicts or does not show it."""
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
            f"{scale.mm_per_px:.2g} mm wide, but only {FINEST_MM_PER_PX:g} to {COARSEST_MM_PER_PX:g} mm is allowed. "
            "Correct the lengths and pixels that define the scale."
        )
    if (scale.scale_uncertainty or 0.0) < SCALE_ERROR:
        return scale
    text = f"the scale has a standard uncertainty of {scale.scale_uncertainty:.1%}, and so has every length"
    return replace(scale, warnings=(*scale.warnings, doubt("scale.unsure", text, scale.scale_uncertainty)))


def smaller(photo: Photo, factor: int) -> Photo:
    """Return the photo with brightness and view in pixels ``factor`` times as wide. ``image`` does not change."""
    offset = (factor - 1) / 2
    to_photo_px = np.array([[factor, 0, offset], [0, factor, offset], [0, 0, 1.0]])
    lens = photo.view.lens
    width, height = (side // factor for side in photo.size_px)
    whole = photo.brightness[: height * factor, : width * factor]
    return replace(
        photo,
        brightness=shrunk(whole, (width, height)),
        view=View(
            mm_from_px=photo.view.mm_from_px @ to_photo_px,
            lens=lens and Lens(in_copy(lens.centre_px, factor), lens.bend_px2 * factor**2),
        ),
        mm_per_px=photo.mm_per_px * factor,
        markers_px=tuple(in_copy(corners, factor) for corners in photo.markers_px),
    )


def in_copy(points_px: Floats, factor: int) -> Floats:
    """Map pixels of the photo to pixels of a copy that is ``factor`` times smaller. Pixel centres are whole numbers."""
    return (points_px - (factor - 1) / 2) / factor
