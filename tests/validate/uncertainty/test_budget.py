"""Intervals from draws of named errors, compared with closed forms; a benchmark measures their coverage."""

import numpy as np
import pytest
from scipy import stats

from sealtwin.core.records import Floats
from validate.metrics.curve_distances import Difference
from validate.uncertainty.budget import DRAWS, Budget, Component, Curve, normals, uniforms

S_MM = np.linspace(0, 80, 9)
PERCENT = 0.03
"""Tolerance of the half-width of a sum of several errors: twice the scatter of 4,000 draws, 1.5 %."""


def own(size_mm: float, name: str = "own") -> Component:
    return Component(name, "declared", size_mm * normals(name, len(S_MM)))


def alike(size_mm: float, name: str = "alike") -> Component:
    return Component(name, "declared", size_mm * normals(name, 1) * np.ones(len(S_MM)), shared=True)


def budget(*components: Component) -> Budget:
    return Budget(len(S_MM), components)


def curve(error_mm: float | Floats = 1.0, x: Floats | None = None) -> Curve:
    x = np.linspace(0, 80, 81) if x is None else x
    error = Difference(x, np.broadcast_to(error_mm, len(x)), x, np.zeros(len(x)))
    return Curve.of(error.x, error.value, S_MM)


def test_draws_are_stratified_and_reproducible():
    """Each of 4,000 even parts has one draw, so that the quantiles of one error are exact."""
    drawn = uniforms("a name", 3)
    assert np.sort(drawn, axis=0) == pytest.approx(np.tile(((np.arange(DRAWS) + 0.5) / DRAWS)[:, None], (1, 3)))
    assert abs(np.corrcoef(drawn[:, 0], uniforms("another", 3)[:, 0])[0, 1]) < 0.05
    assert budget(own(0.1)).band_mm == pytest.approx(0.196, rel=1e-3)
    assert uniforms("a name", 3) is drawn


def test_independent_errors_add_in_squares_and_shared_errors_cancel_in_differences():
    assert budget(own(0.03), alike(0.04)).band_mm == pytest.approx(1.96 * 0.05, rel=2 * PERCENT)
    difference = np.array([1.0, -1.0, *np.zeros(7)]), np.zeros(8)
    assert budget(alike(0.05)).mean_mm(difference) == pytest.approx(0.0, abs=1e-12)


def test_weights_of_the_mean_are_exact_for_straight_lines_and_parabolas():
    """The mean of a parabola is two thirds of its height, or five eighths if it consists of four straight pieces."""
    hat, bump = curve(x=np.linspace(0, 80, 2)).weights()
    assert hat == pytest.approx([1 / 16, *[1 / 8] * 7, 1 / 16])
    assert bump == pytest.approx([0.625 / 8] * 8)
    assert curve(x=np.linspace(0, 80, 1601)).weights()[1] == pytest.approx([2 / 3 / 8] * 8, rel=1e-3)
    # A station just outside counts in part.
    assert curve(x=np.linspace(0, 75, 76)).weights()[0][-1] == pytest.approx(5 * (5 / 10) / 2 / 75)


def test_the_common_band_of_all_stations_is_wider_only_for_independent_errors():
    """The largest of nine independent normal errors is below 2.77 in 95 % of cases (Sidak), one error below 1.96."""
    apart, shared, none = budget(own(0.1)), budget(alike(0.1)), budget()
    for each, number in ((apart, 9), (apart.at_stations(S_MM < 35), 4)):
        assert len(each.band_mm) == number
        wide = stats.norm.ppf((1 + 0.95 ** (1 / number)) / 2)
        assert each.profile_band_mm == pytest.approx(wide * 0.1, rel=PERCENT)
    assert apart.by_chance == pytest.approx(0.05 * 9, rel=0.01)
    assert shared.profile_band_mm == pytest.approx(shared.band_mm)
    assert none.band_mm.tolist() == none.profile_band_mm.tolist() == [0.0] * 9
    assert none.mean_error_interval(curve(0.7)) == pytest.approx((0.7, 0.7))


def test_the_interval_of_an_error_below_the_scatter_begins_at_zero():
    """An error of a tenth of the scatter does not show; one of ten times the scatter does."""
    assert budget(own(0.1)).mean_error_interval(curve(0.01))[0] == 0.0
    assert budget(own(0.1)).mean_error_interval(curve(1.0))[0] > 0.9
    low_mm, high_mm = budget(own(0.1)).mean_error_interval(curve(0.0))
    assert (low_mm, high_mm > 0.05) == (0.0, True)
