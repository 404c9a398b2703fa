"""Studies whose runs have different stage numbers."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from sealtwin.cli.studies import mapped_lines
from sealtwin.core.progress import Progress
from sealtwin.study.study_folder import read_plan
from sealtwin.study.study_map import map_study
from sealtwin.study.sweep import sweep
from sealtwin.trial.job import NUMBERS
from tests.support.messages import Narration
from tests.support.tiny_study import HERE, compute_here, tiny_lab

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
