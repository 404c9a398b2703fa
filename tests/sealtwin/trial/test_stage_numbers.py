"""Run folders whose stage numbers differ from those of this version."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.run_folder import open_folder
from sealtwin.study.pipeline import run_stages
from sealtwin.study.uncertainty_runs import vary
from sealtwin.trial import validate_stage
from sealtwin.trial.job import NUMBERS, STAGES, display_path, numbers_up_to, start_job
from sealtwin.trial.trial_file import load_trial
from tests.support.messages import Narration
from tests.support.report_stubs import leave_out_pages
from tests.support.robot_cells import PHOTO_CELL
from tests.support.tiny_study import job_in, tiny_lab


@pytest.fixture(scope="module")
def lab(tmp_path_factory) -> Path:
    return tiny_lab(tmp_path_factory.mktemp("lab")).parent


@pytest.fixture(autouse=True)
def no_pages(monkeypatch):
    leave_out_pages(monkeypatch)


@pytest.fixture(scope="module")
def finished(lab, tmp_path_factory) -> Path:
    """The tiny run with all its stages; no report is drawn."""
    run = tmp_path_factory.mktemp("finished") / "run"
    with pytest.MonkeyPatch.context() as patch:
        leave_out_pages(patch)
        redone_in(run, lab)
    return run


@pytest.fixture
def run(finished, tmp_path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "run"))


def redone_in(run: Path, lab: Path) -> tuple[str, ...]:
    trial = load_trial(lab / "trial.toml")
    with open_folder(run, create=True) as folder:
        return run_stages(start_job(trial, lab, folder, "cpu", Narration()), STAGES).redone


def test_a_raised_stage_number_repeats_the_stage_and_all_later_stages(run, lab, monkeypatch):
    assert redone_in(run, lab) == ()
    monkeypatch.setitem(NUMBERS, "simulate", NUMBERS["simulate"] + 1)
    assert redone_in(run, lab) == ("simulate", "validate")
    assert redone_in(run, lab) == ()
    by = files.read_json(run / "run.json")["computed_by"]
    assert {stage: one["stage_numbers"] for stage, one in by.items()} == {one: numbers_up_to(one) for one in STAGES}


def test_a_run_folder_without_stage_numbers_is_refused(run, lab):
    manifest = files.read_json(run / "manifest.json")
    for entry in manifest["stages"].values():
        del entry["stage_numbers"]
    files.write_json(run / "manifest.json", manifest)
    with pytest.raises(InputError, match=r"manifest\.json: .* another version of sealtwin .*sealtwin run TRIAL"):
        redone_in(run, lab)


def test_a_stage_that_reads_files_of_another_stage_number_gives_a_note(run, monkeypatch):
    """Without its photo the crack is not digitised again, and the level is recorded as one of the old outline."""
    before = dict(NUMBERS)
    monkeypatch.setitem(NUMBERS, "digitise", 999)
    narration = Narration()
    with job_in(run, narration) as job:
        run_stages(job, ("simulate",))
        assert job.folder.numbers_of("simulate") == numbers_up_to("simulate") | {"digitise": before["digitise"]}
    words = f"computed by digitise {before['digitise']}, while this version has digitise 999. "
    words += f"'sealtwin run {display_path(run / 'trial.toml')}'"
    assert any(words in note for note in narration.notes)


@pytest.mark.parametrize(
    ("words", "raised"),
    [
        ("validate RUN --device cpu", "simulate"),
        ("robot RUN --cell CELL --format csv", "digitise"),
        ("export RUN --format mask --out OUT", "digitise"),
    ],
)
def test_every_command_states_once_that_another_version_computed_the_run(run, tmp_path, monkeypatch, words, raised):
    """Only the narration, which --quiet hides, once named the version."""
    (tmp_path / "cell.toml").write_text(PHOTO_CELL, encoding="utf-8")
    places = {"RUN": run, "CELL": tmp_path / "cell.toml", "OUT": tmp_path / "out"}
    command = [*(str(places.get(word, word)) for word in words.split()), "--quiet"]
    own = NUMBERS[raised]
    for number, times in ((own, 0), (999, 1)):
        monkeypatch.setitem(NUMBERS, raised, number)
        answers = [CliRunner().invoke(app, [*command, *more]) for more in ([], ["--json"])]
        assert [answer.exit_code for answer in answers] == [0, 0], answers[0].stderr
        sentence = (
            f"{display_path(run)}: computed by {raised} {own}, while this version has {raised} 999. "
            f"'sealtwin run {display_path(run / 'trial.toml')}'"
        )
        assert answers[0].stdout.count(sentence) == times
        others = json.loads(answers[1].stdout)["other_versions"]
        assert [other.startswith(sentence) for other in others] == [True] * times


def test_extra_runs_by_another_solver_than_the_level_are_refused(run, monkeypatch):
    """Their differences from the level would be taken for the scatter of one solver."""
    own = NUMBERS["simulate"]
    monkeypatch.setitem(NUMBERS, "simulate", 999)
    with job_in(run) as job, pytest.raises(InputError, match="use a different solver") as fault:
        vary(job)
    assert f"simulate {own}, while this version has simulate 999" in str(fault.value)


def test_stored_extra_runs_of_another_stage_number_are_ignored_with_a_note(run, monkeypatch):
    """The file of the extra runs is complete; only its stage number differs."""
    narration = Narration()
    with job_in(run, narration) as job:
        files.write_json(run / validate_stage.SPREAD, {})
        settings, numbers = validate_stage.varied_settings(job.trial), {**NUMBERS, "simulate": 999}
        job.folder.record(
            validate_stage.UNCERTAINTY, "key", settings, {}, [validate_stage.SPREAD], 1.0, numbers=numbers
        )
        assert validate_stage.read_spread(job) is None
    assert "is not used, since the extra runs were computed by simulate 999, while" in narration.notes[0]
