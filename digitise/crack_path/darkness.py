"""Make the search map: a small copy of a photo that gives each cell's darkness, and its clearness as part of a line."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from digitise.crack_path.medial_axis import pieces
from digitise.crack_path.ridge_filter import strength
from digitise.image.raster import Map, blurred, continued, shrunk, widened
from digitise.image.tone_curve import DISPLAY_GAMMA
from digitise.photo import Photo
from sealtwin.core.records import Floats, Integers

DARK = 0.3  # Share of the usual displayed brightness. A hard shadow leaves 0.4 or more of it, black cloth 0.2 at most
USUAL = 60  # Percentile of brightness taken for the sample's: most of the searched area shows it
ALONG = 0.5  # Least share of a region's extent on the border: a crack that leaves the photo has at most a quarter
LEAST_SHARE = 0.02  # Share of the picture; smaller regions are holes in the sample
WORK_PX = 1000  # Longer side of the copy: a path needs no more, the walls are refined on the photo itself
BACKGROUND_PX = 81  # Size of the background's median on the copy, which removes dark things under half as wide
EVEN_PX = 20.0  # Sigma, on the copy, of the mean by which brightness is divided before lines are searched for
LEAST_LIGHT = 0.05  # Least displayed brightness to divide by, or the noise of a black board would be lines
DARKEST = 99  # Percentile of darkness taken for that of a crack's middle
EDGE_PX = 3  # Pixels of the photo at the edge of the face that mix with its surroundings
MARKER_MARGIN = 1.3  # Size of a marker with its white rim over its black square
RIM_PX = 3  # Cells at the copy's rim that are not searched: lines there have mortar on one side only


def surroundings(around: Map) -> NDArray[np.bool_]:
    """Return large dark regions along the border of ``around``, the displayed brightness without narrow cracks."""
    label, area = pieces(around < DARK * np.percentile(around, USUAL))
    border = np.concatenate([label[0], label[-1], label[1:-1, 0], label[1:-1, -1]])
    along = np.bincount(border, minlength=len(area))
    extent = [max(rows.stop - rows.start, columns.stop - columns.start) for rows, columns in find_objects(label)]
    # A wide crack that leaves the photo touches its border too, but only across.
    beyond = (area >= LEAST_SHARE * around.size) & (along >= ALONG * np.array([1, *extent]))
    # Lens and focus spread the sample's edge over a few cells.
    return widened(beyond[label] & (label > 0), 3)


@dataclass(frozen=True)
class DarkMap:
    """A window of the photo, scaled down."""

    offset_px: tuple[float, float]  # The window's left upper corner in the photo: x, y
    scale: float  # Cells per pixel of the photo
    light: Map  # Brightness, linear in light; continued smoothly outside the searched area
    dark: Map  # 1 - brightness over local background, 0 to 1
    even: Map  # Brightness as displayed, over its local mean
    ridge: Map  # Filter response to a dark line of the best-fitting width, in units of the noise around
    allowed: NDArray[np.bool_]  # Cells on the face and on no marker
    darkest: float  # Darkness exceeded by one cell in a hundred of the whole map: that of a crack, if there is one
    around: NDArray[np.bool_]  # Cells in dark regions at the photo's border that were taken for the surroundings

    def to_work(self, points_px: Floats) -> Floats:
        return (np.asarray(points_px, dtype=float) - self.offset_px + 0.5) * self.scale - 0.5

    def to_photo(self, points_work: Floats | Integers) -> Floats:
        return (np.asarray(points_work, dtype=float) + 0.5) / self.scale - 0.5 + self.offset_px

    def window(self, left: int, top: int, right: int, bottom: int) -> "DarkMap":
        """Return the part of the map from column ``left`` and row ``top`` up to ``right`` and ``bottom``.

        The last two are not included.
        """
        part = np.s_[top:bottom, left:right]
        offset_px = (self.offset_px[0] + left / self.scale, self.offset_px[1] + top / self.scale)
        maps = {name: getattr(self, name)[part] for name in ("light", "dark", "even", "ridge", "allowed", "around")}
        return replace(self, offset_px=offset_px, **maps)


def map_darkness(
    photo: Photo,
    region_px: Floats | None = None,
    found_face_px: Floats | None = None,
    crack_px: Floats | None = None,
) -> DarkMap:
    """Return the search map of the photo, or of a polygon in it.

    ``found_face_px`` is the outline of a face whose size is unknown. The search is then limited to this face. A dark
    region at the border that has a place of ``crack_px``, (n, 2), is crack and not surroundings.
    """
    corners_px = np.array([(0, 0), photo.size_px]) if region_px is None else region_px
    left, top = np.maximum(np.floor(corners_px.min(axis=0)), 0).astype(int).tolist()
    right, bottom = np.minimum(np.ceil(corners_px.max(axis=0)) + 1, photo.size_px).astype(int).tolist()
    light = photo.brightness[top:bottom, left:right]
    allowed = sample_mask(photo, found_face_px)[top:bottom, left:right]
    if region_px is not None:
        allowed = np.minimum(allowed, _filled_polygon(allowed.shape, region_px - (left, top)))
    scale = min(1.0, WORK_PX / max(light.shape))
    size = (max(1, round(light.shape[1] * scale)), max(1, round(light.shape[0] * scale)))
    light = shrunk(light, size)
    allowed = shrunk(allowed.astype(np.float32), size) >= 254
    around = np.zeros_like(allowed)
    if photo.face_px is None and found_face_px is None:
        around = surroundings(_around(_shown(light))) & allowed
        if crack_px is not None:
            around &= ~holding_any(around, (crack_px - (left, top) + 0.5) * scale - 0.5)
    return _mapped((left, top), scale, light, allowed & ~around, around)


def holding_any(mask: NDArray[np.bool_], places: Floats) -> NDArray[np.bool_]:
    """Return the pieces of a mask that hold a place, x and y, (n, 2)."""
    columns, rows = np.clip(np.rint(places).astype(int), 0, np.array(mask.shape[::-1]) - 1).T
    label, _ = pieces(mask)
    return np.isin(label, np.unique(label[rows, columns])) & mask


def coarser(field: DarkMap, times: int) -> DarkMap:
    """Return the map with cells ``times`` as wide. On it, wider cracks differ from their background."""
    height, width = field.dark.shape
    size = (max(1, width // times), max(1, height // times))
    allowed = shrunk(field.allowed.astype(np.float32), size) > 0
    around = shrunk(field.around.astype(np.float32), size) > 0
    return _mapped(field.offset_px, field.scale * size[0] / width, shrunk(field.light, size), allowed, around)


def _mapped(
    offset_px: tuple[float, float], scale: float, light: Map, allowed: NDArray[np.bool_], around: NDArray[np.bool_]
) -> DarkMap:
    # The surroundings must look like the sample, or its edge is the strongest line in the photo.
    if allowed.any() and not allowed.all():
        light = np.where(allowed, light, continued(light, allowed, BACKGROUND_PX / 4))
    shown = _shown(light)
    even = (shown / np.maximum(blurred(shown, EVEN_PX), LEAST_LIGHT)).astype(np.float32)
    ridge = np.where(inner(allowed), strength(even, allowed), 0).astype(np.float32)
    dark = _darkness(light, _around(shown))
    darkest = float(np.percentile(dark[allowed], DARKEST)) if allowed.any() else 0.0
    return DarkMap(offset_px, scale, light, dark, even, ridge, allowed, darkest, around)


def _filled_polygon(shape: tuple[int, ...], corners_px: Floats) -> NDArray[np.uint8]:
    mask = np.zeros(shape, dtype=np.uint8)
    cv2.fillPoly(mask, [np.rint(corners_px * 16).astype(np.int32)], [255], shift=4)
    return mask


def sample_mask(photo: Photo, found_face_px: Floats | None = None) -> NDArray[np.uint8]:
    """Return a mask, (height, width): 255 on the sample's face except markers, else 0."""
    width, height = photo.size_px
    face_px = photo.face_ring_px if photo.face_ring_px is not None else found_face_px
    mask = np.full((height, width), 255, dtype=np.uint8)
    if face_px is not None:
        mask = _filled_polygon((height, width), face_px)
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * EDGE_PX + 1, 2 * EDGE_PX + 1))
        mask = np.asarray(cv2.erode(mask, disc), dtype=np.uint8)
    blank_markers(mask, photo)
    return mask


