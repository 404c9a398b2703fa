"""What only a GPU can show; that a recorded frame is the same frame is shown on the CPU (test_injection)."""

import numpy as np
import pytest
import warp as wp

from simulate.kernels.beds import PARTS
from tests.support.batches import (
    PASTES,
    check_going_on,
    check_the_others,
    finish,
    forbid_long_solves,
    ready,
    spoil_a_place,
    together,
)
from tests.support.small_fluids import results

DEVICE = "cuda:0"

pytestmark = [pytest.mark.gpu, pytest.mark.skipif(not wp.get_cuda_device_count(), reason="no CUDA device is here")]


def test_a_frame_is_recorded_and_the_fluid_stays_near_to_the_cpus():
    """After 8 frames, in which chaos has no time: floats rounded in another order, and nothing else, lie between.

    CPU runs whose starts are 1e-6 mm apart are up to 2e-5 mm apart by then; the benchmark holds a whole run to
    its bound.
    """
    for paste in PASTES:
        here, there = ready((paste,)), ready((paste,), device=DEVICE)
        for _ in range(8):
            here.advance()
            there.advance()
        assert there.engine.recorded
        assert there.engine.kernels_a_frame > 0
        out = here.out
        apart_mm = np.abs(here.engine.state.position_mm() - there.engine.state.position_mm())[:out].max()
        assert 0 < apart_mm < 1e-2


def test_warps_and_threads_find_the_same(monkeypatch):
    """Many particles have a thread each, few a warp each: floats are then summed in another order, and nothing else."""
    warps = ready(PASTES[:1], device=DEVICE)
    monkeypatch.setattr("simulate.fluid.solver.MOST_SHARED", 0)
    threads = ready(PASTES[:1], device=DEVICE)
    for injection in (warps, threads):
        for _ in range(8):
            injection.advance()
    apart_mm = np.abs(warps.engine.state.position_mm() - threads.engine.state.position_mm())[: warps.out].max()
    assert 0 < apart_mm < 1e-2


def test_runs_on_a_gpu_have_the_same_bits_each_time_and_in_any_company():
    """No float is summed in an order of chance; beyond 30,000 movers at once, in another order than here."""
    once, again = together(PASTES, device=DEVICE), together(PASTES, device=DEVICE)
    for run, same, paste in zip(once, again, PASTES, strict=True):
        (alone,) = together((paste,), device=DEVICE)
        assert np.array_equal(run.position_mm, same.position_mm)
        assert np.array_equal(run.position_mm, alone.position_mm)
        assert run.escaped_particles == 0


def test_a_run_on_a_gpu_goes_on_from_where_it_was_kept():
    check_going_on(device=DEVICE)


@pytest.mark.parametrize("spoil", [spoil_a_place, forbid_long_solves])
def test_a_run_that_fails_on_a_gpu_costs_the_others_nothing(spoil, monkeypatch):
    injection, reason = spoil(monkeypatch, device=DEVICE)
    finish(injection)
    check_the_others(injection, reason)


def test_explicit_passes_are_counted_by_the_host_and_no_frame_of_theirs_is_recorded():
    """The run stays near to the CPU's: nothing but the rounding of floats lies between."""
    there, here = (finish(ready(PASTES[:1], device=device, viscosity_solve="explicit")) for device in (DEVICE, "cpu"))
    assert not there.engine.recorded
    explicit, on_cpu = results(there)[0], results(here)[0]
    assert explicit.health.recorded()["viscosity_iterations_most"] >= 1
    assert np.median(explicit.position_mm[:, 2]) == pytest.approx(np.median(on_cpu.position_mm[:, 2]), abs=1e-2)


def test_frames_are_replayed_without_a_word_from_the_host(monkeypatch):
    """Between samples nobody waits and no array is read, but some figures of the bed each time that it is measured."""
    injection = ready(PASTES[:1], device=DEVICE)
    control, numpy = injection.volume_control, wp.array.numpy
    assert control is not None
    read: list[int] = []

    def overheard(*_: object) -> None:
        raise AssertionError("the host asked within a frame")

    def noted(array: wp.array) -> np.ndarray:
        read.append(array.size)
        return numpy(array)

    for _ in range(2):
        injection.advance()
    while injection.done < 42:
        measured = (injection.done + 1) % control.every == 0
        with monkeypatch.context() as within:
            within.setattr(wp.array, "numpy", noted if measured else overheard)
            for name in () if measured else ("synchronize_device", "synchronize_stream", "synchronize"):
                within.setattr(f"warp._src.context.{name}", overheard)
            injection.advance()
    # The factors of all runs, and the parts of their counts and volumes.
    assert len(read) == 3 * (42 // control.every)
    assert max(read) == int(PARTS)
