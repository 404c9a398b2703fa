"""Which trials of a lab count as earlier ones, and where what they say is told."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from sealtwin.core import files, record_files
from sealtwin.core.errors import present
from sealtwin.core.records import DataKind
from sealtwin.lab.catalogue import RUN, Catalogue
from sealtwin.lab.held_out import earlier_trials, note_use
from sealtwin.trial.stage_numbers import NUMBERS
from sealtwin.trial.trial_file import load_trial
from tests.evidence import make_evidence
from tests.labs import edit, sealtwin
from tests.pages import leave_out_figures, leave_out_pdf
from validate.readings.read_readings import read_readings
from validate.result import COMPARISON, RESULT, ComputedBy, TrialResult
from validate.settings import Role

FINISHED = _, *OTHERS = "P01", "P02", "P05", "P07"
KEEPS_ITS_VOLUME = (
    ("U = 30.0\nD_cm = 0.3", "viscosity_pa_s = 0.5"),
    ("yield_stress_pa = 0.0", "yield_stress_pa = 2.0"),
    ("substeps = 2", "substeps = 3"),
    ("freeze_after_s = 0.2", "freeze_after_s = 1.0"),
    ("volume_ml = 0.08", "volume_ml = 0.16"),
    ("settle_s = 2.0", "settle_s = 0.3"),
)
"""Changes by which the labs' small trials lose no fluid."""


@pytest.fixture(scope="module")
def finished(sound, tmp_path_factory):
    """Lab of ten sound samples, four of which have a run with measured readings, 0.5, 0.7, 0.9 and 1.1 mm too high."""
    lab = shutil.copytree(sound[2], tmp_path_factory.mktemp("earlier") / "lab")
    for number, name in enumerate(FINISHED):
        finish(lab, name, error_mm=0.5 + 0.2 * number)
    return lab


@pytest.fixture
def lab(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "lab")


def finish(lab: Path, name: str, error_mm: float, role: Role = "held-out", data: DataKind = "measured") -> None:
    """Write what counts of a run's files, as its stages write it."""
    run = lab / name / RUN
    shutil.copytree(lab / name / "inputs", run / "inputs", dirs_exist_ok=True)
    shutil.copy(lab / name / "trial.toml", run)
    evidence = make_evidence(run, error_mm=error_mm, readings_data=data, photo_data=data)
    comparison = present(evidence.comparison, "comparison").model_copy(update={"role": role})
    files.write_json(run / COMPARISON, comparison.model_dump())
    health = evidence.run.health.model_copy(update={"volume_ratio": 1.0})
    record_files.write_run(run, replace(evidence.run, health=health))
    by = {"validate": ComputedBy(stage_numbers=NUMBERS)}
    result = TrialResult(name=name, folder="run", wall_time_s=1.0, stages=("validate",), computed_by=by)
    files.write_json(run / RESULT, result.model_copy(update={"comparison": comparison}).model_dump())


def names_of(lab: Path, source: Path | None = None) -> list[str]:
    return [one.name for one in earlier_trials(Catalogue(lab), source)[0]]


def change(path: Path, **values: object) -> None:
    files.write_json(path, files.read_json(path) | values)


def test_a_run_by_another_solver_says_nothing_of_this_ones_error(lab):
    """Its error is another solver's: the trial is left out, with a caution that names its number and the remedy."""
    run = lab / "P01" / RUN / "run.json"
    change(run, computed_by={"validate": {"stage_numbers": {**NUMBERS, "simulate": 999}}})
    trials, cautions = earlier_trials(Catalogue(lab))
    assert [one.name for one in trials] == [*OTHERS]
    (caution,) = cautions
    assert "sample 'P01' is left out" in caution
    assert "computed by simulate 999, while this version has simulate" in caution
    change(run, computed_by={})
    assert "computed by digitise unknown, simulate unknown" in earlier_trials(Catalogue(lab))[1][0]


