"""A sweep: nothing that finished is lost or done twice, whatever is killed; nothing that failed is a number."""

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sealtwin.cli import app
from sealtwin.errors import BusyError, InputError, NumericalError
from sealtwin.progress import Progress
from sealtwin.records import Run
from sealtwin.store import stage_files
from sealtwin.store.folder import holding
from sealtwin.study import bench, workers
from sealtwin.study.ledger import Ledger, profile_path, read_study
from sealtwin.study.study import load_study, plan_runs
from sealtwin.study.sweep import Wish, sweep
from sealtwin.study.workers import Task, bench_of, compute_all, trial_of
from sealtwin.trials.trial import load_trial
from simulate.profile import measure_profile
from simulate.run import inject
from tests.studies import tiny_lab

HERE = Wish(device="cpu", jobs=1, batch=1)


class Narration(Progress):
    def __init__(self):
        self.notes = []

    def note(self, text):
        self.notes.append(text)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """The study file of four tiny runs."""
    return tiny_lab(tmp_path_factory.mktemp("lab"))


@pytest.fixture(scope="module")
def prepared(lab, tmp_path_factory):
    """Its folder, digitised and planned, nothing computed."""
    out = tmp_path_factory.mktemp("prepared") / "out"
    sweep(lab, out, replace(HERE, dry_run=True), Progress())
    return out


@pytest.fixture(scope="module")
def unbroken(prepared, tmp_path_factory):
    """The same, computed in this process from beginning to end."""
    out = tmp_path_factory.mktemp("unbroken") / "out"
    shutil.copytree(prepared, out)
    compute_all(Task(out, "cpu", batch=1, keep_runs=False))
    return out


@pytest.fixture
def fresh(prepared, tmp_path):
    shutil.copytree(prepared, tmp_path / "out")
    return tmp_path / "out"


def _results(out):
    """What a run found, by its number: profile's bytes, and figures but for times."""
    found = {}
    for run in read_study(out):
        assert run.state == "done", run.reason
        figures = json.loads(json.dumps(run.figures))
        for name in ("setup_s", "frames_s"):
            del figures["health"][name]
        found[run.number] = profile_path(out, run.key).read_bytes(), figures
    return found


def _finished(out):
    """When each run was finished that is."""
    return {run.key: run.finished_unix_s for run in read_study(out) if run.state == "done"}


