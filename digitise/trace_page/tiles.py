"""A photo in square tiles at halving sizes, so that a browser fetches only what it shows."""

from threading import Lock

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]

TILE_PX = 512
JPEG_QUALITY = 92
"""Enlarged, the blocks of a lower one look like grain at the wall."""


class Pyramid:
    """Level 0 is the photo; every further level has half the size, down to one tile."""

    def __init__(self, image: Picture) -> None:
        """``image``: (height, width, 3), RGB."""
        self._levels = [image]
        self._growing = Lock()
        self.levels = 1 + max(0, int(np.ceil(np.log2(max(image.shape[:2]) / TILE_PX))))

    def tile(self, level: int, column: int, row: int) -> bytes | None:
        """As JPEG; None outside the photo. At the photo's right and lower edge a tile may be smaller."""
        if not 0 <= level < self.levels or column < 0 or row < 0:
            return None
        picture = self._level(level)
        part = picture[row * TILE_PX : (row + 1) * TILE_PX, column * TILE_PX : (column + 1) * TILE_PX]
        if part.size == 0:
            return None
        encoded, jpeg = cv2.imencode(
            ".jpg", cv2.cvtColor(part, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
        )
        if not encoded:
            raise RuntimeError("OpenCV could not encode a tile")
        return jpeg.tobytes()

    def _level(self, level: int) -> Picture:
        with self._growing:
            while len(self._levels) <= level:
                self._levels.append(_halved(self._levels[-1]))
        return self._levels[level]


def _halved(picture: Picture) -> Picture:
    """Half the size. An odd side is lengthened first, so that every pixel keeps its place."""
    height, width = picture.shape[:2]
    even = cv2.copyMakeBorder(picture, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    size = ((width + 1) // 2, (height + 1) // 2)
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
