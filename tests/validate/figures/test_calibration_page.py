"""The page of a calibration: its results and their limits."""

from dataclasses import replace

import numpy as np
import pytest

from validate.calibration.posterior import BasisReach, Free, ReadLevels
from validate.calibration.summary import Calibrated, Prediction, predicted_by_runs
from validate.figures.calibration_page import calibration_page
from validate.figures.page import write_page

FREES = (Free("fluid.yield_stress_pa", 3.0, 60.0), Free("fluid.viscosity_pa_s", 0.2, 5.0))
S_MM = np.linspace(1, 30, 8)
REACH = BasisReach(0.1, 0.2, True, 5)


def _calibrated(**changes):
    random, flat = np.random.default_rng(0), np.zeros(8)
    draws = np.column_stack([0.4 + 0.05 * random.standard_normal(500), random.random(500)])
    levels = flat - 2, flat + 0.1, flat - 2.1 - 0.02 * S_MM, flat + 0.5
    made = Calibrated(
        name="one",
        emulated=True,
        frees=FREES,
        draws=draws,
        best=np.array([0.4, 0.5]),
        runs=40,
        unused=(),
        reaches=(("one", REACH),),
        least_implausibility=0.3,
        mixing=1.0,
        discrepancy_mm=None,
        run_noise_mm=(0.15,),
        predictions=(Prediction("<i>other</i>", "held out", "synthetic", S_MM, *levels),),
        radius_mm=(0.8,),
        drafts=(0,),
    )
    return replace(made, **changes)


def test_the_page_lists_identified_settings_and_marks_emulated_readings(tmp_path):
    names = write_page(tmp_path / "page.html", calibration_page(_calibrated()))
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "EMULATED" in page
    assert "Identified settings: 1 of 2. Yield stress (Pa): " in page
    assert "Viscosity (Pa s) is not identified" in page
    assert "&lt;i&gt;other&lt;/i&gt;" in page
    assert "<i>other" not in page
    assert {"figures/levels-1.csv", "figures/settings.csv"} <= set(names)
    measured = calibration_page(_calibrated(emulated=False, predictions=(), warned=("40 of 40 runs: a hollow.",)))
    assert measured.cautions == ["40 of 40 runs: a hollow."]
    assert not any("EMULATED" in caution for caution in measured.cautions)


@pytest.mark.parametrize(
    ("drafts", "lead"), [((37, 37), ", with 74 drafts"), ((37, 0), ", with 37 drafts"), ((0, 0), ", for")]
)
def test_the_page_states_the_number_of_drafts_of_all_trials(drafts, lead):
    trials = {"reaches": (("one", REACH), ("own preset", REACH)), "run_noise_mm": (0.15, 0.15), "radius_mm": (0.8, 0.4)}
    assert calibration_page(_calibrated(drafts=drafts, **trials)).lead.startswith(f"40 runs of each trial{lead}")


def test_a_prediction_that_misses_many_readings_gives_a_caution():
    (prediction,) = _calibrated().predictions
    # Stations beyond 20 mm are off by more than the band.
    assert prediction.share_inside == np.mean(np.abs(0.1 + 0.02 * S_MM) <= 0.5)
    narrow = replace(prediction, half_mm=np.full(8, 0.3))
    assert any("does not fit this trial" in text for text in _calibrated(predictions=(narrow,)).cautions)
    same = replace(narrow, role="calibrated")
    assert not any("does not fit this trial" in text for text in _calibrated(predictions=(same,)).cautions)


def test_a_page_without_a_posterior_gives_the_reason_and_no_figures():
    reaches = (("one", BasisReach(0.6, 0.2, False, 10)),)
    impossible = _calibrated(draws=None, predictions=(), reaches=reaches, least_implausibility=1.4)
    sheet = calibration_page(impossible)
    assert "0.6 mm" in sheet.finding
    assert "1.4 times" in sheet.finding
    assert not sheet.key_figures
    assert [part.title for part in sheet.sections] == ["Gates"]


def test_the_95_percent_band_contains_95_percent_of_further_runs():
    """The band of twelve runs is compared with a thirteenth, read with an error, at 4,000 stations; to 1.5 %."""
    random = np.random.default_rng(5)
    levels_mm = 0.3 * random.standard_normal((13, 4000))
    read = ReadLevels(np.arange(4000.0), np.zeros(4000), 0.2**2 * np.eye(4000))
    mean_mm, half_mm = predicted_by_runs(levels_mm[:12], read)
    wider = replace(read, smooth_mm2=0.5**2 * np.eye(len(mean_mm)))
    _, wider_mm = predicted_by_runs(levels_mm[:12], wider)
    assert wider_mm**2 - half_mm**2 == pytest.approx(np.full(len(mean_mm), (2.201 * 0.5) ** 2), rel=1e-3)
    reading_mm = levels_mm[12] + 0.2 * random.standard_normal(4000)
    assert abs(np.mean(np.abs(reading_mm - mean_mm) <= half_mm) - 0.955) < 0.015
