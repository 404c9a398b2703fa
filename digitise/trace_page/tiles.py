"""A photo in square tiles at halving sizes, so that a browser fetches only what it shows."""

from contextlib import suppress
from dataclasses import replace
from threading import Lock

import cv2
import numpy as np

from digitise.crack_path.hints import CrackPath
from digitise.image import raster
from digitise.outline import MIN_WIDTH_PX, trace_outline
from digitise.photo import Photo
from digitise.scale.view import Lens, View
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline, Pixels

GLANCE_WIDTH_PX = 2 * MIN_WIDTH_PX  # Of the crack in the smaller copy: its walls are within 0.1 mm of the final ones
TILE_PX = 512
JPEG_QUALITY = 92  # Blocks of a lower quality look like grain when enlarged


def glance(photo: Photo, path: CrackPath, edge_fraction: float = 0.5) -> Outline | None:
    """Trace the outline in a smaller copy of the photo, in whose pixels it is; None where its walls are not found."""
    if path.width_px < 2 * GLANCE_WIDTH_PX or photo.drawn is not None:
        return None
    factor = 2 ** int(np.log2(path.width_px / GLANCE_WIDTH_PX))
    narrow = replace(path, points_px=_placed(path.points_px, factor), width_px=path.width_px / factor)
    with suppress(InputError):
        return trace_outline(shrunk(photo, factor), narrow, edge_fraction)
    return None


def shrunk(photo: Photo, factor: int) -> Photo:
    """Return the photo with brightness and view in pixels ``factor`` times as large; its colours keep theirs."""
    offset = (factor - 1) / 2
    to_photo_px = np.array([[factor, 0, offset], [0, factor, offset], [0, 0, 1.0]])
    lens = photo.view.lens
    width, height = (side // factor for side in photo.size_px)
    whole = photo.brightness[: height * factor, : width * factor]
    return replace(
        photo,
        brightness=raster.shrunk(whole, (width, height)),
        view=View(
            mm_from_px=photo.view.mm_from_px @ to_photo_px,
            lens=lens and Lens(_placed(lens.centre_px, factor), lens.bend_px2 * factor**2),
        ),
        mm_per_px=photo.mm_per_px * factor,
        markers_px=tuple(_placed(corners, factor) for corners in photo.markers_px),
    )


def _placed(points_px: Floats, factor: int) -> Floats:
    """Map pixels of the photo to pixels of the copy; the origin of each is the centre of its first pixel."""
    return (points_px - (factor - 1) / 2) / factor


class Pyramid:
    """A photo at halving sizes: level 0 is the photo, the last level fits into one tile."""

    def __init__(self, image: Pixels) -> None:
        self._levels = [image]
        self._growing = Lock()
        self.levels = 1 + max(0, int(np.ceil(np.log2(max(image.shape[:2]) / TILE_PX))))

    def tile(self, level: int, column: int, row: int) -> bytes | None:
        """Return a tile as JPEG; None outside the photo. At the photo's right and lower edge a tile may be smaller."""
        if not 0 <= level < self.levels or column < 0 or row < 0:
            return None
        with self._growing:
            while len(self._levels) <= level:
                self._levels.append(_halved(self._levels[-1]))
        picture = self._levels[level]
        part = picture[row * TILE_PX : (row + 1) * TILE_PX, column * TILE_PX : (column + 1) * TILE_PX]
        if part.size == 0:
            return None
        bgr = cv2.cvtColor(part, cv2.COLOR_RGB2BGR)
        return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()


def _halved(picture: Pixels) -> Pixels:
    """Halve the size. An odd side is lengthened first, so that every pixel keeps its place."""
    height, width = picture.shape[:2]
    even = cv2.copyMakeBorder(picture, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    size = ((width + 1) // 2, (height + 1) // 2)
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
