"""Frames of a run at given moments."""

import gc
import itertools
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.records import ParticleState
from simulate.fluid import solver
from simulate.injection import Injection, prepare
from simulate.kernels import status
from simulate.output import COLUMNS, HealthLog, Moments, take_frame
from simulate.settings import Fluid, Nozzle, Solver
from tests.fluids import path, slot

FREEZING = Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.2)


def injection(volume_ml: float = 0.12, speed_mm_s: float = 20.0) -> Injection:
    solid, outline = slot(12.0)
    solver = Solver.model_validate({"radius_mm": 0.6, "settle_s": 0.1})
    trajectory = path(outline, volume_ml, speed_mm_s)
    return prepare(solid, outline, trajectory, [FREEZING], solver, Nozzle(), seed=1, device="cpu")


def followed(run: Injection, *watchers, frames: int | None = None) -> None:
    for watcher in watchers:
        watcher.begin(run)
    for _ in range(run.frames - run.done if frames is None else frames):
        run.advance()
        for watcher in watchers:
            watcher.after_frame(run)


def test_states_have_the_numbers_of_the_kernels():
    assert {state.name: state.value for state in ParticleState} == {
        state.name: int(getattr(status, state.name)) for state in ParticleState
    }


def test_a_frame_holds_what_has_left_the_nozzle_as_it_is_then():
    run = injection()
    followed(run)
    frame, (result,) = take_frame(run), run.results()
    assert frame.t_s == run.t_s
    assert np.array_equal(frame.position_mm, result.position_mm)
    assert np.array_equal(frame.velocity_mm_s, result.velocity_mm_s)
    assert np.array_equal(frame.age_s, result.age_s)
    assert ((frame.state == ParticleState.FROZEN) == (frame.age_s > 0.2)).mean() > 0.98
    half = injection()
    followed(half, frames=20)
    assert len(take_frame(half).age_s) == half.out < len(result.age_s)


def test_each_moment_is_taken_once_by_the_first_frame_that_reaches_it():
    """0 before anything is out, two in one frame, one just past the end; one far past it is not there."""
    run, taken = injection(), []
    end_s = run.frames * run.schedule.frame_s
    wanted = [0.0, 0.1, 0.1001, 0.3, 1.01 * end_s]
    followed(run, Moments([*wanted, 1.5 * end_s], lambda asked_s, frame: taken.append((asked_s, frame.t_s))))
    assert [asked_s for asked_s, _ in taken] == wanted
    for asked_s, t_s in taken[1:-1]:
        assert 0 <= t_s - asked_s < run.schedule.frame_s
    assert (taken[0][1], taken[-1][1]) == (run.schedule.frame_s, run.t_s)


def test_a_resumed_run_takes_each_moment_that_a_kill_may_have_lost():
    """Kept in the very frame in which a moment fell due: its file may not be there."""
    whole, resumed, taken = injection(), injection(), []
    take = lambda asked_s, _: taken.append(asked_s)  # noqa: E731
    followed(whole, frames=20)
    resumed.restore(whole.snapshot())
    times_s = (whole.t_s * share for share in (0.5, 1.0, 1.5, 2.0))
    followed(resumed, Moments(times_s, take), frames=25)
    assert taken == pytest.approx([whole.t_s * share for share in (1.0, 1.5, 2.0)])


def test_health_has_a_row_for_every_tenth_frame_and_a_resumed_run_goes_on_with_it(tmp_path):
    def rows(file: Path) -> list[list[str]]:
        return [line.split(",") for line in file.read_text().splitlines()]

    whole, file = injection(), tmp_path / "health.csv"
    followed(whole, HealthLog(file))
    header, *values = rows(file)
    assert header == list(COLUMNS)
    assert [int(row[0]) for row in values] == list(range(10, whole.done + 1, 10))
    last = dict(zip(header, values[-1], strict=True))
    at_end = injection()
    followed(at_end, frames=int(last["frame"]))
    assert int(last["particles"]) == at_end.out
    assert int(last["moving"]) == at_end.engine.rows
    assert all(0 <= float(last[f"density_error_{name}"]) < 0.2 for name in ("mean", "p95"))
    assert float(last["ms_a_frame"]) > 0
    solves = at_end.statistics.solves[-10 * at_end.engine.substeps :]
    assert float(last["viscosity_iterations"]) == pytest.approx(np.mean(solves), abs=0.01)
    resumed, killed, log = injection(), injection(), HealthLog(file)
    followed(killed, log, frames=25)
    resumed.restore(killed.snapshot())
    for _ in range(10):  # until the kill: the row of frame 30 is written, and will be again
        killed.advance()
        log.after_frame(killed)
    with file.open("a") as opened:
        opened.write("20,0.1,lost")  # a line that a power cut tore
    followed(resumed, HealthLog(file))
    # The means in the last two columns begin anew where the run went on.
    assert [row[:-2] for row in rows(file)] == [row[:-2] for row in [header, *values]]


def test_memory_does_not_grow_over_a_watched_run(tmp_path, monkeypatch):
    """300 frames, each of them taken and let go: to keep them would be 47 kB each.

    For the run's health 4 iterations, a number of movers and a fiftieth of a density sample are kept: 104 B, as seen.
    """
    # A recording is kept for each number of rows, in steps of 128, and not for a frame.
    monkeypatch.setattr(solver, "MOST_RECORDED", 0)
    run = injection(volume_ml=0.8)
    log = HealthLog(tmp_path / "health.csv")
    moments = Moments((run.schedule.frame_s * number for number in itertools.count()), lambda *_: None)
    followed(run, log, moments, frames=100)
    tracemalloc.start()
    # Warp sets up what a launch needs when it is first made.
    followed(run, frames=1)
    try:
        gc.collect()
        before, _ = tracemalloc.get_traced_memory()
        for _ in range(300):
            run.advance()
            log.after_frame(run)
            moments.after_frame(run)
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert run.done < run.frames
    assert (after - before) / 300 < 300


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells what is resident")
@pytest.mark.parametrize("replays", [False, True])
def test_resident_memory_does_not_grow_over_a_run(replays):
    """What no Python object holds is seen here: 1,500 frames after 300 that warm up, in a process of their own.

    Half a page of 4 kB for each would be seen. Found are 0.9 MB in all, of which health keeps 0.2; 0.0 replayed.
    """
    code = (
        "import ctypes, gc; from pathlib import Path\n"
        "from tests.fluids import path, slot; from tests.launches import *\n"
        "def resident():\n"
        "    gc.collect()\n"
        # What set-up left free would else take in what a leak keeps.
        "    ctypes.CDLL(None).malloc_trim(0)\n"
        "    return int(Path('/proc/self/statm').read_text().split()[1]) * 4096\n"
        "solid, outline = slot(12.0)\n"
        "settings = Solver(radius_mm=0.6, substeps=19, settle_s=30.0, sleep=False, volume_factor=1.1)\n"
        "run = prepare(solid, outline, path(outline, 0.1, 20.0), PASTES, settings, Nozzle(), seed=1, device='cpu')\n"
        f"run.engine.replays = {replays}\n"
        "[run.advance() for _ in range(300)]; before = resident(); [run.advance() for _ in range(1500)]\n"
        "assert run.done == 1800 and run.moving; print(resident() - before)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert int(told.splitlines()[-1]) < 1500 * 2048
