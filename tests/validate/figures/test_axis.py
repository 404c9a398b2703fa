"""Two settings as axes: what can be mapped, and the sentence where it cannot."""

import re
from typing import Any

import pytest

from sealtwin.core.errors import InputError
from validate.figures.chart import axes_of


def rows(*pairs: Any, names: tuple[str, str] = ("fluid.U", "fluid.D_cm")) -> list[dict[str, Any]]:
    return [dict(zip(names, pair, strict=True)) for pair in pairs]


def test_an_axis_counts_powers_of_ten_from_two_decades_on():
    """Broken on purpose with a limit of one decade, the second axis is logarithmic and this fails."""
    across, up = axes_of(rows((0.01, 1), (1, 50), (0.01, 50)))
    assert (across.logarithmic, up.logarithmic) == (True, False)
    assert not axes_of(rows((0, 1), (100, 50), (100, 1)))[0].logarithmic


def test_axes_have_the_names_and_units_of_the_settings():
    across, up = axes_of(rows((1, 2.5), (2, 3.5), (1, 3.5), names=("fluid.U", "path.speed_mm_s")))
    assert (across.label, up.label) == ("U", "speed (mm/s)")
    assert up.said(2.5) == "speed = 2.5 mm/s"
    assert across.said(1.0) == "U = 1"


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (
            rows((1, 1), (1, 1), (1, 1)),
            "A map needs two settings that vary among the finished runs; here none",
        ),
        (rows((1, 1), (2, 1), (3, 1)), "here 1 do: fluid.U."),
        (rows((1, "a"), (2, "b"), (1, "b")), "fluid.D_cm = 'a'"),
        (rows((1, True), (2, False), (1, False)), "fluid.D_cm = True"),
        (rows((1, 10), (2, 20), (3, 30)), "fluid.U and fluid.D_cm vary together"),
        (rows((1, 100), (10, 10), (100, 1), (1000, 0.1)), "fluid.U and fluid.D_cm vary together"),
        (
            [{"a.x": 1, "a.y": 1, "a.z": 1}, {"a.x": 2, "a.y": 2, "a.z": 2}, {"a.x": 1, "a.y": 2, "a.z": 3}],
            "here 3 do: a.x, a.y, a.z.",
        ),
    ],
)
def test_what_cannot_be_mapped_is_refused_in_a_sentence(settings, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)) as fault:
        axes_of(settings)
    assert "\n" not in str(fault.value)


def test_draws_are_no_grid():
    """A line through values that one run each has would show noise as an influence."""
    across, _ = axes_of(rows(*[(value, 7 * value % 12) for value in range(12)]))
    assert not across.is_graded(runs=12)
    assert axes_of(rows(*[(one, other) for one in range(6) for other in range(2)]))[0].is_graded(runs=12)


def test_values_are_told_as_people_set_them():
    axis = axes_of(rows((1, 1), (2, 2), (1, 2)))[0]
    assert [axis.rounded(value) for value in (10000.0, 1e-4, 23.8957, 0.03)] == ["10000", "0.0001", "23.9", "0.03"]
