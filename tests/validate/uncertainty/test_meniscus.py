"""The meniscus in the budget: its depth, its sign, and its size if it is undeclared."""

from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.records import Profile
from validate.report.report_facts import prediction_facts
from validate.result import PredictedLevel
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import Budget
from validate.uncertainty.computed import Effect, Spread
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.reading_errors import budget_of
from validate.uncertainty.validation import predict

S_MM = np.linspace(0.0, 80.0, 17)
MOUTH = Mouth(S_MM, np.full(17, 3.0), 1690.0)
CAPILLARY_MM = 2.084  # Of water's surface tension: the root of 0.072 / (1690 * 9.81)
SETTING = "uncertainty.surface_tension_n_m"


@pytest.mark.parametrize(
    ("width_mm", "density_kg_m3", "level_mm", "sag_mm"),
    [
        (0.2, 1690.0, -9.0, 0.1 * (1 - np.pi / 4)),  # A half circle in a narrow crack, and without gravity
        (3.0, None, -9.0, 1.5 * (1 - np.pi / 4)),
        (60.0, 1690.0, -9.0, 2 * CAPILLARY_MM**2 / 60.0),
        (3.0, 1690.0, 0.0, 0.0),  # The edges of the mouth pin it, and a heap has none
        (3.0, 1690.0, 1.0, 0.0),
    ],
)
def test_the_depth_of_the_meniscus_equals_its_closed_forms(width_mm, density_kg_m3, level_mm, sag_mm):
    mouth = Mouth(S_MM, np.full(17, width_mm), density_kg_m3)
    assert mouth.sag_mm(S_MM, np.full(17, level_mm)) == pytest.approx(sag_mm, rel=3e-3)


def profile(level_mm: float) -> Profile:
    repeats_mm = level_mm + 0.1 * np.random.default_rng(2).standard_normal((17, 3))
    return Profile(S_MM, repeats_mm.mean(axis=1), repeats_mm)


def read(declared: Uncertainty, level_mm: float = -4.0) -> Budget:
    settings = Readings(file=Path("sheet.csv"), data="measured", role="held-out")
    return budget_of(profile(level_mm), settings, declared, MOUTH)


def predicted(declared: Uncertainty) -> PredictedLevel:
    spread = Spread(S_MM, None, (Effect("volume_ml", 0.1, np.full(17, 0.1)),), 0.0, 0.5)
    return predict(Profile(S_MM, np.full(17, -4.0)), spread, declared, mouth=MOUTH)


def test_a_declared_meniscus_lowers_a_reading_by_zero_to_its_full_depth():
    """The level is near the face, where the menisci of a reading in the middle and of a mean level differ."""
    budget = read(Uncertainty(surface_tension_n_m=0.072), -0.5)
    (part,) = [one for one in budget.components if one.setting == SETTING]
    sag_mm = MOUTH.sag_mm(S_MM, profile(-0.5).level_mm, read=True)
    for share, of_sag in ((0.0, -1.0), (0.5, -0.5), (1.0, 0.0)):
        assert np.quantile(part.draws_mm, share, axis=0) == pytest.approx(of_sag * sag_mm, abs=1e-3)
    assert (part.name, part.source, part.kind, part.shared) == ("meniscus", "declared", "readings", True)


def test_a_declared_meniscus_is_a_model_error_in_a_prediction():
    with_it, without = (predicted(Uncertainty(surface_tension_n_m=tension)) for tension in (0.072, 0.0))
    assert with_it.model_mm == pytest.approx(0.95 * MOUTH.sag_mm(with_it.s_mm, with_it.level_mm) / 2, abs=1e-3)
    assert [(one.name, one.kind, one.setting) for one in with_it.parts[1:]] == [("meniscus", "model", SETTING)]
    assert with_it.missing == without.missing == ()
    assert without.model_mm is None
    assert (with_it.band_95_mm > without.band_95_mm).all()
    assert "the meniscus" in prediction_facts(with_it)[0].text


def test_an_undeclared_meniscus_is_named_with_its_size_but_not_in_the_band():
    """The size is that of water; 0 declares that there is none."""
    name = "meniscus of up to 0.29 mm in the middle"
    budget, prediction = read(Uncertainty()), predicted(Uncertainty())
    for missing in (budget.missing, prediction.missing):
        assert [error.name for error in missing if error.setting == SETTING] == [name]
    assert any(name in fact.text for fact in prediction_facts(prediction))
    none = read(Uncertainty(surface_tension_n_m=0.0))
    assert SETTING not in {error.setting for error in (*none.components, *none.missing)}
    assert budget.band_mm == pytest.approx(none.band_mm)
    assert prediction.model_mm is None