def blank_markers(mask: NDArray[np.uint8], photo: Photo, offset_px: tuple[int, int] = (0, 0)) -> None:
    """Set a mask to 0 on markers and their white rims; its first pixel is at ``offset_px`` in the photo."""
    for quad in photo.markers_px:
        middle = quad.mean(axis=0)
        corners = middle + MARKER_MARGIN * (quad - middle) - offset_px
        cv2.fillPoly(mask, [np.rint(corners * 16).astype(np.int32)], [0], shift=4)


def inner(allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the allowed cells that are not on the border of the map."""
    cells = allowed.copy()
    cells[:RIM_PX] = cells[-RIM_PX:] = False
    cells[:, :RIM_PX] = cells[:, -RIM_PX:] = False
    return cells


def _shown(light: Map) -> Map:
    """Return brightness as displayed, 0 to 1. Grain then has equal contrast in shade and light."""
    return np.asarray(np.power(np.clip(light, 0, 1), 1 / DISPLAY_GAMMA), dtype=np.float32)


def _around(shown: Map) -> Map:
    """Return displayed brightness with narrow features removed. A median keeps the edges of shadows in place."""
    size = min(BACKGROUND_PX, 2 * (min(shown.shape) // 4) + 1)
    # OpenCV has large medians of whole numbers only.
    around = cv2.medianBlur(np.rint(255 * shown).astype(np.uint8), size)
    return np.asarray(around, dtype=np.float32) / np.float32(255)


def _darkness(light: Map, around: Map) -> Map:
    """Return darkness relative to the light around: 0 on plain mortar in any light, near 1 in a deep crack."""
    background = blurred(np.power(around, np.float32(DISPLAY_GAMMA)), BACKGROUND_PX / 16)
    return np.clip(1 - blurred(light, 0.8) / np.maximum(background, 1e-4), 0, 1).astype(np.float32)
