"""What is offered where nobody has clicked: a few lines, best first."""

import numpy as np
import pytest

from digitise.crack_path.find_path import CrackSearch, RivalCracksError, find_path
from digitise.settings import MOST_RANKED
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
    (only,) = CrackSearch.of(photo).cracks
    assert only.width_px == pytest.approx(70, rel=0.2)
    inner = only.line_px[(only.line_px[:, 0] > 100) & (only.line_px[:, 0] < 900)]
    assert distance_to(inner, np.array(wave(350), dtype=float)).max() < 15
    assert find_path(photo, None).width_px == pytest.approx(70, rel=0.1)


def test_rivals_are_offered_best_first_and_no_more_than_a_few(tmp_path):
    lines = [(wave(60 + 95 * number), width_px) for number, width_px in enumerate((5, 8, 6, 7, 5, 6, 5))]
    photo = photo_of_lines(tmp_path, lines)
    ranked = CrackSearch.of(photo).cracks
    assert len(ranked) == MOST_RANKED
    scores = [crack.score for crack in ranked]
    assert scores == sorted(scores, reverse=True)
    with pytest.raises(InputError, match=r"5 cracks compete, best first, .*: 1\. \(.* px, 100%; 2\. .*; 5\. .*ends_px"):
        find_path(photo, None)


def test_a_number_takes_the_crack_of_that_rank(tmp_path):
    photo = photo_of_lines(tmp_path, [(wave(150), 6), (wave(450), 6)])
    with pytest.raises(RivalCracksError, match="2 cracks compete") as asked:
        find_path(photo, None)
    for number, crack in enumerate(asked.value.cracks, 1):
        path = find_path(photo, None, crack=number)
        assert path.source == "choice"
        assert distance_to(path.points_px, crack.line_px).max() < 6
    with pytest.raises(InputError, match=r"photo\.crack = 3, but only 2 found: 1\. .*; 2\. "):
        find_path(photo, None, crack=3)


def test_the_rim_of_a_stain_is_not_offered(tmp_path):
    """It comes back to where it begins. On one of eight photos without a crack it was offered."""
    turn = np.linspace(0, 1.8 * np.pi, 60)
    ring = [(round(500 + 220 * np.cos(a)), round(350 + 180 * np.sin(a))) for a in turn]
    assert CrackSearch.of(photo_of_lines(tmp_path, [(ring, 8)])).cracks == ()


def test_nothing_is_offered_on_plain_ground(tmp_path):
    assert CrackSearch.of(photo_of_lines(tmp_path, [])).cracks == ()
