"""A path along a joint is doubted, and one that goes straight ahead is not."""

import numpy as np
import pytest

from digitise.crack_path.path_search import LiveWire
from digitise.photo import Photo
from tests.pictures import evenly_scaled, mortar, with_crack, write_png

CORNER = [(60, 30), (60, 200), (440, 200)]


@pytest.fixture
def tiled(tmp_path) -> Photo:
    """Joints right across, and a faint crack from one to the other."""
    picture = with_crack(mortar(), [(60, -10), (60, 310)], 4)
    return evenly_scaled(write_png(tmp_path / "photo.png", with_crack(picture, [(-10, 200), (510, 200)], 4)))


def test_a_way_round_by_two_joints_is_doubted_with_its_place(tiled):
    path = LiveWire(tiled).path(((60.0, 40.0), (430.0, 200.0)))
    (doubt,) = (warning for warning in path.warnings if "as straight as a joint" in warning)
    assert "(430, 200)" in doubt


def test_a_straight_line_between_its_ends_is_not(tiled):
    assert LiveWire(tiled).path(((100.0, 200.0), (430.0, 200.0))).warnings == ()


def test_a_crack_with_corners_but_no_line_beyond_them_is_not(tmp_path):
    rng = np.random.default_rng(1)
    x = np.arange(40, 460, 20.0)
    crack = [(float(a), float(b)) for a, b in zip(x, 150 + rng.normal(0, 12, len(x)), strict=True)]
    photo = evenly_scaled(write_png(tmp_path / "photo.png", with_crack(mortar(), crack, 8)))
    assert LiveWire(photo).path((crack[0], crack[-1])).warnings == ()
