"""A path by three blurs, for a wide crack between stones as dark as it is in places."""

import numpy as np
import pytest

from digitise.crack_path.blurred_path import blurred_path
from digitise.crack_path.darkness import map_darkness
from digitise.photo import Photo
from tests.pictures import distance_to, evenly_scaled, mortar, with_crack, write_png

CRACK = [(-20, 150), (120, 170), (250, 140), (380, 165), (520, 150)]
ENDS = np.array([(20.0, 156.0), (480.0, 153.0)])


@pytest.fixture
def photo(tmp_path) -> Photo:
    return evenly_scaled(write_png(tmp_path / "photo.png", with_crack(mortar(), CRACK, 24)))


def test_it_follows_the_crack_past_all_points(photo):
    field = map_darkness(photo)
    path = blurred_path(photo, field, np.array([ENDS[0], (250.0, 140.0), ENDS[1]]), "via")
    assert path is not None
    assert distance_to(path.points_px, np.array(CRACK, dtype=float)).max() < 8
    assert path.width_px == pytest.approx(24, rel=0.15)
    assert path.source == "via"


@pytest.mark.parametrize(
    ("ends_px", "thin"),
    [([(20.0, 60.0), (480.0, 60.0)], False), ([(20.0, 156.0), (480.0, 40.0)], False), (ENDS.tolist(), True)],
)
def test_bare_ground_and_thin_cracks_have_none(photo, tmp_path, ends_px, thin):
    """A path that leaves the crack for bare ground has none either."""
    if thin:
        photo = evenly_scaled(write_png(tmp_path / "thin.png", with_crack(mortar(), CRACK, 4)))
    assert blurred_path(photo, map_darkness(photo), np.array(ends_px), "ends") is None
