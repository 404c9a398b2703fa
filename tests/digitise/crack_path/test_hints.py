"""Ends, points between them and regions from a user's hand: taken as meant, or refused by name."""

import numpy as np
import pytest

from digitise.crack_path.hints import region_px
from sealtwin.core.errors import InputError
from tests.pictures import evenly_scaled, mortar, write_png


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    """500 x 300 px."""
    return evenly_scaled(write_png(tmp_path_factory.mktemp("photo") / "photo.png", mortar()))


@pytest.mark.parametrize("corners", [((10.0, 20.0), (400.0, 200.0)), ((400.0, 20.0), (10.0, 200.0))])
def test_two_opposite_corners_are_a_box(photo, corners):
    assert region_px(photo, corners) == pytest.approx(
        np.array([[10.0, 20.0], [400.0, 20.0], [400.0, 200.0], [10.0, 200.0]])
    )


def test_a_region_may_reach_beyond_the_photo_and_end_where_it_began(photo):
    """As a drawing program writes a ring."""
    ring = ((-900.0, -900.0), (1e6, -900.0), (1e6, 1e6), (-900.0, 1e6), (-900.0, -900.0))
    assert len(region_px(photo, ring)) == 5


@pytest.mark.parametrize(
    ("corners", "side"),
    [
        (((0.0, 0.0), (499.0, 299.0), (499.0, 0.0), (0.0, 299.0)), "(0, 0) to (499, 299)"),
        (((0.0, 0.0), (400.0, 0.0), (400.0, 290.0), (200.0, -50.0), (0.0, 290.0)), "(0, 0) to (400, 0)"),
        (((0.0, 0.0), (200.0, 200.0), (300.0, 0.0), (400.0, 150.0)), "(400, 150) to (0, 0)"),
    ],
    ids=["a bow tie", "a corner beyond the first side", "the side that closes it"],
)
def test_a_region_that_crosses_itself_is_refused(photo, corners, side):
    """Which of its parts are meant, nobody can tell."""
    with pytest.raises(InputError, match=r"photo\.png: roi_px crosses itself") as fault:
        region_px(photo, corners)
    assert side in str(fault.value)


@pytest.mark.parametrize(
    "corners",
    [
        ((600.0, 600.0), (900.0, 900.0)),
        ((-1e6, -1e6), (0.0, 0.0)),
        ((10.0, 10.0), (20.0, 290.0)),
        ((0.0, 0.0),) * 3,
    ],
)
def test_a_region_without_photo_is_refused(photo, corners):
    with pytest.raises(InputError, match="roi_px holds"):
        region_px(photo, corners)
