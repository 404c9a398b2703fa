"""Lines found without clicks: cracks are ranked before joints and edges, and a doubtful line is left to the user."""

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import CrackSearch, LiveWire, RivalCracksError
from sealtwin.core.errors import InputError
from tests.support.photos import distance_to, mortar, photo_of_light, with_crack

EDGE = [(30, 220), (130, 236), (240, 214), (350, 232), (470, 218)]
CRACK = [(x, round(70 + 9 * np.sin(x / 27) + 5 * np.sin(x / 9))) for x in range(40, 461, 4)]
STEPS = [(40, 80), (140, 80), (140, 140), (250, 140), (250, 200), (360, 200), (360, 250), (460, 250)]
SHORT_STEPS = [(40 + 23 * ((n + 1) // 2), 40 + 23 * (n // 2)) for n in range(19)]
"""Each leg is shorter than a straight leg that counts by itself."""


def search_of(folder, picture):
    return CrackSearch.of(photo_of_light(folder, picture))


def with_patch(picture):
    """The picture with a lighter patch below a dark edge."""
    below = np.zeros(picture.shape, dtype=np.uint8)
    cv2.fillPoly(below, [np.array([(0, 222), *EDGE, (500, 218), (500, 300), (0, 300)], dtype=np.int32)], [1])
    return with_crack(picture * np.where(below, 1.9, 1.0), EDGE, 14)


def with_joint(picture):
    return with_crack(picture, [(40, 225), (170, 232)], 12)


@pytest.mark.parametrize(
    ("picture", "doubt"),
    [
        (with_patch(mortar()), "two sides"),
        (with_joint(mortar()), "straight legs"),
        (with_crack(mortar(), STEPS, 6), "straight legs"),
        (with_crack(mortar(), SHORT_STEPS, 4), "straight legs"),
    ],
    ids=["an edge", "a joint", "a stepped joint", "short steps"],
)
def test_an_edge_or_a_joint_is_followed_only_if_the_user_chooses_it(tmp_path, picture, doubt):
    search = search_of(tmp_path, picture)
    with pytest.raises(RivalCracksError, match=doubt):
        search.path()
    assert search.path(1).source == "choice"


@pytest.mark.parametrize("other", [with_patch, with_joint])
def test_a_crack_is_ranked_before_an_edge_or_a_joint(tmp_path, other):
    search = search_of(tmp_path, other(with_crack(mortar(), CRACK, 5)))
    assert distance_to(search.cracks[0].line_px, np.array(CRACK, dtype=float)).max() < 12


def test_a_crack_with_a_faint_stretch_is_not_followed_automatically(tmp_path):
    """The same line is followed automatically if it is black along its whole length."""
    black = with_crack(mortar(), CRACK, 6)
    assert search_of(tmp_path, black).path().source == "automatic"
    black[:, 200:270] = 0.95 * mortar()[:, 200:270] + 0.05 * black[:, 200:270]
    with pytest.raises(InputError):
        search_of(tmp_path, black).path()


def test_a_path_between_clicks_follows_a_black_wedge_at_the_photos_border(tmp_path):
    """Without clicks, the wedge is taken for the board around the sample."""
    picture = mortar()
    cv2.fillPoly(picture, [np.array([(0, 110), (0, 190), (120, 170), (460, 150), (460, 140), (120, 130)])], [0.01])
    wire = LiveWire(photo_of_light(tmp_path, picture))
    assert wire.field.around.any()
    path = wire.path(((12.0, 150.0), (440.0, 146.0)))
    assert distance_to(path.points_px, np.array([(0.0, 150.0), (460.0, 146.0)])).max() < 20
    with pytest.raises(InputError):
        wire.path(((300.0, 30.0), (440.0, 146.0)))
