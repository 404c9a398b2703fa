"""The stages of the reproduction: their studies can be planned, and go on where they were killed."""

import json
import shutil
from pathlib import Path

import pytest

from reports.reproduction import stages as stages_module
from reports.reproduction import studies
from reports.reproduction.derived import (
    DAMPED,
    FROZEN,
    KINDS,
    SEEDED,
    TIMED,
    seeded_rows,
    straight_crack,
    study_text,
    write_study,
)
from reports.reproduction.extra_claims import DAMPING_CLAIM, SLOT_CLAIM
from reports.reproduction.kept import KEPT, read_kept
from reports.reproduction.pace import is_current, read_pace, take_pace
from reports.reproduction.scatter import SEEDS, deciding_pairs
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
    stages,
)
from reports.reproduction.studies import FEEDING, reproduce
from sealtwin.core import record_files
from sealtwin.core.progress import Progress
from sealtwin.core.stage_keys import number_words
from sealtwin.study.study_file import load_study, plan_runs
from sealtwin.study.study_folder import StudyRun, read_plan
from sealtwin.study.study_map import Mapped
from sealtwin.study.sweep import SweepOptions, sweep
from sealtwin.trial.stage_numbers import NUMBERS, numbers_up_to
from sealtwin.trial.trial_file import load_trial
from tests.charts import make_chart
from tests.places import FIXTURE, ROOT
from tests.studies import tiny_lab
from validate.figures.figure_sheet import FigureSheet

HOME = ROOT / "reports" / "reproduction"


def test_both_readings_of_the_tilt_get_the_same_132_pairs():
    flare, lean = (load_study(part.study) for part in parts(HOME))
    assert flare.grid == lean.grid
    assert flare.runs == lean.runs == 132


def test_times_come_last_and_the_pairs_before_what_follows_from_them():
    names = [stage.name for stage in stages(parts(HOME))]
    assert names[:4] == ["flare", "flare-seeds", "flare-damping", "flare-freezing"]
    assert names[-3:] == ["flare-times", "lean-times", SLOTS]
    assert len(names) == len(set(names)) == 2 * (1 + len(KINDS)) + 1


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_only_times_are_computed_without_the_pairs(tmp_path, monkeypatch, kind):
    computed = []
    monkeypatch.setattr(stages_module, "_compute_small", lambda part, kind, *_: computed.append(kind))
    said = compute(Stage(parts(HOME)[0], kind), parts(HOME), tmp_path, Progress())
    assert computed == ([TIMED] if kind is TIMED else [])
    assert [f"flare-{kind.name}" in line for line in said] == ([] if kind is TIMED else [True])


@pytest.mark.parametrize("part", parts(HOME), ids=lambda part: part.name)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_small_study_can_be_planned_and_differs_from_all_pairs_in_its_columns_alone(tmp_path, part, kind):
    grid, chart = load_study(part.study), make_chart()
    rows = seeded_rows(chart) if kind.rows is None else kind.rows
    write_study(tmp_path / "small.toml", grid, part.study.parent, kind, rows)
    study = load_study(tmp_path / "small.toml")
    base = (part.study.parent / grid.trial).resolve()
    assert study.trial == base
    planned = plan_runs(study, tmp_path / "small.toml", load_trial(base))
    wanted = {SEEDED: len(deciding_pairs(chart)) * len(SEEDS), DAMPED: 15, FROZEN: 15, TIMED: 18}
    assert len(planned) == wanted[kind]
    (twin,) = plan_runs(
        load_study(_of_one(tmp_path, grid.fixed, base, planned[0].settings)), tmp_path, load_trial(base)
    )
    assert planned[0].trial == twin.trial
    assert set(study.fixed) == set(grid.fixed) - set(kind.columns)


def _of_one(folder: Path, fixed: dict, trial: Path, settings: dict) -> Path:
    path = folder / "one.toml"
    without = {name: value for name, value in fixed.items() if name not in settings}
    path.write_text(study_text("one", trial, without, list(settings), [tuple(settings.values())]), "utf-8")
    return path


