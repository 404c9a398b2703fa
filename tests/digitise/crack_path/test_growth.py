"""Cracks from their middle lines."""

import numpy as np
import pytest

from digitise.crack_path.crack_map import grown

ALL = np.ones((120, 300), dtype=bool)


def lines():
    cells = np.zeros((120, 300), dtype=bool)
    cells[60, 20:280] = True
    return cells


def dark(width, level=0.8):
    picture = np.full((120, 300), level / 2, dtype=np.float32)  # ground is dark as well, if less
    low = 60 - width // 2
    picture[low : low + width, 20:280] = level
    return picture


@pytest.mark.parametrize("width", [5, 9, 21, 35])
@pytest.mark.parametrize("level", [0.2, 0.9])
def test_a_crack_grows_to_its_walls_however_dark_it_is(width, level):
    found = grown(lines(), dark(width, level), ALL)
    assert found[:, 150].sum() == width


def test_a_line_is_three_cells_wide_at_least():
    assert grown(lines(), dark(1), ALL)[:, 150].sum() == 3


def test_a_stain_that_the_crack_runs_through_is_no_crack():
    """40 cells across, where the crack has 7: it may swell to three times that."""
    picture = dark(7)
    picture[40:100, 130:170] = 0.8
    found = grown(lines(), picture, ALL)
    assert found[:, 150].sum() < 26
    assert found[:, 100].sum() == 7


def test_what_may_not_be_searched_is_no_crack():
    allowed = ALL.copy()
    allowed[:, 200:] = False
    assert not grown(lines(), dark(9), allowed)[:, 200:].any()


def test_no_lines_no_cracks():
    assert not grown(np.zeros_like(ALL), dark(9), ALL).any()