def _start(lab, out):
    command = [sys.executable, "-m", "sealtwin", "sweep", str(lab), "--out", str(out), "--device", "cpu", "--jobs", "2"]
    # A group of its own, as a terminal makes it.
    return subprocess.Popen(
        [*command, "--quiet"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )


def _children(pid):
    """Processes of a sweep."""
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in found if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def _ignores(pid, number):
    (mask,) = re.findall(r"SigIgn:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
    return int(mask, 16) >> (number - 1) & 1


def _kill_until_done(lab, out, kills, seed):
    """Now a worker and now the parent, each at a random moment. Returns what had finished before each."""
    chance = random.Random(seed)
    seen = []
    parent = _start(lab, out)
    for number in range(kills):
        if chance.random() < 0.7:
            _wait_for_a_run(parent, out)
        # A process needs seconds to start, a run takes tenths of one.
        time.sleep(chance.uniform(0, 0.5))
        seen.append(_finished(out))
        if number % 2:
            parent.kill()
            parent.communicate()
            parent = _start(lab, out)
        elif parent.poll() is None and (processes := _children(parent.pid)):
            os.kill(chance.choice(processes), signal.SIGKILL)
    _, errors = parent.communicate(timeout=300)
    assert parent.returncode == 0, errors
    return seen


def _wait_for_a_run(parent, out):
    while parent.poll() is None and all(run.state != "running" for run in read_study(out)):
        time.sleep(0.02)


def _check_killed(lab, out, unbroken, kills, seed):
    seen = _kill_until_done(lab, out, kills, seed)
    assert _results(out) == _results(unbroken)
    last = _finished(out)
    for before in seen:
        assert {key: last[key] for key in before} == before  # nothing that was done was done again
    assert len(list((out / "runs").iterdir())) == len(last)
    assert not list(out.glob("runs/*/.*"))
    # A worker's kill costs one run, the parent's both that were under way.
    assert sum(run.tries for run in read_study(out)) <= len(last) + 1.5 * kills


def test_a_sweep_whose_worker_and_parent_are_killed_ends_as_an_unbroken_one(lab, fresh, unbroken):
    _check_killed(lab, fresh, unbroken, kills=2, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_sweep_killed_ten_times_ends_as_an_unbroken_one(tmp_path, seed):
    lab = tiny_lab(tmp_path / "lab", '[grid]\nseed = [1, 2, 3, 4, 5, 6]\n"fluid.U" = [1.0, 10.0, 100.0, 1000.0]\n')
    for name in ("unbroken", "killed"):
        sweep(lab, tmp_path / name, replace(HERE, dry_run=True), Progress())
    compute_all(Task(tmp_path / "unbroken", "cpu", batch=1, keep_runs=False))
    _check_killed(lab, tmp_path / "killed", tmp_path / "unbroken", kills=10, seed=seed)
    # Some of the ten did hit a process at work.
    assert sum(run.tries for run in read_study(tmp_path / "killed")) > 24


def test_a_finished_sweep_redoes_nothing_and_tells_the_same(lab, unbroken, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(unbroken, out)
    report = sweep(lab, out, HERE, Progress())
    assert report.exit_code == 0
    assert report.content["states"] == {"waiting": 0, "running": 0, "done": 4, "failed": 0}
    assert _finished(out) == _finished(unbroken)
    answer = CliRunner().invoke(app, ["sweep", "status", str(out), "--json"])
    assert answer.exit_code == 0
    told = json.loads(answer.stdout)
    assert told["states"] == report.content["states"]
    best = min(read_study(out), key=lambda run: run.figures["mean_error_mm"] if run.figures else 1e9)
    assert told["best"]["number"] == best.number
    table = (out / "runs.csv").read_text().splitlines()
    assert len(table) == 5
    assert table[0].startswith("number,fluid.U,fluid.D_cm,state,mean_error_mm")


def test_a_result_that_was_lost_or_edited_is_computed_again_and_no_other(lab, unbroken, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(unbroken, out)
    runs = read_study(out)
    profile_path(out, runs[0].key).unlink()
    profile_path(out, runs[3].key).write_text("s_mm,level_mm\n0,0\n")
    sweep(lab, out, replace(HERE, dry_run=True), Progress())
    assert [run.state for run in read_study(out)] == ["waiting", "done", "done", "waiting"]
    compute_all(Task(out, "cpu", batch=1, keep_runs=False))
    assert _results(out) == _results(unbroken)


def test_a_study_that_grows_keeps_what_is_done(unbroken, tmp_path, lab):
    out = tmp_path / "out"
    shutil.copytree(unbroken, out)
    more = tiny_lab(tmp_path / "lab", '[grid]\n"fluid.U" = [1.0, 3.0, 300.0]\n"fluid.D_cm" = [0.3]\n')
    sweep(more, out, replace(HERE, dry_run=True), Progress())
    assert [run.state for run in read_study(out)] == ["waiting", "done", "done"]
    sweep(lab, out, replace(HERE, dry_run=True), Progress())
    assert [run.state for run in read_study(out)] == ["done"] * 4


def test_each_run_of_a_study_is_the_run_that_its_settings_make_alone(tmp_path):
    """Of two radii, so that no run may stand in the walls of another one's particles."""
    lab = tiny_lab(tmp_path, '[grid]\n"solver.radius_mm" = [0.45, 0.5]\n')
    out = tmp_path / "out"
    sweep(lab, out, replace(HERE, dry_run=True), Progress())
    compute_all(Task(out, "cpu", batch=1, keep_runs=False))
    (sample,) = (out / "samples").iterdir()
    solid, outline = stage_files.read_solid(sample), stage_files.read_outline(sample)
    planned = plan_runs(load_study(lab), lab, load_trial(tmp_path / "trial.toml"))
    for run, (trial, fluid) in zip(read_study(out), [(p.trial, p.trial.fluid) for p in planned], strict=True):
        assert fluid is not None
        alone = inject(
            solid,
            outline,
            stage_files.read_trajectory(sample),
            fluid,
            trial.solver,
            trial.nozzle,
            seed=trial.seed,
            device="cpu",
            progress=Progress(),
        )
        stage_files.write_profile(tmp_path, measure_profile(alone, outline, solid))
        assert profile_path(out, run.key).read_bytes() == (tmp_path / "profile.csv").read_bytes()


def test_a_study_replays_its_frames_where_freezing_keeps_few_moving(fresh, monkeypatch):
    """And whoever watches a run gets it frame by frame, with what each took."""
    with Ledger(fresh) as ledger:
        claim = ledger.claim(1)
    assert claim is not None
    at, trial = bench_of(fresh, claim.entries[0]), trial_of(claim.entries[0])
    assert trial.fluid is not None
    assert not bench.ready(at, [trial], "cpu").engine.replays
    replayed = []
    monkeypatch.setattr(
        "simulate.run.follow", lambda injection, _: replayed.append(injection.engine.replays) or injection.advance()
    )
    never = {"fluid": trial.fluid.model_copy(update={"freeze_after_s": "never"})}
    explicit = {"solver": trial.solver.model_copy(update={"viscosity_solve": "explicit"})}
    for changed in ({}, never, explicit):
        bench.seal(at, [trial.model_copy(update=changed)], device="cpu", keep_runs=False, progress=Progress())
    assert replayed == [True, False, False]


def test_runs_in_one_launch_have_the_bits_that_they_have_alone(fresh, unbroken):
    compute_all(Task(fresh, "cpu", batch=2, keep_runs=False))
    alone, together = _results(unbroken), _results(fresh)
    assert {number: profile for number, (profile, _) in together.items()} == {
        number: profile for number, (profile, _) in alone.items()
    }
    for number, (_, figures) in together.items():
        assert figures["mean_error_mm"] == alone[number][1]["mean_error_mm"]
        assert figures["volume_ratio"] == alone[number][1]["volume_ratio"]


def test_explicit_runs_of_a_claim_are_computed_one_by_one(fresh, monkeypatch):
    """Their passes are counted over a whole launch: in company a thin fluid would be slowed in more of them."""
    launches, real = [], bench._seal

    def noted(sample, trials, *rest):
        launches.append(len(trials))
        return real(sample, trials, *rest)

    monkeypatch.setattr(bench, "_seal", noted)
    with Ledger(fresh) as ledger:
        claim = ledger.claim()
    assert claim is not None
    (entry,) = claim.entries
    trial = trial_of(entry)
    explicit = trial.model_copy(update={"solver": trial.solver.model_copy(update={"viscosity_solve": "explicit"})})
    outcomes = bench.seal(bench_of(fresh, entry), [explicit] * 2, device="cpu", keep_runs=False, progress=Progress())
    assert launches == [1, 1]
    assert [type(outcome) for outcome in outcomes] == [bench.Sealing] * 2


def test_a_run_that_fails_is_told_with_its_reason_and_costs_no_other_its_result(lab, fresh, unbroken, monkeypatch):
    """One diverges, one wakes a bug, in one launch with the two others."""
    real = bench._seal

    def stumble(sample, trials, *rest):
        weights = {trial.fluid.U for trial in trials if trial.fluid.D_cm == 0.3}
        if 3.0 in weights:
            raise NumericalError("A position is no number any more. Frame 7.")
        if 300.0 in weights:
            raise ZeroDivisionError("on purpose")
        return real(sample, trials, *rest)

    monkeypatch.setattr(bench, "_seal", stumble)
    compute_all(Task(fresh, "cpu", batch=4, keep_runs=False))
    first, diverged, other, bug = read_study(fresh)
    assert [run.state for run in (first, diverged, other, bug)] == ["done", "failed", "done", "failed"]
    assert (diverged.reason, diverged.trace) == ("A position is no number any more. Frame 7.", None)
    assert "ZeroDivisionError: on purpose. A bug of ours" in (bug.reason or "")
    assert "in stumble" in (bug.trace or "")
    assert diverged.figures is None
    assert bug.figures is None
    expected = _results(unbroken)
    for run in (first, other):
        assert profile_path(fresh, run.key).read_bytes() == expected[run.number][0]

    report = sweep(lab, fresh, HERE, Progress())
    assert report.exit_code == 1  # a bug's code, before that of runs that failed
    assert "failed: run 2 (fluid.U = 3.0, fluid.D_cm = 0.3): A position is no number any more. Frame 7." in report.lines
    monkeypatch.setattr(bench, "_seal", real)
    sweep(lab, fresh, replace(HERE, retry=True, dry_run=True), Progress())
    compute_all(Task(fresh, "cpu", batch=1, keep_runs=False))
    assert _results(fresh) == expected


def test_a_run_with_a_particle_through_a_wall_is_no_number(fresh, monkeypatch):
    from simulate.injection import Injection

    real = Injection.outcomes

    def escaping(self):
        return [replace(outcome, escaped_particles=2) for outcome in real(self) if isinstance(outcome, Run)]

    monkeypatch.setattr(Injection, "outcomes", escaping)
    with Ledger(fresh) as ledger:
        for run in ledger.runs()[1:]:
            ledger.give_up(run.key, "not this one")
    compute_all(Task(fresh, "cpu", batch=1, keep_runs=False))
    first = read_study(fresh)[0]
    assert first.state == "failed"
    assert "2 particles went through a wall" in (first.reason or "")
    assert first.figures is None
    assert not profile_path(fresh, first.key).exists()


def test_a_run_that_costs_three_processes_their_life_is_given_up(lab, fresh, monkeypatch):
    """Memory that runs out: the kernel kills whoever is at it, again and again."""
    monkeypatch.setattr(workers, "work", _die_at_the_second_run)
    report = sweep(lab, fresh, HERE, Progress())
    assert report.exit_code == 6
    runs = read_study(fresh)
    assert [run.number for run in runs if run.state == "failed"] == [2]
    assert "3 processes were killed while they computed it" in (runs[1].reason or "")
    assert runs[1].tries == 3


def _die_at_the_second_run(task):
    with Ledger(task.folder) as ledger:
        while (claim := ledger.claim()) is not None:
            (entry,) = claim.entries
            if entry.number == 2:
                os.kill(os.getpid(), signal.SIGKILL)
            ledger.finish(claim, entry.key, 0.1, {})


def test_a_process_that_hangs_is_ended_and_its_run_computed_by_another(lab, fresh, monkeypatch):
    monkeypatch.setattr(workers, "work", _hang_at_first)
    monkeypatch.setattr(workers, "STALLED_S", 0.5)
    report = sweep(lab, fresh, HERE, Progress())
    assert report.exit_code == 0
    assert [run.tries for run in read_study(fresh)] == [2, 1, 1, 1]


def _hang_at_first(task):
    with Ledger(task.folder) as ledger:
        while (claim := ledger.claim()) is not None:
            (entry,) = claim.entries
            if (entry.number, ledger.runs()[0].tries) == (1, 1):
                time.sleep(600)
            ledger.finish(claim, entry.key, 0.1, {})


def test_another_terminal_sees_how_far_it_is(fresh):
    with Ledger(fresh) as ledger:
        claim = ledger.claim()
        assert claim is not None
        ledger.beat(claim, 30, 57)
        first = claim.entries[0].key
        ledger.finish(claim, first, 2.0, {"mean_error_mm": 1.25})
        second = ledger.claim()
        assert second is not None
        ledger.beat(second, 30, 57)
    answer = CliRunner().invoke(app, ["sweep", "status", str(fresh)])
    lines = answer.stdout.splitlines()
    assert lines[0] == "tiny: 4 runs, 2 waiting, 1 running, 1 done."
    # Runs of equal size: two and 27 of 57 frames are left, at 2 s a run.
    assert lines[1] == "About 5 s left."
    assert "running: run 2 (fluid.U = 3.0, fluid.D_cm = 0.3): frame 30 of 57, process" in lines[2]
    assert "gone" not in lines[2]
    assert lines[3] == "Nearest to the readings: run 1 (fluid.U = 3.0, fluid.D_cm = 0.03), 1.25 mm on average."


def test_another_terminal_sees_that_nobody_works_any_more(fresh):
    """Parent and worker were killed at once, and nobody was left to say so."""
    take = f"from sealtwin.study.ledger import Ledger; from pathlib import Path; Ledger(Path({str(fresh)!r})).claim()"
    subprocess.run([sys.executable, "-c", take], check=True)
    answer = CliRunner().invoke(app, ["sweep", "status", str(fresh)])
    assert "s ago; it is gone: the same command goes on." in answer.stdout


def test_interrupted_it_leaves_no_process_and_no_run_behind(lab, fresh):
    parent = _start(lab, fresh)
    _wait_for_a_run(parent, fresh)
    children = _children(parent.pid)
    # Deaf from their first moment on: else tracebacks of half loaded libraries hide the sentence.
    assert all(_ignores(child, signal.SIGINT) for child in children)
    # Ctrl-C reaches all processes of the group.
    os.killpg(parent.pid, signal.SIGINT)
    _, errors = parent.communicate(timeout=60)
    assert parent.returncode == 130
    assert "interrupted; the same command goes on" in errors
    assert "Traceback" not in errors
    assert not [child for child in children if Path(f"/proc/{child}").exists()]
    assert "running" not in {run.state for run in read_study(fresh)}


def test_what_cannot_be_asked_for_is_a_usage_error_and_what_is_not_there_bad_input(tmp_path, lab):
    def code(*arguments):
        return CliRunner().invoke(app, ["sweep", *arguments]).exit_code

    assert code() == 2
    assert code("--example", str(tmp_path / "mine.toml")) == 0
    assert code("--example", str(tmp_path / "mine.toml")) == 3
    assert code(str(lab), "--example", str(tmp_path / "other.toml")) == 2
    assert code("status") == 2
    assert code(str(lab), str(lab)) == 2
    assert code("status", str(tmp_path)) == 3
    assert code(str(tmp_path / "missing.toml")) == 3


def test_a_cluster_without_dask_is_told_what_to_install(lab, fresh, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'sealtwin\[cluster\]'"):
        sweep(lab, fresh, replace(HERE, dask="tcp://127.0.0.1:8786"), Progress())


def test_a_second_parent_is_refused(lab, fresh):
    with holding(fresh), pytest.raises(BusyError, match="in use by process"):
        sweep(lab, fresh, HERE, Progress())


def test_settings_that_do_not_fit_the_crack_are_refused_before_anything_runs(tmp_path):
    study = tiny_lab(tmp_path, '[grid]\n"solver.radius_mm" = [0.45, 3.0]\n"fluid.U" = [1.0, 2.0]\n')
    with pytest.raises(InputError) as caught:
        sweep(study, tmp_path / "out", HERE, Progress())
    assert "runs 3, 4: solver.radius_mm is 3: fewer than 2 particles fit abreast" in str(caught.value)
    assert read_study(tmp_path / "out") == []


def test_a_sweep_says_first_what_it_will_take_and_dry_runs_leave_it_at_that(lab, tmp_path):
    told = Narration()
    report = sweep(lab, tmp_path / "out", replace(HERE, dry_run=True), told)
    (estimate,) = [note for note in told.notes if note.startswith("tiny: ")]
    assert "4 runs of 170 particles" in estimate
    assert "by a model" in estimate
    assert "GB of memory" in estimate
    assert "on disk" in estimate
    assert report.content["states"]["waiting"] == 4


def test_particles_are_kept_on_request_also_of_runs_that_are_done(lab, unbroken, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(unbroken, out)
    sweep(lab, out, replace(HERE, keep_runs=True, dry_run=True), Progress())
    compute_all(Task(out, "cpu", batch=1, keep_runs=True))
    assert len(list(out.glob("runs/*/particles.csv"))) == 4
    assert _results(out) == _results(unbroken)


def test_folders_of_somebody_else_are_left_alone(lab, tmp_path, fresh):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds files that no sweep wrote \(thesis.txt\)"):
        sweep(lab, tmp_path / "theirs", HERE, Progress())
    other = tiny_lab(tmp_path / "lab")
    other.write_text(other.read_text().replace('name = "tiny"', 'name = "another"'))
    with pytest.raises(InputError, match="holds the study 'tiny'; this is 'another'"):
        sweep(other, fresh, HERE, Progress())


@pytest.mark.slow
def test_a_process_does_not_grow_from_run_to_run(fresh):
    """Twenty runs: what the first ones load stays, what each takes is given back. One brings 1.8 MB.

    The heap itself breathes by 25 MB, so the least of some counts; kept on purpose, twelve runs add 20 MB.
    """
    seen_mb = []
    for _ in range(5):
        with Ledger(fresh) as ledger:
            ledger.put_back(run.key for run in ledger.runs())
        compute_all(Task(fresh, "cpu", batch=1, keep_runs=False))
        seen_mb.append(int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6)
    assert min(seen_mb[3:]) - min(seen_mb[1:3]) < 5
