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
