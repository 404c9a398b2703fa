"""Votes make thin lines of a thick map: hairs go, gaps close, loops stay."""

import numpy as np
import pytest

from digitise.crack_path.step_costs import voted_lines

DEAR = 25.0
"""Of a step off the crack, against 1 on it."""


def cost_of(cells):
    return np.where(cells, 1.0, DEAR)


@pytest.fixture
def crack():
    cells = np.zeros((80, 160), dtype=bool)
    cells[40, 10:150] = True
    return cells


def test_votes_gather_on_the_cheapest_way_beside_the_voters(crack):
    """Voters two cells off the crack, as a coarse map puts them, and lines on it."""
    voters = np.roll(crack, 2, axis=0)
    lines = voted_lines(voters, voters, cost_of(crack))
    rows, columns = np.nonzero(lines)
    assert np.all(np.sort(rows)[:-3] == 40)  # the voter to whom all ways lead is linked to the crack
    assert np.ptp(columns) > 140 - 2 * 11


def test_a_hair_is_no_line(crack):
    """Eight cells, where eleven votes are needed; thirty are a side crack."""
    for length, left in ((8, False), (30, True)):
        cells = crack.copy()
        cells[40 - length : 40, 80] = True
        assert voted_lines(cells, cells, cost_of(cells))[:35, 80].any() == left


def test_a_gap_is_bridged_and_a_wide_one_is_not(crack):
    for width, bridged in ((12, True), (50, False)):
        cells = crack.copy()
        cells[:, 80 - width // 2 : 80 + width // 2] = False
        assert voted_lines(cells, cells, cost_of(cells))[:, 80].any() == bridged


def test_a_loop_stays_closed_but_for_its_parting():
    """The two ways round it part somewhere, where fewer than eleven votes pass on either side."""
    y, x = np.mgrid[:90, :90] - 44.5
    ring = np.abs(np.hypot(x, y) - 35) < 0.7
    lines = voted_lines(ring, ring, cost_of(ring))
    assert np.count_nonzero(lines) > 0.85 * 2 * np.pi * 35 / np.sqrt(2)
    angle = np.sort(np.arctan2(*np.nonzero(lines)[0:2] - np.array([[44.5], [44.5]])))
    assert np.diff(angle).max() * 35 < 2 * 11 + 2


def test_what_no_way_leads_to_is_kept(crack):
    """As a second crack behind what may not be searched, a marker across a narrow face."""
    cells = crack | np.roll(crack, 25, axis=0)
    cost = cost_of(cells)
    cost[55] = np.inf
    lines = voted_lines(cells, cells, cost)
    assert np.ptp(np.nonzero(lines[40])[0]) > 110
    assert np.ptp(np.nonzero(lines[65])[0]) > 110


def test_without_voters_there_are_no_lines(crack):
    assert not voted_lines(np.zeros_like(crack), crack, cost_of(crack)).any()
