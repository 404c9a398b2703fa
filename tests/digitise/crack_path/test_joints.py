"""A path along a joint is doubted or goes along the crack instead, and one that goes straight ahead is kept."""

import numpy as np
import pytest

from digitise.crack_path.path_search import LiveWire
from digitise.photo import Photo
from tests.pictures import distance_to, evenly_scaled, mortar, with_crack, write_png


@pytest.fixture
def tiled(tmp_path) -> Photo:
    """Joints right across, and a faint crack from one to the other."""
    picture = with_crack(mortar(), [(60, -10), (60, 310)], 4)
    return evenly_scaled(write_png(tmp_path / "photo.png", with_crack(picture, [(-10, 200), (510, 200)], 4)))


def test_a_way_round_by_two_joints_is_doubted_with_its_place(tiled):
    path = LiveWire(tiled).path(((60.0, 40.0), (430.0, 200.0)))
    (doubt,) = (warning for warning in path.warnings if "as straight as a joint" in warning)
    assert "(430, 200)" in doubt


def test_a_crack_with_corners_but_no_line_beyond_them_is_not(tmp_path):
    rng = np.random.default_rng(1)
    x = np.arange(40, 460, 20.0)
    crack = [(float(a), float(b)) for a, b in zip(x, 150 + rng.normal(0, 12, len(x)), strict=True)]
    photo = evenly_scaled(write_png(tmp_path / "photo.png", with_crack(mortar(), crack, 8)))
    assert LiveWire(photo).path((crack[0], crack[-1])).warnings == ()


def test_between_clicks_on_a_crack_the_darker_joints_around_it_are_avoided(tmp_path):
    """Points on the joint bring the path back to it: what is pointed at is a crack."""
    crack = [(70, 60), (120, 74), (170, 70), (220, 104), (260, 110), (300, 142), (350, 150), (390, 190)]
    picture = mortar()
    picture *= (1 + with_crack(mortar(), crack, 4) / mortar()) / 2
    for joint in ([(60, -10), (60, 310)], [(-10, 200), (510, 200)]):
        picture = with_crack(picture, joint, 5)
    wire = LiveWire(evenly_scaled(write_png(tmp_path / "photo.png", picture)))
    path = wire.path(((64.0, 60.0), (392.0, 194.0)))
    assert distance_to(path.points_px, np.array(crack, dtype=float)).max() < 8
    (notice,) = path.warnings
    assert "avoids" in notice
    back = wire.path(((64.0, 60.0), (392.0, 194.0)), ((60.0, 150.0), (150.0, 200.0), (300.0, 200.0)))
    assert distance_to(back.points_px, np.array([(60.0, 50.0), (60.0, 200.0), (400.0, 200.0)])).max() < 8
