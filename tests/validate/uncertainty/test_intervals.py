"""Intervals against Student's tables, closed forms and rectangular errors; their coverage is a benchmark."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from validate.metrics.curve_distances import Difference
from validate.uncertainty.intervals import (
    Doubt,
    bands_mm,
    doubt_of,
    draw,
    hats,
    mean_absolute,
    mean_error_interval,
    mean_weights,
)
from validate.uncertainty.readings_budget import Budget, ErrorPart

S_MM = np.linspace(0, 80, 9)
PERCENT = 0.01
"""Tolerance of a half-width: twice the scatter of 20,000 draws."""


def budget(scatter_mm=0.1, freedom=np.inf, parts=(), *, pooled: bool = True) -> Budget:
    ones = np.ones(len(S_MM))
    return Budget(ones * scatter_mm, ones * freedom, pooled, None, None, tuple(parts), ())


def part(
    standard_mm: float, shape: Literal["normal", "rectangular"] = "rectangular", *, shared: bool = True
) -> ErrorPart:
    return ErrorPart("part", np.ones(len(S_MM)) * standard_mm, shared, shape)


@pytest.mark.parametrize(("freedom", "factor"), [(2.0, 4.303), (34.0, 2.032), (np.inf, 1.960)])
def test_scatter_alone_is_students(freedom, factor):
    """Three repeats of one station have 4.30; seventeen stations pooled 2.03.

    A t of two degrees has long tails, which 20,000 draws know to 3 %.
    """
    assert Doubt(0.1, freedom, 0.0, ()).half_width_mm == pytest.approx(0.1 * factor, rel=3 * PERCENT)


def test_a_limit_alone_is_a_rectangle():
    assert Doubt(0.0, np.inf, 0.0, (0.02 / np.sqrt(3),)).half_width_mm == pytest.approx(0.95 * 0.02, rel=PERCENT)


def test_normal_parts_add_in_squares():
    assert Doubt(0.03, np.inf, 0.04, ()).half_width_mm == pytest.approx(1.96 * 0.05, rel=PERCENT)
    assert Doubt(0.03, np.inf, 0.04, ()).standard_mm == pytest.approx(0.05)


def test_scatter_averages_out_along_the_crack_and_what_is_shared_does_not():
    known = budget(0.1, parts=[part(0.05), part(0.07, "normal")])
    weight = np.full(9, 1 / 9)
    found = doubt_of(known, weight)
    assert found.scatter_mm == pytest.approx(0.1 / 3)
    assert (found.normal_mm, found.rectangular_mm) == (pytest.approx(0.07), (pytest.approx(0.05),))
    assert found.systematic_mm == pytest.approx(np.hypot(0.05, 0.07))


def test_a_shared_error_leaves_differences_alone():
    weight = np.array([1.0, -1.0, *np.zeros(7)])
    assert doubt_of(budget(0.0, parts=[part(0.05)]), weight).systematic_mm == pytest.approx(0.0)


def test_pooled_scatter_keeps_its_freedom_and_single_ones_add_theirs():
    """Welch and Satterthwaite: nine equal estimates of two degrees have eighteen together."""
    weight = np.full(9, 1 / 9)
    assert doubt_of(budget(0.1, 2.0), weight).freedom == pytest.approx(2.0)
    assert doubt_of(budget(0.1, 2.0, pooled=False), weight).freedom == pytest.approx(18.0)


def test_a_band_is_as_wide_as_its_station_is_unsure():
    """The band of a station comes from its own scatter, and not from the pooled one of a sum."""
    own_mm = np.where(S_MM < 40, 0.1, 0.2)
    band_mm = bands_mm(replace(budget(0.15), own_mm=own_mm[None]))
    assert band_mm == pytest.approx(1.96 * own_mm, rel=PERCENT)


def test_a_band_holds_every_scatter_that_is_possible():
    """Two degrees of freedom give Student's t, 4.30; 4,000 draws give its long tail to 5 %."""
    chi_square = np.random.default_rng(7).chisquare(2.0, (4_000, 9))
    band_mm = bands_mm(replace(budget(), own_mm=0.1 / np.sqrt(chi_square / 2)))
    assert band_mm == pytest.approx(np.full(9, 0.4303), rel=0.1)
    assert band_mm.mean() == pytest.approx(0.4303, rel=0.05)


def test_a_band_has_what_is_shared_and_the_last_digit():
    band_mm = bands_mm(
        replace(budget(parts=[part(0.05, "normal"), part(0.02, shared=False)]), own_mm=np.full((1, 9), 0.1))
    )
    assert band_mm == pytest.approx(1.96 * np.sqrt(0.1**2 + 0.05**2 + 0.02**2), rel=PERCENT)


