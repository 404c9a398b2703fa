"""A comparison: its metrics against a fine grid, its readings' scatter, and stations beyond the crack."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings

from sealtwin.study.runner import MAX_NUMBERS, _level_errors
from tests.support.levels import PROSE, STATIONS, compared, curves, measured, profile


@settings(max_examples=4, deadline=None)
@given(curves(), curves())
def test_every_metric_agrees_with_a_numerical_integral_on_a_fine_grid(a, b):
    """Midpoints of 2,000 cells in each stretch between two stations: no kink is inside a cell, however short it is.

    In a stretch |E| passes a limit twice at most and 0 once, so no share is off by more than 2 in 2,000 and no mean of
    |E| <= 40 mm by more than 1e-5 mm; by the midpoint rule a mean square is off by less than one part in a million.
    """
    result = compared(profile(*a), profile(*b))
    knots = np.union1d(a[0], b[0])
    edges = np.concatenate([np.linspace(*ends, 2001)[:-1] for ends in pairwise(knots)] + [[80.0]])
    fine, share = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 80
    error = np.interp(fine, *a) - np.interp(fine, *b)
    size = np.abs(error)
    assert result.mean_error_mm == pytest.approx(share @ size, abs=1e-5)
    assert result.bias_mm == pytest.approx(share @ error, abs=1e-9)
    assert result.distances.rmse_mm == pytest.approx(np.sqrt(share @ error**2), rel=1e-6, abs=1e-9)
    assert result.worst_error_mm == pytest.approx(np.abs(np.interp(knots, *a) - np.interp(knots, *b)).max())
    under_1_mm, p95_mm = result.errors.share_under_1_mm, result.distances.p95_error_mm
    # On a level stretch |E| may be the limit itself, but for rounding: then it counts for either side.
    assert share @ (size < 1 - 1e-9) - 0.001 <= under_1_mm <= share @ (size < 1 + 1e-9) + 0.001
    assert share @ (size < p95_mm - 1e-9) - 0.001 <= 0.95 <= share @ (size < p95_mm + 1e-9) + 0.001
    whole = sum((part.mean_error_mm or 0.0) * part.covered_mm for part in result.distances.by_bin)
    assert whole == pytest.approx(result.distances.area_mm2, rel=1e-9, abs=1e-9)


def test_the_scatter_of_repeats_is_pooled_over_all_stations():
    """Seventeen stations with three readings have 34 degrees of freedom, or 32 without two of the readings."""
    random = np.random.default_rng(3)
    repeats = PROSE[:, None] + random.normal(0, 0.15, (17, 3))
    read = replace(measured(), level_mm=repeats.mean(axis=1), repeats_mm=repeats)
    readings = compared(profile(STATIONS, PROSE), read).scatter
    assert readings.degrees_of_freedom == 34
    deviation = np.sqrt(repeats.var(axis=1, ddof=1).mean())
    assert readings.repeatability_sd_mm == pytest.approx(deviation)
    repeats[4, 1:] = np.nan
    thinned = compared(profile(STATIONS, PROSE), replace(read, repeats_mm=repeats)).scatter
    assert thinned.degrees_of_freedom == 32


def test_a_station_beyond_the_crack_shapes_the_line_of_readings_but_is_not_compared():
    """Readings extend to 80 mm and the crack to 79.5 mm: the last station only shapes the readings' line."""
    metrics = compared(profile([0.0, 79.5], [1.0, 1.0]))
    assert (metrics.basis.stations_compared, metrics.basis.stations_used) == (16, 17)
    assert metrics.basis.stations_beyond_mm.tolist() == [80.0]
    assert (len(metrics.stations.s_mm), set(metrics.stations.simulated_mm)) == (16, {1.0})
    figures = _level_errors(profile([0.0, 79.5], [1.0, 1.0]), measured())
    assert (figures["stations_compared"], figures["mean_error_mm"]) == (16, metrics.mean_error_mm)
    assert [curve.numbers for curve in figures["baselines"]] == [*range(1, MAX_NUMBERS + 1)]
    names = {"role": "calibrated-on", "fitted": tuple(f"setting {number}" for number in range(16))}
    sentences = compared(profile([0.0, 79.5], [1.0, 1.0]), **names).headline
    assert "16 settings can fit any level at 16 stations" in sentences[0].text
    short = compared(profile([0.0, 31.0], [1.0, 1.0])).headline[0].text
    assert "(7 stations and 1 beyond them, " in short
