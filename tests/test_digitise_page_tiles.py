"""A photo's tiles: together they are the photo, and every pixel keeps its place at every size."""

import io

import numpy as np
import pytest
from PIL import Image

from digitise.page_tiles import TILE_PX, Pyramid


def _ramp(width, height):
    """Brightness grows evenly to the right: its value tells a pixel's place, at any size."""
    row = np.linspace(20, 230, width)
    return np.repeat(np.tile(row, (height, 1))[..., None], 3, axis=2).round().astype(np.uint8)


def _decoded(jpeg):
    return np.array(Image.open(io.BytesIO(jpeg)))


def _assembled(pyramid, level):
    rows = []
    for row in range(100):
        tiles = []
        while (tile := pyramid.tile(level, len(tiles), row)) is not None:
            tiles.append(_decoded(tile))
        if not tiles:
            break
        rows.append(np.hstack(tiles))
    return np.vstack(rows)


def test_the_tiles_of_the_first_level_are_the_photo():
    """JPEG at quality 92 leaves a smooth ramp within 3 of 255; a tile out of place would be off by 40 and more."""
    photo = _ramp(1300, 700)
    photo[..., 2] = 90  # blue, so that swapped channels show
    whole = _assembled(Pyramid(photo), 0)
    assert whole.shape == photo.shape
    assert np.abs(whole.astype(int) - photo).max() <= 4


@pytest.mark.parametrize("size", [(1024, 512), (1301, 703), (4097, 130)])
def test_every_pixel_keeps_its_place_at_every_size(size):
    """An odd side that were squeezed into half of it would shift the far edge by up to a pixel at each level.

    Compared in pixels of the photo: a ramp of 210 steps tells a place to size / 210, and rounding to a half of that.
    """
    pyramid = Pyramid(_ramp(*size))
    assert pyramid.levels == 1 + int(np.ceil(np.log2(max(size) / TILE_PX)))
    for level in range(1, pyramid.levels):
        seen = _assembled(pyramid, level)[0, :, 0].astype(float)
        centres_px = (np.arange(len(seen)) + 0.5) * 2**level - 0.5
        inside = centres_px + 2 ** (level - 1) < size[0]  # the last one is lengthened by the border's own colour
        expected = 20 + 210 * centres_px / (size[0] - 1)
        assert np.abs(seen - expected)[inside].mean() < 1.2


def test_outside_the_photo_there_is_no_tile():
    pyramid = Pyramid(_ramp(600, 600))
    assert pyramid.tile(0, 1, 1) is not None
    for place in ((0, 2, 0), (0, 0, 2), (0, -1, 0), (0, 0, -1), (-1, 0, 0), (2, 0, 0), (99, 0, 0)):
        assert pyramid.tile(*place) is None
