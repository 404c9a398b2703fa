"""The lines of a sample on a dark board, of which the photo gives neither face nor markers."""

import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from tests.support.photos import distance_to, mortar, photo_of_light, with_crack

LINE = [(x, round(150 + 16 * np.sin(x / 45) + 5 * np.sin(x / 13))) for x in range(60, 441, 6)]


@pytest.mark.parametrize(("light", "width_px"), [(0.005, 6), (0.02, 12), (0.05, 20)])
def test_the_crack_of_a_sample_on_a_dark_board_is_found_without_clicks(tmp_path, light, width_px):
    board = np.full((400, 600), light)
    board[50:350, 50:550] = with_crack(mortar(), LINE, width_px)
    photo = photo_of_light(tmp_path, board)
    path = find_path(photo, None)
    assert path.source == "found"
    assert distance_to(path.points_px, np.array(LINE, float) + 50).max() < 3 + width_px / 2
    assert trace_outline(photo, path).mean_width_mm == pytest.approx(0.1 * width_px, abs=0.16)


def test_a_crack_of_a_fifth_of_a_long_photo_has_its_full_width(tmp_path):
    """A dark streak inside the crack was followed, and its width of 5 px was the crack's."""
    line = [(x, round(150 + 20 * np.sin(x / 90))) for x in range(120, 660, 10)]
    picture = with_crack(mortar((774, 307)), line, 66)
    streak = with_crack(np.ones((307, 774)), line, 4)
    photo = photo_of_light(tmp_path, np.where(picture < 0.1, picture * (1 + streak), picture))
    outline = trace_outline(photo, find_path(photo, (line[0], line[-1])))
    assert outline.mean_width_mm == pytest.approx(6.6, rel=0.05)