def test_a_sample_itself_and_what_was_chosen_by_calibrated_or_drawn_say_nothing(lab):
    assert names_of(lab, lab / "P01") == names_of(lab, lab / "P01" / RUN) == [*OTHERS]
    settings = present(load_trial(lab / "P05" / "trial.toml").readings, "readings")
    sheet = lab / "P05" / settings.file
    note_use(sheet, read_readings(sheet, settings), "study 'which U'")
    assert names_of(lab) == ["P01", "P02", "P07"]
    finish(lab, "P01", 0.5, role="calibrated-on")
    finish(lab, "P02", 0.5, data="reconstructed")
    assert names_of(lab) == ["P07"]


@pytest.mark.parametrize(
    ("file", "values"),
    [
        ("run.json", {"edited": ["profile.csv"]}),
        ("simulation.json", {"escaped_particles": 1}),
        ("simulation.json", {"health": {"volume_ratio": 0.9}}),
    ],
)
def test_an_edited_or_unsound_run_says_nothing(lab, file, values):
    change(lab / "P01" / RUN / file, **values)
    assert names_of(lab) == [*OTHERS]


def test_the_same_readings_count_once(lab):
    finish(lab, "P03", 0.5)
    shutil.rmtree(lab / "P03" / RUN / "inputs")
    shutil.copytree(lab / "P01" / "inputs", lab / "P03" / RUN / "inputs")
    shutil.copy(lab / "P01" / "trial.toml", lab / "P03" / RUN)
    assert names_of(lab) == list(FINISHED)


@pytest.mark.parametrize("damage", ["{", '"covered_length_mm": 0.0', '"bias_mm": NaN'])
def test_a_damaged_run_is_named_and_keeps_no_other_one_back(lab, damage):
    path = lab / "P02" / RUN / "comparison.json"
    key = damage.partition(":")[0]
    text = re.sub(rf"{key}: [^,]+", damage, path.read_text(encoding="utf-8")) if ":" in damage else damage
    path.write_text(text, encoding="utf-8")
    trials, cautions = earlier_trials(Catalogue(lab))
    assert [one.name for one in trials] == ["P01", "P05", "P07"]
    assert ["'P02'" in caution for caution in cautions] == [True]


def test_the_list_tells_bias_and_scatter(lab):
    answer = sealtwin("lab", "list", lab, "--json")
    level, *_ = json.loads(answer.stdout)["biases"]
    assert (level["quantity"], level["trials"]) == ("mean_level_mm", 4)
    assert (level["bias"], level["scatter"]) == pytest.approx((0.8, 0.258199), abs=1e-5)
    assert "computed minus read +0.80 mm, scatter 0.26 mm" in sealtwin("lab", "list", lab).stdout


def test_a_new_run_applies_them_and_another_trial_makes_its_report_anew(lab, monkeypatch):
    leave_out_figures(monkeypatch)
    leave_out_pdf(monkeypatch)
    place = lab / "P04"
    for coarse, sound in KEEPS_ITS_VOLUME:
        edit(place / "trial.toml", coarse, sound)
    run = ("run", place / "trial.toml", "--out", place / RUN, "--device", "cpu", "--quiet")
    assert "In 4 earlier trials" in (seen := sealtwin(*run).stdout), seen
    earlier = files.read_json(place / RUN / "earlier_trials.json")
    assert [one["name"] for one in earlier["trials"]] == list(FINISHED)
    level = earlier["expectations"][0]
    assert level["expected"] == pytest.approx(level["computed"] - 0.8, abs=1e-9)
    report = files.read_json(place / RUN / "report.json")
    assert report["earlier_trials"]["expectations"][0]["expected_95"] == level["expected_95"]
    page = (place / RUN / "report.html").read_text(encoding="utf-8")
    assert report["in_short"][-1] in page
    assert "In 4 earlier trials" in page

    finish(lab, "P08", 1.3)
    assert sealtwin(*run).exit_code == 0
    assert len(files.read_json(place / RUN / "earlier_trials.json")["trials"]) == 5
