"""Targets of benchmark rows, and the count and exit code with which a table ends."""

from math import inf, nan

import pytest

from benchmarks.table import Row, finish


@pytest.mark.parametrize(
    ("bounds", "target"),
    [
        ((0.95, 1.05), "0.95 to 1.05"),
        ((-0.3, 0.3), "-0.3 to 0.3"),
        ((0.0, 2.0), "<= 2"),
        ((88.0, inf), ">= 88"),
        ((0.0, 0.0), "0"),
    ],
)
def test_a_target_is_missed_outside_of_its_stated_bounds(bounds, target):
    low, high = bounds
    assert Row("figure", low, "", *bounds).target == target
    below, above = Row("figure", low - 1, "", *bounds), Row("figure", high + 1, "", *bounds)
    assert below.missed
    assert above.missed or high == inf
    assert Row("figure", nan, "", *bounds).missed


@pytest.mark.parametrize("bounds", [(), (0.0,), (0.0, inf), (-inf, inf)])
def test_a_benchmark_row_that_cannot_fail_is_reported_and_not_judged(bounds):
    row = Row("figure", 3.0, "", *bounds)
    assert (row.judged, row.missed, row.target) == (False, False, "reported")


@pytest.mark.parametrize(("value", "summary", "code"), [(1.0, "1 of 1 targets met", 0), (3.0, "0 of 1 targets met", 1)])
def test_reported_rows_of_a_table_are_not_counted_as_targets(value, summary, code, capsys):
    with pytest.raises(SystemExit) as left:
        finish([Row("judged", value, "", 0, 2), Row("reported", 5.0, "ms"), Row("no number", nan, "ms")])
    assert left.value.code == code
    assert summary in capsys.readouterr().out
