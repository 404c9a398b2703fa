"""Lines found without clicks: cracks are ranked before joints and edges."""

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import CrackSearch, LiveWire
from sealtwin.core.errors import InputError
from tests.support.photos import distance_to, mortar, photo_of_light, with_crack

EDGE = [(30, 220), (130, 236), (240, 214), (350, 232), (470, 218)]
CRACK = [(x, round(70 + 9 * np.sin(x / 27) + 5 * np.sin(x / 9))) for x in range(40, 461, 4)]


def search_of(folder, picture):
    return CrackSearch.of(photo_of_light(folder, picture))


def with_patch(picture):
    """The picture with a lighter patch below a dark edge."""
    below = np.zeros(picture.shape, dtype=np.uint8)
    cv2.fillPoly(below, [np.array([(0, 222), *EDGE, (500, 218), (500, 300), (0, 300)], dtype=np.int32)], [1])
    return with_crack(picture * np.where(below, 1.9, 1.0), EDGE, 14)


def with_joint(picture):
    return with_crack(picture, [(40, 225), (170, 232)], 12)


def test_the_outline_of_a_line_is_finite_where_a_line_is_extended_by_less_than_a_cell(tmp_path):
    line = [(10, 101), (80, 75), (150, 110), (220, 80), (300, 115), (390, 90)]
    (crack,) = search_of(tmp_path, with_crack(mortar((400, 200)), line, 20)).cracks
    assert np.isfinite(crack.outline_px).all()


@pytest.mark.parametrize("other", [with_patch, with_joint])
def test_a_crack_is_ranked_before_an_edge_or_a_joint(tmp_path, other):
    search = search_of(tmp_path, other(with_crack(mortar(), CRACK, 5)))
    assert distance_to(search.cracks[0].line_px, np.array(CRACK, dtype=float)).max() < 12


def test_a_path_between_clicks_follows_a_black_wedge_at_the_photos_border(tmp_path):
    picture = mortar()
    cv2.fillPoly(picture, [np.array([(0, 110), (0, 190), (120, 170), (460, 150), (460, 140), (120, 130)])], [0.01])
    wire = LiveWire(photo_of_light(tmp_path, picture))
    path = wire.path(((12.0, 150.0), (440.0, 146.0)))
    assert distance_to(path.points_px, np.array([(0.0, 150.0), (460.0, 146.0)])).max() < 20
    with pytest.raises(InputError):
        wire.path(((300.0, 30.0), (440.0, 146.0)))


def test_a_straight_crack_that_ends_inside_the_photo_is_not_left_out_as_a_joint(tmp_path):
    """Only the bent beginning of such a crack was offered."""
    ends = (60, 215), (440, 150)
    search = search_of(tmp_path, with_crack(mortar(), [ends[0], (150, 165), ends[1]], 6))
    assert search.cracks[0].line_px[[0, -1]] == pytest.approx(np.array(ends), abs=8)
