"""A comparison: its metrics beside a fine grid, its bins, its readings' scatter, and what it takes to pass."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings

from sealtwin.study.runner import MOST_NUMBERS, _compared
from tests.support.levels import PROSE, STATIONS, compared, curves, measured, outline, profile, solid
from validate.compare import compare
from validate.metrics.curve_distances import Difference
from validate.settings import Gate


@settings(max_examples=4, deadline=None)
@given(curves(), curves())
def test_every_metric_agrees_with_a_fine_grid(a, b):
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


def test_bins_are_ten_millimetres_and_the_last_takes_the_rest():
    def edges(length_mm):
        line = profile([0, length_mm], [0, 0])
        result = compare(line, line, outline(length_mm), solid(), role="held-out", photo_data="measured")
        return [(part.from_mm, part.to_mm) for part in result.distances.by_bin]

    assert edges(80.0) == [(10.0 * i, 10.0 * (i + 1)) for i in range(8)]
    assert edges(80.3)[-1] == (70.0, 80.3)
    assert edges(3.0) == [(0.0, 3.0)]


def test_what_is_not_covered_is_said_and_not_counted():
    half = compared(profile(STATIONS, PROSE + 1), profile(STATIONS[3:9], PROSE[3:9], data="measured"))
    assert half.basis.covered_length_mm == 25.0
    assert half.basis.coverage == pytest.approx(25 / 80)
    assert half.mean_error_mm == pytest.approx(1.0)
    covered = [part.covered_mm for part in half.distances.by_bin]
    assert covered == [0.0, 5.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0]
    assert half.distances.by_bin[0].mean_error_mm is None


def test_a_flat_simulation_does_not_beat_the_flat_level():
    metrics = compared(profile([0, 80], [-2, -2]))
    assert (metrics.worst_error_mm, metrics.worst_at_mm, metrics.beats_flat_level) == (14.0, 0.0, False)
    assert metrics.errors.flat_level_error_mm == pytest.approx(Difference([0, 80], [1, 1], STATIONS, PROSE).mean_error)


def test_repeats_of_all_stations_are_pooled():
    """Seventeen stations of three have 34 degrees of freedom, and two readings less two of them less."""
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


def test_a_gate_is_on_the_mean_error_and_a_particle_through_a_wall_fails_every_run():
    sound = compared(profile(STATIONS, PROSE + 1.0), gate=Gate(mean_error_mm=1.6))
    assert (sound.passed, sound.headline[-1].text[:13]) == (True, "Gate passed: ")
    leaking = compared(profile(STATIONS, PROSE), escaped_particles=11)
    assert leaking.passed is False
    assert leaking.verdict.startswith("Do not use this run: 11 particles went through a wall")


def test_a_station_beyond_the_crack_is_counted_as_such_everywhere():
    """80 mm were read, 79.5 traced: that station shapes the readings' line to the end, and is none that is compared."""
    metrics = compared(profile([0.0, 79.5], [1.0, 1.0]))
    assert (metrics.basis.stations_compared, metrics.basis.stations_used) == (16, 17)
    assert metrics.basis.stations_beyond_mm.tolist() == [80.0]
    assert (len(metrics.stations.s_mm), set(metrics.stations.simulated_mm)) == (16, {1.0})
    figures = _compared(profile([0.0, 79.5], [1.0, 1.0]), measured())
    assert (figures["stations_compared"], figures["mean_error_mm"]) == (16, metrics.mean_error_mm)
    assert [curve.numbers for curve in figures["baselines"]] == [*range(1, MOST_NUMBERS + 1)]
    names = {"role": "calibrated-on", "fitted": tuple(f"setting {number}" for number in range(16))}
    sentences = compared(profile([0.0, 79.5], [1.0, 1.0]), **names).headline
    assert "16 settings can fit any level at 16 stations" in sentences[0].text
    short = compared(profile([0.0, 31.0], [1.0, 1.0])).headline[0].text
    assert "(7 stations and 1 beyond them, " in short
