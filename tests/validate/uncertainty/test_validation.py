"""Conclusions by ASME V&V 20, and their limits."""

from dataclasses import replace

import numpy as np
import pytest

from sealtwin.core.facts import doubt, texts
from sealtwin.core.records import Profile
from tests.support.evidence import make_evidence
from validate.intervals import BudgetPart, StationErrors
from validate.report.report_facts import predicted, prediction_facts
from validate.settings import Uncertainty
from validate.uncertainty.computed import Effect, Spread
from validate.uncertainty.validation import MOUND, BedEnds, level_findings, mean_level_budget, predict

ALL_KNOWN = (0.3, 0.4, 0.0)  # Of readings, numerics and inputs


def stations(error_mm, standard_mm, times: float = 1.5) -> StationErrors:
    """Stations whose common band is ``times`` as wide as that of each."""
    error_mm, standard_mm = np.array(error_mm), np.array(standard_mm)
    return StationErrors(
        s_mm=np.arange(float(len(error_mm))),
        error_mm=error_mm,
        data_mm=standard_mm,
        numerics_mm=None,
        inputs_mm=None,
        validation_mm=standard_mm,
        profile_mm=2 * times * standard_mm,
        by_chance=0.05 * len(error_mm),
    )


NONE_OFF = stations([0.0, 0.0], [0.2, 0.2])


def part(name: str, station_mm: float) -> BudgetPart:
    """An error of the readings with that standard uncertainty at a station."""
    return BudgetPart(name, "", "declared", "readings", mean_level_mm=0, mean_error_mm=0, station_mm=station_mm)


PARTS = [part("last digit", 0.05), part("common shift of the stations", 0.4), part("scatter of the repeats", 0.2)]


@pytest.mark.parametrize(
    ("error_mm", "words"),
    [
        (-0.2, "consistent with the readings (ASME V&V 20: E = -0.20 mm, 2 u_val = 1.00"),
        (1.5, "too high"),
        (-1.5, "too low"),
    ],
)
def test_an_error_is_called_too_high_or_too_low_only_beyond_its_uncertainty(error_mm, words):
    mean = mean_level_budget(error_mm, 0.5, *ALL_KNOWN)
    assert mean.resolved is (abs(error_mm) > 1)
    sentence = level_findings(mean, NONE_OFF, PARTS)[0].text
    assert words in sentence
    assert f"between {error_mm - 1:+.2f} and {error_mm + 1:+.2f} mm" in sentence
    assert ("onsistent" in sentence) is not mean.resolved
    assert sentence.endswith("This does not show that the model is right.") is not mean.resolved


@pytest.mark.parametrize(
    "parts", [(0.1,), (0.1, 0.1), (0.1, None, 0.1), (0.1, 0.1, 0.1, True)], ids=["data", "sizes", "inputs", "waiting"]
)
@pytest.mark.parametrize("error_mm", [0.0, 1.0])
def test_no_conclusion_is_drawn_if_numerical_or_input_errors_are_unknown(parts, error_mm):
    """Errors of numerics or inputs that were not computed must not be attributed to the model."""
    mean = mean_level_budget(error_mm, 0.2, *parts)
    assert mean.resolved is None
    sentences = texts(level_findings(mean, stations([1.0, -1.0], [0.2, 0.2]), PARTS))
    assert sentences[0].startswith("ASME V&V 20 is not assessed")
    assert ("--uncertainty" in sentences[0]) is (parts != (0.1, 0.1))  # Then no run is missing: no input is declared
    for word in ("onsistent", "model", "u_val", "E ="):
        assert word not in " ".join(sentences)


def test_half_the_difference_of_two_models_is_the_model_error():
    s_mm, apart_mm = np.linspace(0, 40, 101), np.linspace(-0.5, 1.5, 101)
    level, flat = Profile(s_mm, np.full(101, -4.0)), Profile(s_mm, np.full(101, -3.5))
    volume, declared = Effect("volume_ml", 0.1, np.full(101, 0.1)), Uncertainty(volume_ml=0.1)
    two = Spread(s_mm, None, (volume,), 0.0, 0.5, fast_mm=level.level_mm + apart_mm)
    both = predict(level, two, declared, flat=flat)
    assert both.model_mm == pytest.approx(0.98 * np.abs(apart_mm) / 2, abs=0.01)
    assert both.parts[-1].mean_level_mm == pytest.approx(0.98 * 0.5 / 2, abs=0.01)
    assert "It is -3.50 mm by the fast model and -3.50 mm by a flat level of the dispensed" in predicted(both).text
    alone = predict(level, replace(two, fast_mm=None, unfit=(doubt("unfit.mound", "A mound."),)), declared, flat=flat)
    assert "fast model is unfit for this case: A mound." in " ".join(texts(prediction_facts(alone)))
    assert alone.model_mm is None


def test_only_a_paste_with_a_yield_stress_leaves_a_mound(tmp_path):
    evidence = make_evidence(tmp_path)
    paste = replace(evidence.run, health=evidence.run.health.model_copy(update={"yield_stress_pa": 8.0}))
    ends = BedEnds.of(evidence.trajectory, paste)
    assert ends is not None
    assert ends.mound_mm == pytest.approx(MOUND * 8.0e3 / (1690.0 * 9.81))
    assert (ends.first_mm, ends.last_mm) == pytest.approx((5.0, 35.0), abs=1.5)
    assert BedEnds.of(evidence.trajectory, evidence.run) is None
