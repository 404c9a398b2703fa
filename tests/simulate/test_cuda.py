"""Tests that need a GPU. Replayed frames are also compared on the CPU (test_injection)."""

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


def test_recorded_frames_on_a_gpu_agree_with_the_cpu():
    """After 8 frames only floats that are rounded in another order differ, since chaos takes longer.

    CPU runs whose starts differ by 1e-6 mm differ by up to 2e-5 mm by then; the benchmark compares whole runs.
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


def test_one_warp_per_particle_gives_the_positions_of_one_thread_per_particle(monkeypatch):
    """Many particles have a thread each and few a warp each, in which floats are summed in another order."""
    warps = ready(PASTES[:1], device=DEVICE)
    monkeypatch.setattr("simulate.fluid.solver.MAX_SHARED", 0)
    threads = ready(PASTES[:1], device=DEVICE)
    for injection in (warps, threads):
        for _ in range(8):
            injection.advance()
    apart_mm = np.abs(warps.engine.state.position_mm() - threads.engine.state.position_mm())[: warps.out].max()
    assert 0 < apart_mm < 1e-2


def test_a_gpu_run_is_bit_identical_when_repeated_or_computed_alone():
    """The order of all sums of floats is fixed. With over 30,000 moving particles it is another order than here."""
    once, again = together(PASTES, device=DEVICE), together(PASTES, device=DEVICE)
    for run, same, paste in zip(once, again, PASTES, strict=True):
        (alone,) = together((paste,), device=DEVICE)
        assert np.array_equal(run.position_mm, same.position_mm)
        assert np.array_equal(run.position_mm, alone.position_mm)
        assert run.escaped_particles == 0


def test_a_gpu_run_resumed_from_a_snapshot_equals_the_unbroken_run():
    check_going_on(device=DEVICE)


@pytest.mark.parametrize("spoil", [spoil_a_place, forbid_long_solves])
def test_a_failed_run_on_a_gpu_does_not_change_the_other_runs(spoil, monkeypatch):
    injection, reason = spoil(monkeypatch, device=DEVICE)
    finish(injection)
    check_the_others(injection, reason)


def test_frames_with_explicit_viscosity_passes_are_not_recorded():
    """The host counts the passes. The run agrees with the CPU's up to the rounding of floats."""
    there, here = (finish(ready(PASTES[:1], device=device, viscosity_solve="explicit")) for device in (DEVICE, "cpu"))
    assert not there.engine.recorded
    explicit, on_cpu = results(there)[0], results(here)[0]
    assert explicit.health.recorded()["viscosity_iterations_most"] >= 1
    assert np.median(explicit.position_mm[:, 2]) == pytest.approx(np.median(on_cpu.position_mm[:, 2]), abs=1e-2)


def test_replayed_frames_neither_synchronise_nor_read_arrays(monkeypatch):
    """The exceptions are a few figures of the bed, which are read each time that it is measured."""
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