def test_a_pace_is_taken_once_and_in_the_run_itself(tmp_path, monkeypatch):
    folder = tmp_path / "sweep"
    sweep(tiny_lab(tmp_path / "lab"), folder, SweepOptions(device="cpu", jobs=0, dry_run=True), Progress())
    run = read_plan(folder).runs[0]
    bench, path = record_files.read_sample(folder / "samples" / run.sample), tmp_path / "pace.json"
    take_pace(path, bench, run.checked_trial)
    pace = read_pace(path)
    assert len(pace.moving) == len(pace.frame_ms) > 10
    assert pace.moving.max() > 0
    # The frames are the run, but for what is done between them.
    assert 0.5 * pace.processor_s < pace.frame_ms.sum() / 1000 < 1.1 * pace.processor_s
    assert pace.others_cores >= 0
    monkeypatch.setattr("reports.reproduction.pace.follow", None)
    take_pace(path, bench, run.checked_trial)
    assert is_current(path)
    with monkeypatch.context() as patch:
        patch.setitem(NUMBERS, "simulate", 999)
        assert not is_current(path)
    with pytest.raises(TypeError):  # Another trial's is taken anew
        take_pace(path, bench, run.checked_trial.model_copy(update={"seed": 1}))


def test_a_crack_a_third_as_wide_has_nine_times_the_particles():
    """A third of the sealant, particles of a 27th."""
    from sealtwin.study.estimate import size_of

    trial = load_trial(FIXTURE / "trial-paper.toml")
    (wide, of_wide), (narrow, of_narrow) = (straight_crack(trial, narrower) for narrower in (1, 3))
    sizes = [size_of(of, at) for of, at in ((of_wide, wide), (of_narrow, narrow))]
    assert sizes[1].particles / sizes[0].particles == pytest.approx(9, rel=0.01)
    assert wide.outline.mean_width_mm / narrow.outline.mean_width_mm == pytest.approx(3)
    assert wide.outline.length_mm == pytest.approx(narrow.outline.length_mm)


def test_what_needs_all_pairs_is_left_out_until_they_are_there(tmp_path):
    study = tiny_lab(tmp_path / "lab")
    part = Part("tiny", "a tiny crack", study, None, fills=False)
    told = "0 of its 4 pairs are computed"
    assert missing_pairs(part, tmp_path) == told
    assert compute(Stage(part, SEEDED), [part], tmp_path, Progress()) == [f"tiny-seeds: left out, since {told}."]
    assert not list(tmp_path.glob("tiny*"))


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


def test_without_any_run_the_table_of_elements_is_written_and_the_page_left(tmp_path):
    (tmp_path / "paper_elements.toml").write_bytes((HOME / "paper_elements.toml").read_bytes())
    said = reproduce(tmp_path, parts(HOME), ["page"], tmp_path / "work", Progress())
    assert said == [
        "walls flared, preset accurate: not on the page, since 0 of its 132 pairs are computed.",
        "walls leaning, preset paper: not on the page, since 0 of its 132 pairs are computed.",
    ]
    assert (tmp_path / "elements.md").read_bytes() == (HOME / "elements.md").read_bytes()
    assert not (tmp_path / "README.md").exists()
    assert not (tmp_path / KEPT).exists()


