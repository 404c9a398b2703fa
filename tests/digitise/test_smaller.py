"""A smaller copy of a photo shows each place where the photo does."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.photo import smaller
from digitise.scale.view import Lens, View
from tests.support.photos import evenly_scaled, mortar, with_crack, write_png

WIDTH_PX = 40


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    line = [(60, 430), (360, 330), (600, 350), (940, 210)]
    picture = with_crack(mortar((1001, 603)), line, width_px=WIDTH_PX)
    return evenly_scaled(write_png(tmp_path_factory.mktemp("photo") / "crack.png", picture))


def test_the_copy_shows_every_place_where_the_photo_does(photo):
    """Through tilt and lens, to a ten-thousandth of a pixel: the same mapping, in other pixels."""
    tilted = np.array([[0.1, 0.001, 3.0], [0.002, -0.11, 60.0], [1e-5, 2e-5, 1.0]])
    seen = replace(
        photo, view=View(tilted, Lens(np.array([500.0, 301.0]), -1.2e-7)), markers_px=(np.array([[10.5, 20.0]]),)
    )
    factor = 4
    copy = smaller(seen, factor)
    places_px = np.array([[0.0, 0.0], [123.4, 456.7], [1000.0, 602.0]])
    in_copy_px = (places_px + 0.5) / factor - 0.5
    assert np.allclose(copy.to_mm(in_copy_px), seen.to_mm(places_px), atol=1e-5)
    assert np.allclose(copy.to_px(seen.to_mm(places_px)), in_copy_px, atol=1e-4)
    assert np.allclose(copy.markers_px[0], (seen.markers_px[0] + 0.5) / factor - 0.5)
    assert copy.mm_per_px == factor * seen.mm_per_px
    assert copy.brightness.shape == (603 // factor, 1001 // factor)


def test_a_pixel_of_the_copy_is_the_mean_of_its_block(photo):
    copy = smaller(photo, 4)
    block = photo.brightness[100:104, 896:900]
    assert copy.brightness[25, 224] == pytest.approx(block.mean(), rel=1e-5)
