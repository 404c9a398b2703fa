"""What is offered where nobody has clicked: a few lines, best first."""

import numpy as np
import pytest

from digitise.crack_path.find_path import MOST_RANKED, automatic_path, ranked_cracks
from sealtwin.core.errors import InputError
from tests.pictures import distance_to, evenly_scaled, mortar, with_crack, write_png


def photo_of_lines(folder, lines, size_px=(1000, 700)):
    """Each line is its places and its width."""
    picture = mortar(size_px)
    for points, width_px in lines:
        picture = with_crack(picture, points, width_px)
    return evenly_scaled(write_png(folder / "photo.png", picture))


def wave(y, bend=20):
    return [(x, round(y + bend * np.sin(x / 90 + y))) for x in range(40, 961, 20)]


def test_a_wide_crack_is_one_and_not_its_two_walls(tmp_path):
    """On the fine map it is two lines 70 px apart, and one of them was taken."""
    photo = photo_of_lines(tmp_path, [(wave(350), 70)])
    (only,) = ranked_cracks(photo)
    assert only.width_px == pytest.approx(70, rel=0.2)
    inner = only.line_px[(only.line_px[:, 0] > 100) & (only.line_px[:, 0] < 900)]
    assert distance_to(inner, np.array(wave(350), dtype=float)).max() < 15
    assert automatic_path(photo).width_px == pytest.approx(70, rel=0.1)


def test_rivals_are_offered_best_first_and_no_more_than_a_few(tmp_path):
    lines = [(wave(60 + 95 * number), width_px) for number, width_px in enumerate((5, 8, 6, 7, 5, 6, 5))]
    photo = photo_of_lines(tmp_path, lines)
    ranked = ranked_cracks(photo)
    assert len(ranked) == MOST_RANKED
    scores = [crack.score for crack in ranked]
    assert scores == sorted(scores, reverse=True)
    with pytest.raises(
        InputError, match=r"five cracks compete, best first, .*: 1\. \(.* px, 100%; 2\. .*; 5\. .*ends_px"
    ):
        automatic_path(photo)


def test_nothing_is_offered_on_plain_ground(tmp_path):
    assert ranked_cracks(photo_of_lines(tmp_path, [])) == []
