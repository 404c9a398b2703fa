"""The stages of the reproduction: their studies can be planned, and go on where they were killed."""

import json
import shutil

import pytest

from reports.reproduction import stages as stages_module
from reports.reproduction import studies
from reports.reproduction.extra_claims import DAMPING_CLAIM, SLOT_CLAIM
from reports.reproduction.kept import KEPT, read_kept
from reports.reproduction.stages import (
    SLOT_RUNS,
    SLOTS,
    Part,
    Stage,
    compute,
    done_runs,
    missing_pairs,
    parts,
    slot_path,
)
from reports.reproduction.studies import FEEDING, reproduce
from sealtwin.core.progress import Progress
from sealtwin.core.stage_keys import number_words
from sealtwin.study.study_folder import StudyRun, read_plan
from sealtwin.study.study_map import Mapped
from sealtwin.trial.stage_numbers import NUMBERS, numbers_up_to
from tests.charts import make_chart
from tests.places import ROOT
from tests.studies import tiny_lab
from validate.figures.figure_sheet import FigureSheet

HOME = ROOT / "reports" / "reproduction"


@pytest.fixture
def home(tmp_path):
    """A checkout of the page's sources, without a single run of the pairs."""
    (tmp_path / "home" / "figures").mkdir(parents=True)
    for name in (KEPT, "paper_elements.toml"):
        shutil.copyfile(HOME / name, tmp_path / "home" / name)
    return tmp_path / "home"


@pytest.mark.broad
def test_a_stage_of_all_pairs_is_computed_once(tmp_path, monkeypatch):
    monkeypatch.setattr(stages_module, "cores", lambda: 0)
    part = Part("tiny", "a tiny crack", tiny_lab(tmp_path / "lab"), None, fills=False)
    compute(Stage(part), [part], tmp_path, Progress())
    assert missing_pairs(part, tmp_path) is None
    dates = [run.finished_unix_s for run in read_plan(part.folder(tmp_path)).runs]
    compute(Stage(part), [part], tmp_path, Progress())
    assert [run.finished_unix_s for run in read_plan(part.folder(tmp_path)).runs] == dates
    assert len(done_runs(part.folder(tmp_path))) == 4
    monkeypatch.setitem(NUMBERS, "simulate", 999)
    words = missing_pairs(part, tmp_path)
    assert words is not None
    assert words.startswith("its pairs were computed by simulate ")
    assert done_runs(part.folder(tmp_path)) == [], "what is judged together is of one solver"


def test_a_stage_computed_anew_replaces_its_own_and_the_page_keeps_all_else(home, tmp_path):
    """Times of two straight cracks."""
    work = tmp_path / "work"
    for name, _, _ in SLOT_RUNS:
        slot_path(work, name).parent.mkdir(parents=True, exist_ok=True)
        seconds = {"wide-1": 10.0, "wide-2": 10.0, "wide-3": 10.0, "narrow": 25.0}[name]
        pace = {"processor_s": seconds, "wall_s": seconds, "others_cores": 0.01, "moving": [5], "frame_ms": [1.0]}
        pace["stage_numbers"] = numbers_up_to("simulate")
        slot_path(work, name).write_text(json.dumps(pace), encoding="utf-8")
    before = read_kept(home)
    sentences = reproduce(home, parts(HOME), ["page"], work, Progress())
    after = read_kept(home)
    assert {stage for stage in after if after[stage] != before.get(stage)} == {SLOTS}
    assert after[SLOTS].findings[SLOT_CLAIM.name].ours == "2 times"
    assert after[SLOTS].findings[SLOT_CLAIM.name].judgement == "disagrees"
    assert sentences[0].startswith("walls flared, preset accurate: as kept from ")
    there, here = ((folder / "README.md").read_text(encoding="utf-8").splitlines() for folder in (HOME, home))
    changed = [line for line in here if line not in there]
    assert all("straight cracks" in line or "disagrees" in line for line in changed)
    assert any("(2 times; paper: 9 times)" in line for line in changed)


@pytest.mark.slow
def test_pairs_computed_anew_replace_their_part_alone(home, tmp_path, monkeypatch):
    """Runs whose errors are known stand for the pairs: no checkout holds 132 of them."""
    name = "flare"
    drawn = tmp_path / "mapped" / "figures"
    drawn.mkdir(parents=True)
    for figure in ("heat.svg", "runs.csv"):
        (drawn / figure).write_text(figure, encoding="utf-8")
    (part,) = (each for each in parts(HOME) if each.name == name)
    mapped = Mapped({}, make_chart(), FigureSheet("", "", [], "the nearest", [], []), drawn.parent)
    done = StudyRun(1, "key", {}, {}, "sample", "kin", 1.0, "done", finished_unix_s=1_800_000_000.0)
    monkeypatch.setattr(studies, "missing_pairs", lambda each, _: None if each == part else "none")
    monkeypatch.setattr(studies, "map_study", lambda *_, **__: mapped)
    monkeypatch.setattr(studies, "done_runs", lambda folder: [done] if folder == part.folder(tmp_path) else [])
    before, sentences = read_kept(home), reproduce(home, parts(HOME), ["page"], tmp_path, Progress())
    after = read_kept(home)
    changed = {stage for stage in after if after[stage] != before[stage]}
    assert changed == {name, FEEDING}
    assert after[name].computed == "2027-01-15"
    assert after[name].findings["largest mean error"].ours != before[name].findings["largest mean error"].ours
    assert DAMPING_CLAIM.name not in after[name].findings
    assert "the nearest" in sentences
    assert {path.name for path in (home / "figures").glob(f"{name}-*")} == {f"{name}-runs.csv", f"{name}-heat.svg"}
    page = (home / "README.md").read_text(encoding="utf-8")
    assert f"Computed on 2027-01-15 by {number_words(NUMBERS)}, times on " in page
    assert "by digitise unknown, simulate unknown, validate unknown, times on " in page, "the other part, as kept"
    assert f"{DAMPING_CLAIM.name} (not computed yet" in page


def test_the_page_of_the_repository_is_that_of_what_is_kept(home, tmp_path):
    """An edit of the page by hand, or of a text without a new page, is found; readings are called reconstructed."""
    reproduce(home, parts(HOME), ["page"], tmp_path / "work", Progress())
    for name in ("README.md", "elements.md", "figures/claims.csv", KEPT):
        assert (home / name).read_bytes() == (HOME / name).read_bytes(), name
    for section in (home / "README.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        assert "RECONSTRUCTED" in section or "readings" not in section.lower(), section.splitlines()[0]
