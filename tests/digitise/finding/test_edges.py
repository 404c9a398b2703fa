"""Edges, which are dark against one side only."""

import numpy as np
import pytest

from digitise.finding.edges import edge_share

CELLS = np.column_stack([np.full(200, 40), np.arange(20, 220)])
"""Along row 40, (row, column)."""


def picture(above, below, in_line, half_width=2):
    rows = np.arange(80)
    level = np.where(rows < 40, above, below)
    level = np.where(np.abs(rows - 40) <= half_width, in_line, level)
    grain = 0.03 * np.random.default_rng(0).standard_normal((80, 240))
    return (level[:, None] + grain).astype(np.float32)


@pytest.mark.parametrize(("above", "below"), [(1.3, 0.7), (0.7, 1.3)])
def test_a_step_is_an_edge_whichever_side_is_dark(above, below):
    """Even where it is a little darker in between, as most shadows of edges are."""
    for in_line in (0.7, 0.6):
        assert edge_share(picture(above, below, in_line), CELLS, 2.5) > 0.95


@pytest.mark.parametrize(("above", "below"), [(1.0, 1.0), (1.1, 0.9)])
def test_a_dark_line_is_none_and_neither_is_one_along_a_faint_step(above, below):
    assert edge_share(picture(above, below, 0.5), CELLS, 2.5) == 0


def test_the_share_is_that_of_the_length():
    half = picture(1.3, 0.7, 0.7)
    for start in (60, 140):
        half[:, start : start + 50] = picture(1.0, 1.0, 0.5)[:, start : start + 50]
    assert edge_share(half, CELLS, 2.5) == pytest.approx(0.5, abs=0.05)
