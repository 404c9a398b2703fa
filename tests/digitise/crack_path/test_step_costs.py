"""What steps cost, the cheapest way, and votes: they make thin lines of a thick map."""

import numpy as np
import pytest

from digitise.crack_path.darkness import DarkMap
from digitise.crack_path.step_costs import (
    CLEAR,
    NOTHING,
    cheapest,
    cost_of_thin,
    cost_of_wide,
    cost_off_centre,
    measure,
    middle_width,
    voted_lines,
)
from sealtwin.core.records import Floats

SHAPE = (60, 100)


def field_of(ridge: Floats | float = 0.0, dark: Floats | float = 0.0, allowed=True, darkest=0.8) -> DarkMap:
    def whole(value):
        return np.broadcast_to(np.asarray(value, np.float32), SHAPE).copy()

    searched, around = np.full(SHAPE, allowed), np.zeros(SHAPE, dtype=bool)
    return DarkMap((0.0, 0.0), 1.0, whole(1), whole(dark), whole(1), whole(ridge), searched, darkest, around)


def row(number, value, width=1):
    picture = np.zeros(SHAPE)
    picture[number - width // 2 : number - width // 2 + width] = value
    return picture


ALONG = np.column_stack([np.full(80, 30), np.arange(10, 90)])


def test_a_gap_costs_as_much_as_a_line_many_times_as_long():
    cost = cost_of_thin(field_of(ridge=row(30, CLEAR)), ALONG)
    assert cost[10, 50] / cost[30, 50] == pytest.approx(1 / NOTHING, rel=0.05)


def test_the_middle_of_a_clear_line_is_cheaper_than_what_is_clear_beside_it():
    """As beside a crack in a photo without noise: more than ``CLEAR`` both, and yet not the same."""
    field = field_of(ridge=row(30, 5 * CLEAR) + row(25, 2 * CLEAR))
    cost = cost_of_thin(field, ALONG)
    assert cost[25, 50] > 2 * cost[30, 50]


def test_a_way_over_plain_ground_makes_no_grain_a_crack():
    """Its own clearness is no measure of a crack's: one grain stays as cheap as on any other way."""
    field = field_of(ridge=row(20, CLEAR / 2))
    assert cost_of_thin(field, ALONG)[20, 50] == pytest.approx(1 / (NOTHING + 0.5))


def test_a_wide_crack_is_told_by_its_darkness():
    field = field_of(ridge=CLEAR, dark=row(30, 0.8) + row(10, 0.2))
    cost = cost_of_wide(field)
    assert cost[10, 50] > 5 * cost[30, 50]
    assert cost[30, 50] == pytest.approx(1 / 1.03, rel=1e-3)  # as dark as the darkest of the whole map


def test_the_middle_of_a_wide_crack_is_the_cheapest():
    field = field_of(dark=row(30, 0.8, width=15))
    cost = cost_off_centre(field, ALONG, 0.8)
    assert np.argmin(cost[20:41, 50]) == 10
    assert measure(field, ALONG)[1] == pytest.approx(15, abs=1)


def test_nothing_leads_where_nothing_is_searched():
    for cost in (cost_of_thin(field_of(allowed=False), ALONG), cost_of_wide(field_of(allowed=False, darkest=0.0))):
        assert np.isinf(cost).all()


@pytest.mark.parametrize("row_of_detour", [15, 45])
@pytest.mark.parametrize(("margin", "detours"), [(20, True), (10, False)])
def test_the_cheapest_way_keeps_within_its_margin(margin, detours, row_of_detour):
    """The detour is 15 cells off, and a hundred times cheaper."""
    cost = np.full(SHAPE, 100.0)
    cost[row_of_detour, 10:91] = 1.0
    cost[min(row_of_detour, 30) : max(row_of_detour, 30) + 1, [10, 90]] = 1.0
    way = cheapest(cost, np.array([30, 10]), np.array([30, 90]), margin)
    assert np.all(way[0] == (30, 10))
    assert np.all(way[-1] == (30, 90))
    assert (row_of_detour in way[:, 0]) == detours


def test_a_way_along_a_wall_measures_the_whole_width_and_is_led_to_the_middle():
    field = field_of(dark=row(30, 0.8, width=31))
    beside = ALONG - np.array([14, 0])
    assert measure(field, beside)[1] == pytest.approx(31, abs=2)
    assert middle_width(field, beside, 0.8) == pytest.approx(31, abs=2)
    cost = cost_off_centre(field, beside, 0.8)
    assert cost[30, 50] < cost[20, 50] / 3


def test_a_way_along_a_thin_crack_measures_itself():
    assert measure(field_of(dark=row(30, 0.8, width=7)), ALONG - np.array([3, 0]))[1] == pytest.approx(1, abs=0.5)


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
