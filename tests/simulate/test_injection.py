"""Several fluids at once, several threads, and an injection followed by hand."""

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
    """All pastes in one launch, told by the host."""
    return together(PASTES)


ALIKE = ("density_error_mean", "density_error_max", "most_neighbours", "moving_mean", "moving_most", "volume_factor")


def test_fluids_computed_at_once_are_what_each_is_alone(way):
    """Bit for bit: a study in one launch must not depend on which runs share it."""
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
def test_any_number_of_threads_gives_the_same_bits(way, threads, monkeypatch):
    """Slices of a launch write rows of their own; sums are taken in the same parts, or in whole numbers.

    Points of a cell are sorted in the order of release, so that new numbers change nothing either.
    """
    monkeypatch.setattr("simulate.fluid.walkers.FEWEST_ROWS", 1)
    for run, shared in zip(runs_of("in order"), together(PASTES, threads=threads), strict=True):
        assert np.array_equal(run.position_mm, shared.position_mm)
        assert np.array_equal(run.velocity_mm_s, shared.velocity_mm_s)
        assert run.health.recorded()["volume_factor"] == shared.health.recorded()["volume_factor"]


@pytest.mark.parametrize(("way", "replays"), [("in order", False), ("renumbered", True)], indirect=["way"])
def test_a_run_goes_on_from_where_it_was_kept(way, replays):
    check_going_on(replays=replays)


def test_a_frame_recorded_once_and_replayed_is_the_same_frame(way):
    """No count of movers, no residual, no frame number comes from the host."""
    for replayed, run in zip(together(PASTES, replays=True), runs_of(way), strict=True):
        assert np.array_equal(replayed.position_mm, run.position_mm)
        # Counted in fewer frames, and not the room for all that may.
        assert 0 < replayed.health.recorded()["moving_most"] <= run.health.recorded()["moving_most"]


@pytest.mark.parametrize("replays", [False, True])
@pytest.mark.parametrize("spoil", [spoil_a_place, forbid_long_solves])
def test_a_run_that_fails_costs_the_others_of_its_launch_nothing(spoil, replays, monkeypatch):
    """It is given up where it fails; those beside it have the bits that they have alone, and nobody computes twice."""
    injection, reason = spoil(monkeypatch, replays=replays)
    finish(injection)
    check_the_others(injection, reason)
