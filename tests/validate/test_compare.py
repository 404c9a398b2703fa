"""The comparison, held to closed forms, to the traps of similaritymeasures and to what a distance must do."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import similaritymeasures
from hypothesis import given, settings
from hypothesis import strategies as st

from sealtwin.errors import InputError
from sealtwin.records import Outline, Profile, Solid
from tests.shapes import level_floor
from validate.compare import area_between, area_by_similaritymeasures, best_flat_level, compare, frechet_mm
from validate.settings import Gate

LENGTH_MM, WIDTH_MM, DEPTH_MM = 80.0, 3.0, 16.0
STATIONS = np.linspace(0, LENGTH_MM, 17)
PROSE = np.interp(STATIONS, [0, 20, 30, 40, 80], [-16, -4, -4, 1, 1])


def outline(length_mm: float = LENGTH_MM) -> Outline:
    line = np.column_stack([np.linspace(0, length_mm, 81), np.zeros(81)])
    half = np.array([0, WIDTH_MM / 2])
    left, right = line + half, line - half
    ring = np.vstack([right, left[::-1]])
    return Outline(line, left, right, ring, line, left, right, ring, ("cut", "cut"), None, 0.1, "given", None, "ends")


def solid(tilt: str = "vertical", angle_deg: float = 0.0) -> Solid:
    none, box = np.empty((0, 3)), (0.0, 0.0, 0.0, 0.0)
    angles_deg, sections = (angle_deg, angle_deg), level_floor(DEPTH_MM)
    return Solid(none, none.astype(int), np.empty(0, int), box, DEPTH_MM, tilt, angles_deg, 3968.0, sections, {})


def profile(x, y, **kind) -> Profile:
    return Profile(np.asarray(x, dtype=float), np.asarray(y, dtype=float), **kind)


def measured(data="measured", offset_mm: float = 0.0) -> Profile:
    return profile(STATIONS, PROSE + offset_mm, data=data, source="caliper.csv")


def compared(simulated: Profile, read: Profile | None = None, **choices):
    kinds: dict[str, Any] = {"role": "held-out", "photo_data": "measured"} | choices
    return compare(simulated, read or measured(), outline(), solid(), **kinds)


def noisy_profile(seed: int = 1):
    x = np.linspace(0, LENGTH_MM, 801)
    return x, np.interp(x, STATIONS, PROSE) + 1.0 * np.sin(x / 3) + np.random.default_rng(seed).normal(0, 0.3, 801)


@pytest.mark.parametrize(
    ("a", "b", "area"),
    [
        (([0, 1], [0, 1]), ([0, 1], [1, 0]), 0.5),
        (([0, 4], [0, 0]), ([0, 4], [1, 1]), 4.0),
        (([0, 2], [0, 2]), ([0, 1, 2], [0, 1, 2]), 0.0),
        (([0, 3], [0, 0]), ([0, 3], [-1, 2]), 0.5 + 2.0),
        (([0, 10], [0, 0]), ([2, 7], [1, 1]), 5.0),
        (([1, 0], [1, 0]), ([0, 1], [1, 0]), 0.5),
        (([0, 1, 2], [0, 1, 0]), ([0, 2], [0.5, 0.5]), 0.5),
    ],
    ids=["crossing", "parallel", "same curve", "unequal triangles", "part covered", "reversed", "tent"],
)
def test_areas_of_closed_form(a, b, area):
    (x_a, y_a), (x_b, y_b) = a, b
    assert area_between(x_a, y_a, x_b, y_b) == pytest.approx(area, abs=1e-12)
    assert area_by_similaritymeasures(x_a, y_a, x_b, y_b) == pytest.approx(area, abs=1e-9)


@pytest.mark.parametrize("rest", [5e-211, -5e-211, 1e-17, -1e-17, 3e-16])
def test_what_rounding_leaves_at_a_station_drops_no_triangle(rest):
    """Found by hypothesis: the library sees a crossing at x = 1 - 1e-17 as none, and gives 0 for 0.5."""
    assert area_between([0, 1], [0, 0], [0, 1], [-1, rest]) == pytest.approx(0.5, abs=1e-12)
    assert area_by_similaritymeasures([0, 1], [0, 0], [0, 1], [-1, rest]) == pytest.approx(0.5, abs=1e-9)


def test_a_parabola_converges_to_its_integral():
    x = np.linspace(0, 1, 20_001)
    assert area_between(x, x**2, [0, 1], [0, 1]) == pytest.approx(1 / 6, abs=1e-9)


def test_one_curve_twice_and_a_crossing_mislead_the_library_and_not_us():
    """Points are paired by their number: a curve against itself, sampled finer, is an area; a crossing is none."""
    x = np.linspace(0, LENGTH_MM, 801)
    same = np.column_stack([x, np.interp(x, STATIONS, PROSE)])
    assert similaritymeasures.area_between_two_curves(np.column_stack([STATIONS, PROSE]), same) > 10
    assert area_between(x, same[:, 1], STATIONS, PROSE) < 1e-12
    up, down = np.array([[0.0, 0.0], [1.0, 1.0]]), np.array([[0.0, 1.0], [1.0, 0.0]])
    assert similaritymeasures.area_between_two_curves(up, down) == pytest.approx(1.0)
    assert area_between(*up.T, *down.T) == pytest.approx(0.5, abs=1e-12)


TRAPS = {
    "17 against 801 points": (lambda x, y: (x, y), 2.0),
    "17 against 40 points": (lambda x, y: (x[::20], y[::20]), 1.1),
    "simulation reversed": (lambda x, y: (x[::-1], y[::-1]), 10.0),
    "from 2 to 78 mm only": (lambda x, y: (x[20:-20], y[20:-20]), 2.0),
}
"""How a simulated profile may be given, and by what factor at least the library is then off, points fed as they are."""


@pytest.mark.parametrize("trap", TRAPS)
def test_each_trap_misleads_the_library_and_not_us(trap):
    """Ours against the trapezoids of a million points, whose error is below 1e-5.

    On the union of both grids, with its crossings, the library agrees with ours to 1e-9.
    """
    given, factor = TRAPS[trap]
    x, y = given(*noisy_profile())
    exact = area_between(x, y, STATIONS, PROSE)
    order = np.argsort(x)
    fine = np.linspace(x.min(), x.max(), 1_000_001)
    gap = np.abs(np.interp(fine, x[order], y[order]) - np.interp(fine, STATIONS, PROSE))
    assert exact == pytest.approx(np.trapezoid(gap, fine), rel=1e-5)
    sheet = np.column_stack([STATIONS, PROSE])
    assert similaritymeasures.area_between_two_curves(sheet, np.column_stack([x, y])) > factor * exact
    assert area_by_similaritymeasures(x, y, STATIONS, PROSE) == pytest.approx(exact, rel=1e-9)


def test_frechet_is_the_same_however_a_curve_is_sampled():
    """Level curves a millimetre apart are a millimetre apart; a step that comes 3 mm early costs 3 mm at most."""
    flat, above = profile([0, 80], [0, 0]), profile(np.linspace(0, 80, 33), np.ones(33))
    assert frechet_mm(flat, above, 0, 80) == pytest.approx(1.0)
    assert frechet_mm(above, flat, 0, 80) == pytest.approx(1.0)
    fine = np.linspace(0, 80, 1601)
    prose = profile(fine, np.interp(fine, STATIONS, PROSE))
    assert frechet_mm(prose, measured(), 0, 80) == pytest.approx(0.0, abs=1e-12)
    early, late = profile([0, 40, 41, 80], [-8, -8, 0, 0]), profile([0, 43, 44, 80], [-8, -8, 0, 0])
    assert frechet_mm(early, late, 0, 80) == pytest.approx(3.0, abs=0.05)
    assert compared(early, late).worst_error_mm == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        ([0, 1, np.nan], [0, 1, 2], "NaN"),
        ([0, 1, 2], [0, np.inf, 2], "NaN or infinity"),
        ([0, 1, 1], [0, 1, 2], "two values at 1"),
        ([0], [0], "two or more points"),
        ([0, 1], [0, 1, 2], "as many x as y"),
        ([5, 6], [0, 0], "do not overlap"),
        ([4, 5], [0, 0], "do not overlap"),
    ],
)
def test_curves_that_are_no_functions_are_refused(x, y, message):
    for area in (area_between, area_by_similaritymeasures):
        with pytest.raises(InputError, match=message):
            area(x, y, [0, 4], [0, 0])


heights = st.floats(-20, 20, allow_nan=False).map(lambda value: round(value, 6))
places = st.floats(0, 80, allow_nan=False).map(lambda value: round(value, 3))


@st.composite
def curves(draw):
    x = sorted({0.0, 80.0} | draw(st.sets(places, max_size=20)))
    return np.array(x), np.array(draw(st.lists(heights, min_size=len(x), max_size=len(x))))


@settings(max_examples=60, deadline=None)
@given(curves(), curves(), curves(), st.randoms(use_true_random=False))
def test_the_area_is_a_distance(a, b, c, random):
    area = area_between(*a, *b)
    assert area_between(*b, *a) == pytest.approx(area, rel=1e-9, abs=1e-9)
    assert area_by_similaritymeasures(*a, *b) == pytest.approx(area, rel=1e-9, abs=1e-9)
    assert area <= area_between(*a, *c) + area_between(*c, *b) + 1e-9
    order = list(range(len(a[0])))
    random.shuffle(order)
    assert area_between(a[0][order], a[1][order], *b) == area
    finer = np.unique(np.concatenate([a[0], np.linspace(0, 80, 97)]))
    assert area_between(finer, np.interp(finer, *a), *a) <= 1e-9


@settings(max_examples=40, deadline=None)
@given(curves(), curves())
def test_every_metric_agrees_with_a_fine_grid(a, b):
    result = compared(profile(*a), profile(*b))
    fine = np.linspace(0, 80, 40_001)
    error = np.interp(fine, *a) - np.interp(fine, *b)
    assert result.mean_error_mm == pytest.approx(np.abs(error).mean(), abs=0.02)
    assert result.metrics["bias_mm"] == pytest.approx(error.mean(), abs=0.02)
    assert result.metrics["rmse_mm"] == pytest.approx(np.sqrt((error**2).mean()), abs=0.03)
    assert result.worst_error_mm >= np.abs(error).max() - 1e-9
    assert result.metrics["share_under_1_mm"] == pytest.approx((np.abs(error) < 1).mean(), abs=0.005)
    within = np.mean(np.abs(error) <= result.metrics["p95_error_mm"] + 1e-9)
    assert within == pytest.approx(0.95, abs=0.005) or np.ptp(np.abs(error)) == 0 or within >= 0.95
    whole = sum(part["mean_error_mm"] * part["covered_mm"] for part in result.metrics["error_by_bin"])
    assert whole == pytest.approx(result.metrics["area_mm2"], rel=1e-9, abs=1e-9)


def test_a_simulation_that_stands_a_millimetre_too_high():
    result = compared(profile([0, 80], [0, 0]), measured(offset_mm=0.0))
    shifted = compared(profile(STATIONS, PROSE + 1.5))
    assert shifted.mean_error_mm == pytest.approx(1.5)
    assert shifted.metrics["bias_mm"] == pytest.approx(1.5)
    assert shifted.metrics["rmse_mm"] == pytest.approx(1.5)
    assert [part["mean_error_mm"] for part in shifted.metrics["error_by_bin"]] == pytest.approx([1.5] * 8)
    assert shifted.metrics["share_under_1_mm"] == 0.0
    assert result.worst_error_mm == 16.0
    assert result.worst_at_mm == 0.0


def test_bins_are_ten_millimetres_and_the_last_takes_the_rest():
    def edges(length_mm):
        line = profile([0, length_mm], [0, 0])
        result = compare(line, line, outline(length_mm), solid(), role="held-out", photo_data="measured")
        return [(part["from_mm"], part["to_mm"]) for part in result.metrics["error_by_bin"]]

    assert edges(80.0) == [(10.0 * i, 10.0 * (i + 1)) for i in range(8)]
    assert edges(80.3)[-1] == (70.0, 80.3)
    assert edges(3.0) == [(0.0, 3.0)]


def test_what_is_not_covered_is_said_and_not_counted():
    half = compared(profile(STATIONS, PROSE + 1), profile(STATIONS[3:9], PROSE[3:9], data="measured"))
    assert half.metrics["covered_length_mm"] == 25.0
    assert half.metrics["coverage"] == pytest.approx(25 / 80)
    assert half.mean_error_mm == pytest.approx(1.0)
    covered = [part["covered_mm"] for part in half.metrics["error_by_bin"]]
    assert covered == [0.0, 5.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0]
    assert np.isnan(half.metrics["error_by_bin"][0]["mean_error_mm"])


def test_the_flat_level_is_the_median_and_no_other_does_better():
    level = best_flat_level(STATIONS, PROSE)
    # On half of the prose's length the level is above this, on half below: 40 mm stand at +1.
    assert level == pytest.approx(1.0, abs=1e-9)
    skew = best_flat_level(np.array([0.0, 10.0, 80.0]), np.array([0.0, -10.0, -3.0]))
    error = [area_between([0, 80], [c, c], [0, 10, 80], [0, -10, -3]) for c in (skew - 0.01, skew, skew + 0.01)]
    assert error[1] < min(error[0], error[2])


def test_a_flat_simulation_does_not_beat_the_flat_level():
    metrics = compared(profile([0, 80], [-2, -2])).metrics
    assert not metrics["beats_flat_level"]
    assert compared(profile(STATIONS, PROSE + 0.5)).metrics["beats_flat_level"]
    assert metrics["flat_level_error_mm"] == pytest.approx(area_between([0, 80], [1, 1], STATIONS, PROSE) / 80)


def test_repeats_of_all_stations_are_pooled():
    """34 degrees of freedom: t = 2.03; a scatter of 0.15 mm gives a band of 0.18 mm about means of three."""
    random = np.random.default_rng(3)
    repeats = PROSE[:, None] + random.normal(0, 0.15, (17, 3))
    read = replace(measured(), level_mm=repeats.mean(axis=1), repeats_mm=repeats)
    readings = compared(profile(STATIONS, PROSE), read).metrics["readings"]
    assert readings["degrees_of_freedom"] == 34
    deviation = np.sqrt(repeats.var(axis=1, ddof=1).mean())
    assert readings["repeatability_sd_mm"] == pytest.approx(deviation)
    assert readings["band_95_mm"] == pytest.approx(np.full(17, 2.0322 * deviation / np.sqrt(3)), rel=1e-4)
    repeats[4, 1:] = np.nan
    thinned = compared(profile(STATIONS, PROSE), replace(read, repeats_mm=repeats)).metrics["readings"]
    assert thinned["degrees_of_freedom"] == 32
    assert thinned["band_95_mm"][4] == pytest.approx(thinned["band_95_mm"][0] * np.sqrt(3))
    single = compared(profile(STATIONS, PROSE)).metrics["readings"]
    assert single["repeatability_sd_mm"] is None


@pytest.mark.parametrize(
    ("data", "photo_data", "role", "offset_mm", "starts"),
    [
        ("reconstructed", "reconstructed", "calibrated-on", 1.0, "Consistent with the reconstruction"),
        ("reconstructed", "measured", "held-out", 2.0, "Not consistent with the reconstruction"),
        ("synthetic", "measured", "held-out", 1.0, "Consistent with the reconstruction"),
        ("measured", "reconstructed", "held-out", 1.0, "Consistent with the reconstruction"),
        ("measured", "measured", "calibrated-on", 1.0, "Agrees with the readings it was calibrated on"),
        ("measured", "measured", "held-out", 1.0, "Validated on held-out readings"),
        ("measured", "measured", "held-out", 2.0, "Not validated"),
    ],
)
def test_only_measured_readings_that_were_held_out_validate(data, photo_data, role, offset_mm, starts):
    simulated = profile(STATIONS, PROSE + offset_mm)
    result = compared(simulated, measured(data), photo_data=photo_data, role=role, gate=Gate(mean_error_mm=1.6))
    assert result.verdict.startswith(starts)
    assert result.passed is (offset_mm < 1.6)
    assert ("alidated" in result.verdict) == (data == photo_data == "measured" and role == "held-out")


def test_without_a_gate_nothing_passes():
    result = compared(profile(STATIONS, PROSE))
    assert result.passed is None
    assert result.verdict.startswith("No gate declared")
    assert result.gate == {}


def test_a_particle_through_a_wall_fails_every_run():
    for gate in (Gate(mean_error_mm=1.6), None):
        result = compared(measured(), gate=gate, escaped_particles=11)
        assert result.passed is False
        assert result.verdict.startswith("Do not use: 11 particles went through a wall")
        assert result.metrics["escaped_particles"] == 11
    assert compared(measured(), gate=Gate(mean_error_mm=1.6)).passed is True


def test_two_readings_side_by_side_are_no_verdict():
    """What a stranger tried: a millimetre of the crack, and a level that is right there."""
    pair = profile([45, 46], [1.0, 1.0], data="measured")
    result = compared(measured(), pair, gate=Gate(mean_error_mm=1.6))
    assert result.mean_error_mm < 0.1
    assert result.passed is False
    assert result.verdict.startswith("No verdict: readings cover 1 % of the crack's length (2 stations")
    assert compared(measured(), pair).passed is None


def test_a_part_of_the_crack_is_named_in_the_verdict():
    part = STATIONS < 70.1
    result = compared(measured(), profile(STATIONS[part], PROSE[part], data="measured"), gate=Gate(mean_error_mm=1.6))
    assert result.passed is True
    assert result.verdict.endswith("allowed. The readings cover 87 % of the crack's length.")
    assert "cover" not in compared(measured(), gate=Gate(mean_error_mm=1.6)).verdict


def test_a_comparison_keeps_how_its_sheet_was_understood():
    """comparison.json is what another program reads: a depth taken for a level must be found there too."""
    read = replace(measured(), dialect="CSV, decimal comma; depth downward in cm")
    assert compared(measured(), read).metrics["readings_dialect"] == read.dialect