def test_weights_of_a_mean_are_the_trapezoids():
    x = np.linspace(0, 80, 401)
    weight = mean_weights(x, hats(x, S_MM))
    assert weight == pytest.approx([1 / 16, *[1 / 8] * 7, 1 / 16])
    assert weight.sum() == pytest.approx(1.0)


def test_a_station_just_outside_counts_with_its_part():
    x = np.linspace(0, 75, 376)
    weight = mean_weights(x, hats(x, S_MM))
    assert weight[-1] == pytest.approx(5 * (5 / 10) / 2 / 75)


@given(st.lists(st.floats(-9, 9).map(lambda value: round(value, 3)), min_size=2, max_size=12))
def test_the_mean_of_absolutes_is_the_integral_of_the_comparison(values):
    """The mean is the same for any sampling, with crossings inside pieces."""
    x = np.linspace(0, 10, len(values))
    error = Difference(x, values, [0, 10], [0, 0])
    exact = np.sum(np.diff(error.x) * (np.abs(error.value[:-1]) + np.abs(error.value[1:])) / 2) / 10
    assert mean_absolute(x, np.array(values)) == pytest.approx(exact, rel=1e-9, abs=1e-9)


def test_draws_have_the_spread_of_their_budget():
    """20,000 draws give a deviation to 0.5 %; that of t with ten degrees is sqrt(10 / 8)."""
    known = budget(0.1, 10.0, parts=[part(0.05), part(0.02, shared=False)])
    noise_mm = draw(known, 20_000)
    assert noise_mm.std(axis=0) == pytest.approx(np.sqrt(0.1**2 * 10 / 8 + 0.05**2 + 0.02**2), rel=0.03)
    together = np.corrcoef(noise_mm[:, 0], noise_mm[:, 1])[0, 1]
    assert together == pytest.approx(0.05**2 / noise_mm[:, 0].var(), abs=0.03)


def interval(error_mm, known):
    x = np.linspace(0, 80, 81)
    error = Difference(x, np.broadcast_to(error_mm, 81), x, np.zeros(81))
    return mean_error_interval(error.x, error.value, hats(error.x, S_MM), known)


def test_an_error_of_one_sign_is_as_unsure_as_the_bias():
    """Scatter of nine stations, ends half: 1.96 x 0.1 x sqrt(7 / 64 + 2 / 256)."""
    found = interval(2.0, budget(0.1))
    half_mm = 1.96 * 0.1 * np.sqrt(7 / 64 + 2 / 256)
    assert found == (pytest.approx(2 - half_mm, rel=PERCENT), pytest.approx(2 + half_mm, rel=PERCENT))


def test_a_shared_error_moves_a_balanced_one_little():
    """A level 2 mm too high on one half and too low on the other: a shared error lowers one and raises the other."""
    x = np.linspace(0, 80, 81)
    balanced_mm = np.where(x < 40, 2.0, -2.0)
    balanced_mm[40] = 0.0
    shared = budget(0.0, parts=[part(0.2, "normal")])
    one_sided_mm, both_mm = np.ptp(interval(2.0, shared)), np.ptp(interval(balanced_mm, shared))
    assert one_sided_mm == pytest.approx(2 * 1.96 * 0.2, rel=0.05)
    assert both_mm < 0.1 * one_sided_mm


def test_what_scatter_alone_would_make_may_be_nothing():
    """An error of a tenth of the scatter does not show; one of ten times the scatter does.

    Of 300 perfect simulations 97.5 % have nothing in their interval, chance leaves 94.8 % of them.
    """
    assert interval(0.01, budget(0.1))[0] == 0.0
    assert interval(1.0, budget(0.1))[0] > 0.9
    stations_mm = np.linspace(0, 80, 33)
    ones = np.ones(33)
    known = Budget(0.1 * ones, np.inf * ones, True, None, None, (), ())
    random = np.random.default_rng(3)
    lows = []
    for _ in range(300):
        error = Difference(stations_mm, 0.1 * random.standard_normal(33), stations_mm, np.zeros(33))
        lows.append(mean_error_interval(error.x, error.value, hats(error.x, stations_mm), known)[0])
    assert np.mean(np.array(lows) == 0.0) > 0.948


def test_an_interval_is_the_same_each_time():
    assert interval(0.3, budget(0.1)) == interval(0.3, budget(0.1))
