"""Several fluids in one launch, several threads, snapshots, replayed frames and failed runs."""

from functools import cache

import numpy as np
import pytest

from sealtwin.core.records import Run
from tests.support.batches import (
    PASTES,
    check_going_on,
    check_the_others,
    finish,
    forbid_long_solves,
    spoil_a_place,
    together,
)


@pytest.fixture(params=["in order", "renumbered"])
def way(request, monkeypatch) -> str:
    """How runs are computed. Particles are renumbered by cells: here never, or every three frames."""
    monkeypatch.setattr("simulate.fluid.solver.RENUMBER_EVERY", 3 if request.param == "renumbered" else 10**6)
    return request.param


@cache
def runs_of(way: str) -> list[Run]:
    """All pastes in one launch, whose kernels the host launches."""
    return together(PASTES)


ALIKE = ("density_error_mean", "density_error_max", "most_neighbours", "moving_mean", "moving_most", "volume_factor")


def test_fluids_computed_in_one_launch_equal_fluids_computed_alone(way):
    """They are bit-identical, since a study must not depend on which runs share a launch."""
    for number, run in enumerate(runs_of(way)):
        (single,) = together(PASTES[number : number + 1])
        assert np.array_equal(run.position_mm, single.position_mm)
        assert np.array_equal(run.velocity_mm_s, single.velocity_mm_s)
        figures, alone = (
            [health[name] for name in (*ALIKE, "viscosity_iterations_mean")]
            for health in (run.health.recorded(), single.health.recorded())
        )
        assert figures == alone
    assert runs_of(way)[-1].settings["fluid"]["yield_stress_pa"] == 12.0


@pytest.mark.parametrize("threads", [2, 4])
def test_runs_on_any_number_of_threads_are_bit_identical(way, threads, monkeypatch):
    """Threads write separate rows; sums are taken in the same parts, or of integers.

    Points of a cell are sorted in the order of release, so that renumbering changes nothing either.
    """
    monkeypatch.setattr("simulate.fluid.walkers.FEWEST_ROWS", 1)
    for run, shared in zip(runs_of("in order"), together(PASTES, threads=threads), strict=True):
        assert np.array_equal(run.position_mm, shared.position_mm)
        assert np.array_equal(run.velocity_mm_s, shared.velocity_mm_s)
        assert run.health.recorded()["volume_factor"] == shared.health.recorded()["volume_factor"]


@pytest.mark.parametrize(("way", "replays"), [("in order", False), ("renumbered", True)], indirect=["way"])
def test_a_run_resumed_from_a_snapshot_equals_the_unbroken_run(way, replays):
    check_going_on(replays=replays)


def test_replayed_frames_equal_frames_launched_by_the_host(way):
    """When replayed, no particle count, residual or frame number comes from the host."""
    for replayed, run in zip(together(PASTES, replays=True), runs_of(way), strict=True):
        assert np.array_equal(replayed.position_mm, run.position_mm)
        # It is counted in fewer frames, and is not the capacity for all particles.
        assert 0 < replayed.health.recorded()["moving_most"] <= run.health.recorded()["moving_most"]


@pytest.mark.parametrize("replays", [False, True])
@pytest.mark.parametrize("spoil", [spoil_a_place, forbid_long_solves])
def test_a_failed_run_does_not_change_the_other_runs_of_its_launch(spoil, replays, monkeypatch):
    """It stops when it fails. The other runs are bit-identical to runs computed alone, and are not computed twice."""
    injection, reason = spoil(monkeypatch, replays=replays)
    finish(injection)
    check_the_others(injection, reason)