def test_a_stage_computed_anew_replaces_its_own_and_the_page_keeps_all_else(tmp_path):
    """Times of two straight cracks, in a checkout without a single run of the pairs."""
    home, work = tmp_path / "home", tmp_path / "work"
    (home / "figures").mkdir(parents=True)
    for name in (KEPT, "paper_elements.toml"):
        shutil.copyfile(HOME / name, home / name)
    for name, _, _ in SLOT_RUNS:
        slot_path(work, name).parent.mkdir(parents=True, exist_ok=True)
        seconds = {"wide-1": 10.0, "wide-2": 10.0, "wide-3": 10.0, "narrow": 25.0}[name]
        pace = {"processor_s": seconds, "wall_s": seconds, "others_cores": 0.01, "moving": [5], "frame_ms": [1.0]}
        pace["stage_numbers"] = numbers_up_to("simulate")
        slot_path(work, name).write_text(json.dumps(pace), encoding="utf-8")
    before = read_kept(home)
    said = reproduce(home, parts(HOME), ["page"], work, Progress())
    after = read_kept(home)
    assert {stage for stage in after if after[stage] != before.get(stage)} == {SLOTS}
    assert after[SLOTS].findings[SLOT_CLAIM.name].ours == "2 times"
    assert after[SLOTS].findings[SLOT_CLAIM.name].judgement == "disagrees"
    assert said[0].startswith("walls flared, preset accurate: as kept from ")
    there, here = ((folder / "README.md").read_text(encoding="utf-8").splitlines() for folder in (HOME, home))
    changed = [line for line in here if line not in there]
    assert all("straight cracks" in line or "disagrees" in line for line in changed)
    assert any("(2 times; paper: 9 times)" in line for line in changed)


@pytest.mark.parametrize("name", ["flare", "lean"])
def test_pairs_computed_anew_replace_their_part_alone(tmp_path, monkeypatch, name):
    """Runs whose errors are known stand for the pairs: no checkout holds 132 of them."""
    home, drawn = tmp_path / "home", tmp_path / "mapped" / "figures"
    for folder in (home, drawn):
        folder.mkdir(parents=True)
    for kept in (KEPT, "paper_elements.toml"):
        shutil.copyfile(HOME / kept, home / kept)
    for figure in ("heat.svg", "runs.csv"):
        (drawn / figure).write_text(figure, encoding="utf-8")
    (part,) = (each for each in parts(HOME) if each.name == name)
    mapped = Mapped({}, make_chart(), FigureSheet("", "", [], "the nearest", [], []), drawn.parent)
    done = StudyRun(1, "key", {}, {}, "sample", "kin", 1.0, "done", finished_unix_s=1_800_000_000.0)
    monkeypatch.setattr(studies, "missing_pairs", lambda each, _: None if each == part else "none")
    monkeypatch.setattr(studies, "map_study", lambda *_, **__: mapped)
    monkeypatch.setattr(studies, "done_runs", lambda folder: [done] if folder == part.folder(tmp_path) else [])
    before, said = read_kept(home), reproduce(home, parts(HOME), ["page"], tmp_path, Progress())
    after = read_kept(home)
    changed = {stage for stage in after if after[stage] != before[stage]}
    assert changed == ({name, FEEDING} if name == "flare" else {name})
    assert after[name].computed == "2027-01-15"
    assert after[name].findings["largest mean error"].ours != before[name].findings["largest mean error"].ours
    assert DAMPING_CLAIM.name not in after[name].findings
    assert "the nearest" in said
    assert {path.name for path in (home / "figures").glob(f"{name}-*")} == {f"{name}-runs.csv", f"{name}-heat.svg"}
    page = (home / "README.md").read_text(encoding="utf-8")
    assert f"Computed on 2027-01-15 by {number_words(NUMBERS)}, times on " in page
    assert "by digitise unknown, simulate unknown, validate unknown, times on " in page, "the other part, as kept"
    assert f"{DAMPING_CLAIM.name} (not computed yet" in page


def test_the_page_of_the_repository_is_that_of_what_is_kept(tmp_path):
    """An edit of the page by hand, or of a text without a new page, is found."""
    home = tmp_path / "home"
    (home / "figures").mkdir(parents=True)
    for name in (KEPT, "paper_elements.toml"):
        shutil.copyfile(HOME / name, home / name)
    reproduce(home, parts(HOME), ["page"], tmp_path / "work", Progress())
    for name in ("README.md", "elements.md", "figures/claims.csv", KEPT):
        assert (home / name).read_bytes() == (HOME / name).read_bytes(), name
