"""Errors of the readings: detected in repeats and last digits, declared, allowed for, or named as missing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.facts import of_keys, texts
from sealtwin.core.records import Floats, Profile
from validate.readings.read_readings import grid_of_rows, readings_of
from validate.settings import OF_THE_READINGS, Readings, Uncertainty
from validate.uncertainty.budget import Budget, Component, Curve, half_width
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.reading_errors import budget_of, resolution_of

S_MM = np.linspace(0, 80, 17)
MOUTH = Mouth(S_MM, np.full(17, 3.1), 1690.0)
NO_PASSES = Uncertainty(pass_mm=0.0)
ERROR = Curve.of(S_MM, np.ones(17), S_MM)


def readings(**settings) -> Readings:
    return Readings(file=Path("sheet.csv"), data="measured", role="held-out", **settings)


def measured(repeats_mm) -> Profile:
    repeats_mm = np.array(repeats_mm, dtype=float)
    return Profile(S_MM, np.nanmean(repeats_mm, axis=1), repeats_mm)


def noise_mm(deviation_mm: float, repeats: int = 3) -> Floats:
    return deviation_mm * np.random.default_rng(2).standard_normal((17, repeats))


def scattered(deviation_mm: float, repeats: int = 3) -> Profile:
    return measured(noise_mm(deviation_mm, repeats))


def budget(profile: Profile, declared: Uncertainty | None = None, **settings) -> Budget:
    return budget_of(profile, readings(**settings), declared or Uncertainty(), MOUTH)


def part(budget: Budget, begins: str) -> Component:
    (one,) = [component for component in budget.components if component.name.startswith(begins)]
    return one


def bias_mm(budget: Budget) -> float:
    return budget.mean_mm(ERROR.weights())


def test_the_budget_includes_a_difference_between_passes_unless_declared_absent():
    """Three passes do not exclude 0.2 mm: the bias is at least 1.5 times as uncertain as by scatter alone."""
    profile = scattered(0.15)
    allowed, none = budget(profile), budget(profile, NO_PASSES)
    assert part(allowed, "passes").source == "allowed for"
    assert bias_mm(allowed) > 1.5 * bias_mm(none)
    (note,) = texts(allowed.summary(ERROR).notes)
    assert "times narrower" in note
    assert none.summary(ERROR).notes == ()


def test_the_resolution_of_coarse_readings_is_detected():
    """All readings may have an offset, as of a datum. Hundredths, or a few levels, show no resolution."""
    for step_mm, above_mm in ((0.5, 0.37), (25.4 / 64, 0.0), (0.05, 1.23)):
        level_mm = above_mm + np.round(np.linspace(-16, 1, 17) / step_mm) * step_mm
        assert resolution_of(level_mm[:, None] + step_mm * np.array([0, 1, 0])) == pytest.approx(step_mm)
    assert resolution_of(np.round(np.random.default_rng(0).normal(-4, 2, (17, 3)), 2)) == 0.0
    assert resolution_of(np.array([[-1.0, -1.5], [-2.0, -2.0]])) == 0.0


def test_a_resolution_coarser_than_the_scatter_determines_the_error():
    """Repeats that agree in steps of 0.5 mm once counted as free of scatter, with a band of 0.02 mm."""
    level_mm = np.round(np.linspace(-16, 1, 17) * 2) / 2
    whole = budget(measured(np.tile(level_mm[:, None], 3)), NO_PASSES)
    last_digit = part(whole, "last digit, 0.5 mm")
    assert last_digit.source == "detected"
    # Equal repeats share the error of rounding, so three of them do not reduce it.
    assert last_digit.draws_mm.std() == pytest.approx(0.5 / np.sqrt(12), rel=0.05)
    assert 0.2 < np.median(whole.band_mm) < 0.35


def test_a_last_digit_and_a_limit_are_declared_only_if_they_were_given():
    profile = measured(np.round(noise_mm(0.1), 2))
    for given, source in (({}, "assumed"), ({"resolution_mm": 0.01, "limit_mm": 0.03}, "declared")):
        sources = {one.setting: one.source for one in budget(profile, **given).components}
        assert sources["readings.resolution_mm"] == sources["readings.limit_mm"] == source


def test_undeclared_errors_are_named_with_their_expected_effect():
    profile = scattered(0.1)
    of_readings = {"datum_error_mm": 0.05, "probe_mm": 0.5, "rounding": "nearest", "limit_mm": 0.02}
    others = dict.fromkeys((*OF_THE_READINGS, "surface_tension_n_m"), 0.1)
    names = {one.setting.partition(".")[2] for one in budget(profile).missing}
    assert names == {*of_readings, *others}
    written = Readings.model_validate_json(readings().model_dump_json(exclude_none=True))  # As in a run's trial.toml
    assert len(budget_of(profile, written, Uncertainty(), MOUTH).missing) == len(names)
    assert {"operator_mm", "datum_tilt_mm", "sinks_mm"} < names
    assert budget(profile, Uncertainty(**others), **of_readings).missing == ()
    whole = budget(profile).summary(ERROR)
    (datum,) = [one for one in whole.missing if one.setting == "readings.datum_error_mm"]
    assert datum.mean_level_mm == pytest.approx(0.98 * 0.2, rel=1e-3)
    # Assumed are a gauge 2 % off at depths of 10 mm, a bowed face, and a tip of usual width.
    deep = budget(replace(profile, level_mm=profile.level_mm - 10)).summary(ERROR).missing
    assert [one.mean_level_mm for one in deep if one.setting == "readings.limit_mm"] == pytest.approx([0.196], rel=0.01)
    assert "tilted datum or bowed face" in {one.name for one in deep}
    assert any("a probe of 2 mm" in one.name for one in deep)


@pytest.mark.parametrize(
    ("key", "lowest_mm", "highest_mm", "of_the_mean_mm"),
    [
        ("operator_mm", -1.96, 1.96, 1.96),
        ("sinks_mm", -1.96, 0.0, 1.96),
        # An end is right in half of the draws: its 2.5 % are 5 % of the others. The mean is off by half the tilt.
        ("datum_tilt_mm", -1.645, 1.645, 0.98),
    ],
)
def test_an_error_that_repeats_cannot_show_has_its_declared_size_and_sign(key, lowest_mm, highest_mm, of_the_mean_mm):
    """Each error is declared as 1 mm. Given are quantiles of 2.5 % at the worst station, and of the mean of all."""
    whole, none = (budget(scattered(0.1), Uncertainty.model_validate({key: mm})) for mm in (1.0, 0.0))
    (error,) = [component for component in whole.components if component.setting == f"uncertainty.{key}"]
    draws_mm = error.draws_mm[:, -1]
    assert error.shared
    if key == "sinks_mm":
        assert (draws_mm.max(), np.quantile(draws_mm, 0.05)) == pytest.approx((highest_mm, lowest_mm), abs=0.02)
    else:
        assert np.quantile(draws_mm, (0.025, 0.975)) == pytest.approx((lowest_mm, highest_mm), abs=0.08)
    assert half_width(error.draws_mm.mean(axis=1)) == pytest.approx(of_the_mean_mm, abs=0.05)
    assert none.band_mm == pytest.approx(budget(scattered(0.1)).band_mm), "0 declares that there is none"


@pytest.mark.parametrize(
    ("quantity", "rounding", "shifts_mm"),
    [
        ("level", "down", (-0.25, -0.25)),
        ("level", "toward_zero", (0.25, -0.25)),
        ("depth", "toward_zero", (0.25, -0.25)),
        ("level", "nearest", None),
    ],
)
def test_rounding_to_one_side_shifts_all_readings_by_half_a_step(quantity, rounding, shifts_mm):
    """The level rises from -8 to 8 mm, in halves: its first and last station are on either side of the datum."""
    numbers = np.arange(-8.0, 9.0) * (1 if quantity == "level" else -1)
    table = np.column_stack([S_MM, numbers, numbers + 0.5, numbers]).tolist()
    head = ["s_mm", *(f"{quantity}_{k}_mm" for k in (1, 2, 3))]
    settings = readings(quantity=quantity, rounding=rounding)
    profile = readings_of(grid_of_rows("rows", [head, *table]), settings)
    whole = budget_of(profile, settings, Uncertainty(), MOUTH)
    shifts = [error.draws_mm[:, [0, -1]] for error in whole.components if error.setting == "readings.rounding"]
    assert "readings.rounding" not in {error.setting for error in whole.missing}
    assert len(of_keys(whole.notes, "readings.rounded")) == len(shifts) == (shifts_mm is not None)
    if shifts_mm is not None:
        assert np.unique(shifts[0], axis=0)[0] == pytest.approx(shifts_mm)


def test_a_possible_step_between_few_stations_widens_the_interval():
    """Five stations have a rise of 8 mm in one of four gaps: 3/4 of the crack are uncertain by 8/8 mm.

    Twelve stations show such a bed, and five stations on a line have no step.
    """

    def budget_at(s_mm: Floats, level_mm: Floats) -> Budget:
        repeats_mm = level_mm[:, None] + 0.1 * np.random.default_rng(3).standard_normal((len(s_mm), 3))
        return budget_of(Profile(s_mm, level_mm, repeats_mm), readings(), Uncertainty(), MOUTH)

    few_mm, many_mm = np.linspace(0, 80, 5), np.linspace(0, 80, 12)
    few, many = (budget_at(s_mm, np.where(s_mm > 30, 8.0, 0.0)) for s_mm in (few_mm, many_mm))
    assert (few.steps_mm, budget_at(few_mm, np.arange(5.0)).steps_mm, many.steps_mm) == (0.75, 0.0, 0.0)
    curve = Curve.of(few_mm, np.full(5, 2.0), few_mm)
    wider_mm = np.subtract(few.mean_error_interval(curve), replace(few, steps_mm=0.0).mean_error_interval(curve))
    assert wider_mm == pytest.approx((-0.75, 0.75))
    summary = few.summary(curve)
    assert summary.parts[-1].mean_error_mm == pytest.approx(0.75 / 2)
    assert any("0.75 mm for steps" in text for text in texts(summary.notes))


def test_a_probe_that_is_wider_than_the_crack_gives_a_note():
    mouth = replace(MOUTH, width_mm=np.where(S_MM < 10, 1.9, 3.1))
    whole = budget_of(scattered(0.1), readings(probe_mm=2.0), Uncertainty(), mouth)
    assert any("not narrower than the crack at 2 stations (s = 0, 5 mm)" in text for text in texts(whole.notes))
    assert not of_keys(budget(scattered(0.1), probe_mm=2.0).notes, "readings.probe-touches")


def test_stations_that_were_read_once_have_only_a_declared_scatter():
    once = measured(0.1 * np.random.default_rng(1).standard_normal((17, 1)))
    assert not budget(once).scatter_known
    declared = budget(once, Uncertainty(repeatability_mm=0.12, pass_mm=0.0))
    assert declared.scatter_known
    assert half_width(part(declared, "scatter").draws_mm) == pytest.approx(1.96 * 0.12, rel=1e-3)


def with_outliers(*off_mm: float, repeats: int = 3) -> Floats:
    """Readings of station 5, the first ones of it, that are so far off."""
    far_mm = noise_mm(0.15, repeats)
    far_mm[5, : len(off_mm)] += off_mm
    return far_mm


@pytest.mark.parametrize("off_mm", [3.0, -3.0])
def test_an_outlier_is_named_and_widens_the_band_of_its_station(off_mm):
    """One of 51 readings is off by twenty times the scatter, and the mean of its station by a third of that."""
    far_mm = with_outliers(0.0, off_mm)
    whole, plain = budget(measured(far_mm), NO_PASSES), budget(scattered(0.15), NO_PASSES)
    assert any("At 1 station (s = 25 mm) a reading is more than 6 robust" in text for text in texts(whole.notes))
    assert whole.band_mm[5] > 2 * np.median(whole.band_mm)
    assert plain.notes == ()
    far, sound = (part(each, "scatter").draws_mm for each in (whole, plain))
    assert np.median(far[:, 5]) == pytest.approx(far_mm[5].mean() - far_mm[5, [0, 2]].mean(), abs=0.01)
    assert far[:, 5].std() == pytest.approx(np.sqrt(3 / 2) * np.median(sound.std(axis=0)), rel=0.15)
    rest = np.arange(17) != 5
    assert far[:, rest].std(axis=0) == pytest.approx(sound[:, rest].std(axis=0), rel=0.1)


@pytest.mark.parametrize(("sinks_mm", "error_mm"), [(5.0, 1.0), (20.0, 0.05), (50.0, -3.0)])
def test_an_error_far_larger_than_the_scatter_has_a_finite_interval(sinks_mm, error_mm):
    """The search for the ends of the interval once found no root."""
    sinks, profile = budget(scattered(0.1), Uncertainty(sinks_mm=sinks_mm)), scattered(0.1)
    error = Curve.of(ERROR.x, np.full(len(ERROR.x), error_mm), profile.s_mm)
    low_mm, high_mm = sinks.mean_error_interval(error)
    assert 0.0 <= low_mm < high_mm < 4 * sinks_mm
