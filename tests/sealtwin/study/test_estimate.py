"""Estimates of the time and memory of a study."""

import gc
from dataclasses import replace

import pytest
import warp as wp

from sealtwin.core.errors import InputError
from sealtwin.core.records import Sample
from sealtwin.study.estimate import RunSize, checked_size, require_memory, time_left_s
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.trial_file import load_trial
from simulate.injection import enclosure_of, prepare
from tests.support.paths import FIXTURE
from tests.support.small_fluids import path, slot


def _run(state, work_s, wall_s=None):
    empty = dict.fromkeys(StudyRun.__dataclass_fields__)
    return replace(StudyRun(**empty), state=state, work_s=work_s, wall_s=wall_s)


def test_finished_runs_correct_the_estimated_time_of_a_study():
    """Runs of an estimated 10 s took 30 s, so that the waiting 8 s take 24 s, by two processes 12 s."""
    runs = [_run("done", 4.0, 12.0), _run("done", 6.0, 18.0), _run("failed", 5.0, 1.0)]
    runs += [_run("waiting", 3.0), _run("waiting", 5.0)]
    assert time_left_s(runs, jobs=2) == pytest.approx(12.0)
    assert time_left_s(runs, jobs=2, elapsed_s=(3.0, 1.0)) == pytest.approx(10.0)
    assert time_left_s(runs[2:], jobs=2) == pytest.approx(4.0)


@pytest.mark.parametrize(("freeze_after_s", "runs"), [pytest.param(2.58, 1, marks=pytest.mark.slow), ("never", 2)])
def test_the_estimated_memory_of_a_launch_equals_the_memory_of_its_arrays(runs, freeze_after_s):
    """The case is half of the paper's crack and sealant at R = 0.6 mm.

    The tolerance is 15 %, since the number of cells depends on the room around the crack.
    """
    solid, outline = slot(40.0)
    trial = load_trial(FIXTURE / "trial.toml")
    assert trial.fluid is not None
    fluid = trial.fluid.model_copy(update={"freeze_after_s": freeze_after_s, "yield_stress_pa": 12.0})
    # With a given factor no bed is measured, whose columns would be arrays of the host.
    solver = trial.solver.model_copy(update={"radius_mm": 0.6, "settle_s": 0.5, "volume_factor": 1.1})
    trial = trial.model_copy(update={"fluid": fluid, "solver": solver})
    trajectory = path(outline, 2.4, trim_mm=5.0)
    sample = Sample(outline, solid, trajectory)
    enclosure_of(sample, 0.6, "cpu")
    before = _arrays()
    injection = prepare(replace(trial.pour(sample), fluids=(fluid,) * runs))
    taken = sum(array.capacity for number, array in _arrays().items() if number not in before)
    size, _ = checked_size(trial.pour(sample))
    assert size.particles * runs == injection.engine.state.count
    assert size.moving * runs == len(injection.engine.lists.fluid_count)
    assert runs * size.bytes == pytest.approx(taken, rel=0.15)


def _arrays() -> dict[int, wp.array]:
    """Return all arrays with memory of their own, by id; views have none."""
    gc.collect()
    return {id(thing): thing for thing in gc.get_objects() if type(thing) is wp.array and thing.capacity}


def test_a_launch_larger_than_gpu_memory_is_refused_before_the_first_run():
    """26 MB a run were measured on a GPU before links of 6 bytes replaced weights of 4."""
    size = RunSize(14_527, 14_527, 1.0)
    assert size.bytes == pytest.approx(26.3e6 + 14_527 * 128 * 2, rel=0.2)
    require_memory(size, 8e9, "cuda:0", 132)
    with pytest.raises(InputError, match=r"--batch 132: .* need 3\.9 GB, but 2\.0 GB are free on cuda:0"):
        require_memory(size, 2e9, "cuda:0", 132)
