"""Clicks on a search map that is made once: ends, points between them, and regions."""

import numpy as np
import pytest

from digitise.crack_path.find_path import LiveWire, find_path
from sealtwin.core.errors import InputError
from tests.support.photos import distance_to, evenly_scaled, mortar, with_crack, write_png

ENDS = ((30.0, 150.0), (470.0, 150.0))
LOW = [(30.0, 150.0), (120, 150), (250, 215), (380, 150), (470, 150)]
HIGH = [(120.0, 150.0), (250, 45), (380, 150)]
"""A crack that parts and meets again: the lower arm is shorter."""
BRANCH = [(250.0, 215.0), (260, 285)]


@pytest.fixture(scope="module")
def forked(tmp_path_factory):
    picture = with_crack(with_crack(with_crack(mortar(), LOW), HIGH, width_px=10), BRANCH, width_px=8)
    return evenly_scaled(write_png(tmp_path_factory.mktemp("forked") / "photo.png", picture))


@pytest.fixture(scope="module")
def wire(forked):
    return LiveWire(forked)


@pytest.mark.parametrize("via", [(250.0, 45.0), (244.0, 52.0)], ids=["on it", "9 px beside"])
def test_a_point_between_leads_the_way(wire, via):
    path = wire.path(ENDS, (via,))
    assert path.source == "via"
    assert distance_to(path.points_px, np.array([LOW[0], *HIGH, LOW[-1]])).max() < 7
    assert distance_to(np.array([HIGH[1]]), path.points_px)[0] < 9


@pytest.mark.parametrize(
    ("via", "says"),
    [
        (((380.0, 150.0), (120.0, 150.0)), r"via point \(\d+, 150\) the path runs back"),
        (((260.0, 280.0),), r"after the via point \(260, 280\) .* on a branch"),
        (((250.0, 120.0),), r"via point \(250, 120\) is not on a crack"),
        (((250.0, 301.0),), r"via point \(250, 301\) is outside the photo of 500 x 300 px"),
    ],
    ids=["in the wrong order", "on a branch", "beside the crack", "outside the photo"],
)
def test_points_that_the_crack_does_not_pass_in_turn_are_refused(wire, via, says):
    with pytest.raises(InputError, match=says):
        wire.path(ENDS, via)


UPPER = [(30.0, 60.0), (110, 80), (180, 62), (250, 75), (330, 50), (400, 66), (470, 55)]
LOWER = [(x, 290 - y) for x, y in UPPER]


@pytest.fixture
def two(tmp_path):
    return evenly_scaled(write_png(tmp_path / "photo.png", with_crack(with_crack(mortar(), UPPER), LOWER)))


def test_a_region_chooses_between_two_cracks(two):
    """It ends within a width of the crack's tip."""
    path = find_path(two, None, roi_px=((5.0, 175.0), (495.0, 165.0), (495.0, 290.0), (5.0, 290.0)))
    assert distance_to(path.points_px, np.array(LOWER)).max() < 14


def test_ends_outside_the_region_are_refused(two):
    with pytest.raises(InputError, match=r"\(470, 55\) is 115 px outside the searched area"):
        find_path(two, (UPPER[0], UPPER[-1]), roi_px=((0.0, 170.0), (499.0, 290.0)))
