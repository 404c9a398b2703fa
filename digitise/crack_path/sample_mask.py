"""The part of a photo that shows the sample: on its face, on no marker, and off dark surroundings."""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from digitise.crack_path.medial_axis import pieces
from digitise.image.raster import Map, widened
from digitise.photo import Photo
from sealtwin.core.records import Floats

EDGE_PX = 3  # Pixels of the photo at the edge of the face that mix with its surroundings
MARKER_MARGIN = 1.3  # Size of a marker with its white rim over its black square
NARROW = 81  # Cells of the median that removes narrow cracks before surroundings are searched for
DARK = 0.3  # Share of the usual displayed brightness. A hard shadow leaves 0.4 or more of it, black cloth 0.2 at most
USUAL = 60  # Percentile of brightness taken for the sample's: most of the searched area shows it
ALONG = 0.5  # Least share of a region's extent on the border: a crack that leaves the photo has at most a quarter
LEAST_SHARE = 0.02  # Share of the picture; smaller regions are holes in the sample


def sample_mask(photo: Photo, found_face_px: Floats | None = None) -> NDArray[np.uint8]:
    """Return a mask, (height, width): 255 on the sample's face except markers, else 0."""
    width, height = photo.size_px
    face_px = photo.face_ring_px if photo.face_ring_px is not None else found_face_px
    mask = np.full((height, width), 255, dtype=np.uint8)
    if face_px is not None:
        mask = filled_polygon((height, width), face_px)
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


def filled_polygon(shape: tuple[int, ...], corners_px: Floats) -> NDArray[np.uint8]:
    """Return a mask with 255 inside a polygon, else 0."""
    mask = np.zeros(shape, dtype=np.uint8)
    cv2.fillPoly(mask, [np.rint(corners_px * 16).astype(np.int32)], [255], shift=4)
    return mask


def surroundings(shown: Map, crack: Floats | None = None) -> NDArray[np.bool_]:
    """Return large dark regions along the border of the displayed brightness.

    A region with a place of ``crack``, (n, 2) as column and row, is not among them.
    """
    # OpenCV has large medians of whole numbers only.
    size = min(NARROW, 2 * (min(shown.shape) // 4) + 1)
    without_cracks = cv2.medianBlur(np.rint(255 * shown).astype(np.uint8), size)
    label, area = pieces(without_cracks < DARK * np.percentile(without_cracks, USUAL))
    border = np.concatenate([label[0], label[-1], label[1:-1, 0], label[1:-1, -1]])
    along = np.bincount(border, minlength=len(area))
    extent = [max(rows.stop - rows.start, columns.stop - columns.start) for rows, columns in find_objects(label)]
    # A wide crack that leaves the photo touches its border too, but only across.
    beyond = (area >= LEAST_SHARE * shown.size) & (along >= ALONG * np.array([1, *extent]))
    beyond[0] = False
    if crack is not None:
        column, row = np.clip(np.rint(crack).astype(int), 0, np.array(shown.shape[::-1]) - 1).T
        beyond[label[row, column]] = False
    # Lens and focus spread the sample's edge over a few cells.
    return widened(beyond[label], 3)
