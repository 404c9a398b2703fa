"""What a study will take, before it starts."""

import gc
from dataclasses import replace

import pytest
import warp as wp

from sealtwin.core.errors import InputError
from sealtwin.study.estimate import Estimate, RunSize, estimate, in_words, require_disk, require_memory, size_of
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.trial_file import load_trial
from simulate.injection import prepare
from simulate.setup.wall_particles import enclose
from tests.fluids import path, slot
from tests.places import FIXTURE


def _run(state, work_s, wall_s=None):
    empty = dict.fromkeys(StudyRun.__dataclass_fields__)
    return replace(StudyRun(**empty), state=state, work_s=work_s, wall_s=wall_s)  # pyright: ignore[reportArgumentType]


def test_runs_that_are_done_correct_the_model():
    """It expected 10 s for them and they took 30: what is left, 8 s by the model, takes 24, on two processes 12."""
    runs = [
        _run("done", 4.0, 12.0),
        _run("done", 6.0, 18.0),
        _run("failed", 5.0, 1.0),
        _run("waiting", 3.0),
        _run("waiting", 5.0),
    ]
    found = estimate(runs, RunSize(1000, 1000, 1.0), jobs=2, batch=1, keep_runs=False)
    assert (found.runs, found.measured) == (2, True)
    assert found.time_s == pytest.approx(12.0)
    assert "by the runs that are done" in found.sentence
    unknown = estimate(runs[2:], RunSize(1000, 1000, 1.0), jobs=2, batch=1, keep_runs=False)
    assert unknown.time_s == pytest.approx(4.0)
    assert "by a model" in unknown.sentence


def test_memory_counts_processes_and_disk_what_is_kept():
    runs = [_run("waiting", 1.0) for _ in range(10)]
    size = RunSize(10_000, 2_000, 1.0)
    one, four = (estimate(runs, size, jobs, 1, keep_runs=False) for jobs in (1, 4))
    assert four.memory_bytes == pytest.approx(4 * one.memory_bytes)
    # More processes than runs are not started.
    assert estimate(runs, size, 40, 1, keep_runs=False).memory_bytes == pytest.approx(10 * one.memory_bytes)
    kept = estimate(runs, size, 1, 1, keep_runs=True)
    # particles.csv of the paper's run: 14,527 lines in 1.1 MB.
    assert kept.disk_bytes - one.disk_bytes == pytest.approx(10 * 10_000 * 75)


@pytest.mark.parametrize("freeze_after_s", [2.58, "never"])
@pytest.mark.parametrize("runs", [1, 3])
def test_what_a_launch_takes_of_memory_is_what_its_arrays_take(runs, freeze_after_s):
    """The paper's crack and sealant at R = 0.6 mm: 2.2 MB a run where paste freezes by age, 7.8 where it never does.

    Within 15 %: cells are counted to the particles, and differ with the room around the crack.
    """
    solid, outline = slot(80.0)
    trial = load_trial(FIXTURE / "trial.toml")
    assert trial.fluid is not None
    trial = trial.model_copy(
        update={
            "fluid": trial.fluid.model_copy(update={"freeze_after_s": freeze_after_s}),
            "solver": trial.solver.model_copy(update={"radius_mm": 0.6, "settle_s": 0.5}),
        }
    )
    trajectory = path(outline, 4.8, trim_mm=10.0)
    enclosure = enclose(solid, outline, 0.6, "cpu")
    before = _arrays()
    injection = prepare(
        solid,
        outline,
        trajectory,
        [trial.fluid] * runs,
        trial.solver,
        trial.nozzle,
        seed=0,
        device="cpu",
        enclosure=enclosure,
    )
    taken = sum(array.capacity for number, array in _arrays().items() if number not in before)
    size = size_of(trial, trajectory, outline.mean_width_mm)
    assert size.particles * runs == injection.engine.state.count
    assert size.moving * runs == len(injection.engine.lists.fluid_count)
    assert runs * size.bytes == pytest.approx(taken, rel=0.15)


def _arrays() -> dict[int, wp.array]:
    """All that hold memory of their own; views of others have none."""
    gc.collect()
    return {id(thing): thing for thing in gc.get_objects() if type(thing) is wp.array and thing.capacity}


def test_a_disk_that_is_too_small_is_told_before_the_first_run():
    wanted = Estimate(runs=1, time_s=1.0, measured=False, memory_bytes=1.0, disk_bytes=5e6)
    require_disk(wanted, 6e6, "out")
    with pytest.raises(InputError, match="out: 4 MB are free there, the results need 5 MB"):
        require_disk(wanted, 4e6, "out")


def test_a_launch_that_a_gpu_cannot_hold_is_told_before_the_first_run():
    size, runs = RunSize(14_527, 14_527, 1.0), [_run("waiting", 1.0) for _ in range(132)]
    wanted = estimate(runs, size, jobs=1, batch=132, keep_runs=False)
    # As many as there are, and not as there may be.
    assert wanted == estimate(runs, size, jobs=1, batch=256, keep_runs=False)
    # 26 MB each, and what one process needs beside them.
    assert wanted.memory_bytes == pytest.approx(132 * 26.3e6, rel=0.2)
    require_memory(wanted, 8e9, "cuda:0", 132)
    with pytest.raises(InputError, match=r"--batch 132: .* need 4\.\d GB, 2\.0 GB are free on cuda:0"):
        require_memory(wanted, 2e9, "cuda:0", 132)


@pytest.mark.parametrize(("time_s", "words"), [(7.4, "7 s"), (119, "119 s"), (700, "12 min"), (9000, "2.5 h")])
def test_times_are_said_as_people_say_them(time_s, words):
    assert in_words(time_s) == words
