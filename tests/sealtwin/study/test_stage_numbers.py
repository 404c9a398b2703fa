"""Studies and comparisons whose runs have different stage numbers."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from sealtwin.cli.studies import compared_lines, mapped_lines
from sealtwin.core.progress import Progress
from sealtwin.study.pipeline import run_stages
from sealtwin.study.run_comparison import compare_runs
from sealtwin.study.study_folder import read_plan
from sealtwin.study.study_map import map_study
from sealtwin.study.sweep import sweep
from sealtwin.trial.job import NUMBERS, display_path
from tests.support.messages import Narration
from tests.support.tiny_study import HERE, TRIAL, compute_here, job_in, run_tiny, tiny_lab

pytestmark = pytest.mark.usefixtures("without_pictures")
TWO = '[grid]\n"fluid.U" = [3.0, 300.0]\n'


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> Path:
    """The study file of two tiny runs."""
    return tiny_lab(tmp_path_factory.mktemp("lab"), TWO)


@pytest.fixture(scope="module")
def finished(two, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("finished") / "out"
    sweep(two, out, replace(HERE, dry_run=True), Progress())
    compute_here(out)
    return out


@pytest.fixture
def out(finished, tmp_path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "out"))


@pytest.mark.parametrize("raised", ["digitise", "validate"])
def test_a_study_of_an_older_stage_number_is_computed_again_with_one_note(two, out, monkeypatch, raised):
    """All three stages count, since runs of a study compare the readings. Old and new runs are not ranked together."""
    before, own = {run.key for run in read_plan(out).runs}, NUMBERS[raised]
    monkeypatch.setitem(NUMBERS, raised, 999)
    first, second = Narration(), Narration()
    report = sweep(two, out, HERE, first)
    words = f"{out}: 2 finished runs were computed by {raised} {own}, while this version has {raised} 999, so they are "
    assert [note for note in first.notes if "finished runs" in note] == [f"{words}computed again."]
    assert report["states"]["done"] == 2
    assert report["stage_numbers"] == NUMBERS
    assert not before & {run.key for run in read_plan(out).runs}
    sweep(two, out, HERE, second)
    assert not [note for note in second.notes if "finished runs" in note]


@pytest.mark.parametrize(("raised", "times"), [("simulate", 1), ("validate", 0)])
def test_a_map_of_levels_by_another_solver_version_gives_one_note(done, monkeypatch, raised, times):
    """A map compares the readings itself, so that another number of validate gives no note."""
    own = NUMBERS[raised]
    monkeypatch.setitem(NUMBERS, raised, 999)
    mapped = map_study(done, None, None, None, Progress(), fills=False, any_volume=True)
    sentence = f"4 finished runs were computed by {raised} {own}, while this version has {raised} 999."
    assert [sentence in other for other in mapped.content["other_versions"]] == [True] * times
    assert "\n".join(mapped_lines(mapped)).count(sentence) == times


def test_a_comparison_of_runs_lists_stage_numbers_that_differ(tmp_path, monkeypatch):
    """The settings are equal, but two solvers computed the levels."""
    runs = [run_tiny(tmp_path, TRIAL.split("[readings]")[0].replace("substeps = 2", "substeps = 2\nsettle_s = 0.2"))]
    runs.append(tmp_path / "two")
    shutil.copytree(runs[0], runs[1])
    own = dict(NUMBERS)
    monkeypatch.setitem(NUMBERS, "simulate", 999)
    with job_in(runs[1]) as job:
        run_stages(job, ("simulate",))
    content, sheet = compare_runs(runs, tmp_path / "page")
    assert content["differing"] == {"stage_number.simulate": [own["simulate"], 999]}
    (sentence,) = content["other_versions"]
    assert sentence.startswith(
        f"{display_path(runs[0])}: computed by simulate {own['simulate']}, while this version has"
    )
    assert compared_lines(content, sheet).count(sentence) == 1
