"""The readings' budget: pooled scatter, declared errors, and cautions on the others."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from sealtwin.core.records import Profile
from validate.settings import Readings, Uncertainty
from validate.uncertainty.readings_budget import bartlett, budget_of

S_MM = np.linspace(0, 80, 17)
MOUTH_MM = np.full(17, 3.1)


def readings(**settings) -> Readings:
    return Readings(file=Path("sheet.csv"), data="measured", role="held-out", **settings)


def measured(repeats_mm) -> Profile:
    repeats_mm = np.array(repeats_mm, dtype=float)
    return Profile(S_MM, np.nanmean(repeats_mm, axis=1), repeats_mm)


def scattered(deviation_mm, repeats: int = 3, seed: int = 1) -> Profile:
    noise = np.random.default_rng(seed).standard_normal((17, repeats))
    return measured(np.asarray(deviation_mm) * noise)


def budget(profile: Profile, declared: Uncertainty | None = None, **settings):
    return budget_of(profile, readings(**settings), declared or Uncertainty(), MOUTH_MM)


def test_seventeen_stations_of_three_have_thirty_four_degrees_of_freedom():
    profile = scattered(0.15)
    found = budget(profile)
    assert profile.repeats_mm is not None
    deviation_mm = np.sqrt(profile.repeats_mm.var(axis=1, ddof=1).mean())
    assert found.pooled
    assert found.freedom == pytest.approx(np.full(17, 34))
    assert found.scatter_mm == pytest.approx(np.full(17, deviation_mm / np.sqrt(3)))


def test_limits_and_digits_are_rectangular():
    """GUM 4.3.7: a limit a either way is a / sqrt(3); a last digit q is half of q either way."""
    parts = {part.name: part for part in budget(scattered(0.15), limit_mm=0.03, resolution_mm=0.1).parts}
    assert parts["limit of error of the caliper"].standard_mm == pytest.approx(np.full(17, 0.03 / np.sqrt(3)))
    assert parts["limit of error of the caliper"].shared
    assert parts["resolution of the caliper"].standard_mm == pytest.approx(np.full(17, 0.1 / np.sqrt(12)))
    assert not parts["resolution of the caliper"].shared


def test_a_probe_reads_the_highest_point_that_it_covers():
    """On a slope of 0.5 a tip of 0.8 mm stands up to 0.2 mm too high; where the bed is level, not at all."""
    level_mm = np.where(S_MM < 40, -20 + 0.5 * S_MM, 0.0)
    found = budget(measured(level_mm[:, None] + [[-0.1, 0.0, 0.1]]), probe_mm=0.8)
    (probe,) = [part for part in found.parts if part.name.startswith("width")]
    assert probe.shared
    assert probe.standard_mm[2] == pytest.approx(0.2 / np.sqrt(3))
    assert probe.standard_mm[-2] == 0.0


def test_a_probe_wider_than_the_mouth_is_said_and_not_guessed():
    mouth_mm = np.where(S_MM < 10, 1.9, 3.1)
    found = budget_of(scattered(0.1), readings(probe_mm=2.0), Uncertainty(), mouth_mm)
    assert any("no narrower than the crack at 2 stations (s = 0, 5 mm)" in text for text in found.cautions)
    assert not any("narrower" in text for text in budget(scattered(0.1), probe_mm=2.0).cautions)


def test_what_is_not_declared_is_said():
    cautions = " ".join(budget(scattered(0.1)).cautions)
    assert "readings.datum_error_mm" in cautions
    assert "readings.probe_mm" in cautions
    declared = budget(scattered(0.1), datum_error_mm=0.05, probe_mm=0.5)
    assert declared.cautions == ()


def test_stations_read_once_have_the_scatter_that_was_declared_or_none():
    once = measured(np.zeros((17, 1)))
    unknown = budget(once)
    assert unknown.scatter_mm is None
    assert any("uncertainty.repeatability_mm" in text for text in unknown.cautions)
    known = budget(once, Uncertainty(repeatability_mm=0.12))
    assert known.scatter_mm == pytest.approx(np.full(17, 0.12))
    assert np.isinf(known.freedom).all()


def test_bartlett_is_scipys():
    groups = np.random.default_rng(2).standard_normal((6, 5))
    ours = bartlett(groups.var(axis=1, ddof=1), np.full(6, 4.0))
    assert ours == pytest.approx(stats.bartlett(*groups).pvalue, rel=1e-12)


def test_scatters_that_differ_are_not_pooled():
    deviation_mm = np.where(np.arange(17)[:, None] < 8, 0.02, 0.5)
    found = budget(scattered(deviation_mm, repeats=5))
    assert not found.pooled
    assert found.bartlett_p is not None
    assert found.bartlett_p < 0.01
    assert found.freedom == pytest.approx(np.full(17, 4))
    assert found.scatter_mm is not None
    assert found.scatter_mm[:8].max() < found.scatter_mm[8:].min()
    assert any("not pooled" in text for text in found.cautions)


def test_repeats_that_agree_to_the_last_digit_raise_no_alarm():
    """Two readings to 0.01 mm with a scatter of 0.02 mm often agree; their variance is not zero.

    One alarm in 100 sheets is meant, and more than five are no chance (p = 0.0005).
    """
    random = np.random.default_rng(5)
    sheets = np.round(random.normal(0, 0.02, (100, 17, 2)), 2)
    found = [budget(measured(sheet)) for sheet in sheets]
    assert sum(not one.pooled for one in found) <= 5


def test_a_missing_repeat_costs_its_station_and_one_degree():
    profile = scattered(0.15)
    assert profile.repeats_mm is not None
    repeats_mm = profile.repeats_mm.copy()
    repeats_mm[4, 1] = np.nan
    found = budget(measured(repeats_mm))
    assert found.scatter_mm is not None
    assert found.freedom[0] == 33
    assert found.scatter_mm[4] == pytest.approx(found.scatter_mm[0] * np.sqrt(3 / 2))


def test_one_station_that_scatters_more_is_less_sure_though_all_are_pooled():
    """Three repeats cannot show Bartlett's test a station that scatters twice as much as sixteen others."""
    repeats_mm = np.tile([-0.1, 0.0, 0.1], (17, 1))
    repeats_mm[5] *= 2
    found = budget(measured(repeats_mm), resolution_mm=0.001)
    assert found.pooled
    assert found.own_mm is not None
    own_mm = np.median(found.own_mm, axis=0)
    assert own_mm[5] > 1.05 * own_mm[0]
    assert found.standard_mm[5] > found.standard_mm[0]


def test_a_declared_scatter_is_each_stations_own():
    known = budget(measured(np.zeros((17, 1))), Uncertainty(repeatability_mm=0.12))
    assert known.own_mm == pytest.approx(np.full((1, 17), 0.12))
    assert budget(measured(np.zeros((17, 1)))).own_mm is None
