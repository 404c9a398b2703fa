"""A photo's tiles: together they are the photo, and every pixel keeps its place at every size."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image

from digitise.trace_page.session import TILE_PX, Pyramid


def _clouds(width, height):
    """Soft spots of some pixels: a shift by half a pixel changes them by 3 of 255 on average."""
    noise = np.random.default_rng(1).standard_normal((height, width)).astype(np.float32)
    soft = cv2.GaussianBlur(noise, (0, 0), 5.0)
    grey = np.clip(128 + 40 * soft / soft.std(), 0, 255).round().astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def _assembled(pyramid, level):
    rows = []
    for row in range(100):
        tiles = []
        while (tile := pyramid.tile(level, len(tiles), row)) is not None:
            tiles.append(np.array(Image.open(io.BytesIO(tile))))
        if not tiles:
            break
        rows.append(np.hstack(tiles))
    return np.vstack(rows)


def test_the_tiles_of_the_first_level_are_the_photo():
    """JPEG leaves soft spots within 2 of 255 on average; a tile out of place would be off by 40."""
    photo = _clouds(1300, 700)
    photo[..., 2] = 90  # blue, so that swapped channels show
    whole = _assembled(Pyramid(photo), 0)
    assert whole.shape == photo.shape
    assert np.abs(whole.astype(int) - photo).mean(axis=(0, 1)).max() < 2


@pytest.mark.parametrize("size", [(1024, 512), (1301, 703), (2049, 130)])
def test_every_pixel_keeps_its_place_at_every_size(size):
    """Each is the mean of its block of the photo, but for 2.5 of 255 by JPEG and rounding.

    Where an odd side is squeezed into half of it, the far end is off by 4 to 20.
    """
    photo = _clouds(*size)
    pyramid = Pyramid(photo)
    assert pyramid.levels == 1 + int(np.ceil(np.log2(max(size) / TILE_PX)))
    for level in range(1, pyramid.levels):
        block = 2**level
        width, height = (side // block * block for side in size)
        blocks = photo[:height, :width, 0].reshape(height // block, block, width // block, block)
        expected = blocks.astype(float).mean(axis=(1, 3))
        seen = _assembled(pyramid, level)[: height // block, : width // block, 0]
        assert np.abs(seen - expected)[:, -100:].mean() < 3


def test_outside_the_photo_there_is_no_tile():
    pyramid = Pyramid(_clouds(1200, 1200))
    assert pyramid.tile(0, 1, 1) is not None
    for place in ((0, 3, 0), (0, 0, 3), (0, -1, 0), (0, 0, -2), (0, -2, 0), (-1, 0, 0), (3, 0, 0), (99, 0, 0)):
        assert pyramid.tile(*place) is None
