"""Several fluids at once, several threads, and an injection followed by hand."""

import time

import numpy as np
import pytest

from sealtwin.core.errors import NumericalError
from sealtwin.core.records import Run
from simulate.injection import SAMPLE_EVERY
from tests.fluids import path, pour, slot
from tests.launches import (
    PASTES,
    alone,
    check_going_on,
    check_the_others,
    finish,
    forbid_long_solves,
    ready,
    spoil_a_place,
    together,
)


@pytest.fixture(scope="module")
def told_together() -> list[Run]:
    """All pastes in one launch, told by the host."""
    return together(PASTES)


@pytest.mark.parametrize("pastes", [PASTES, PASTES[:1]])
def test_a_frame_recorded_once_and_replayed_is_the_same_frame(told_together, pastes):
    """No count of movers, no residual, no frame number comes from the host."""
    expected = told_together if pastes == PASTES else [alone(0)]
    for replayed, told in zip(together(pastes, replays=True), expected, strict=True):
        assert np.array_equal(replayed.position_mm, told.position_mm)
        # Counted in fewer frames, and not the room for all that may.
        assert 0 < replayed.health.recorded()["moving_most"] <= told.health.recorded()["moving_most"]


def test_a_replayed_run_ends_when_its_bed_is_at_rest():
    """It is seen at the next sample, and not at the last frame; what lies then lies where it lay."""
    told, replayed = (finish(ready(PASTES[2:], replays=replays, settle_s=5.0)) for replays in (False, True))
    assert told.done < told.frames - SAMPLE_EVERY
    assert told.done <= replayed.done < told.done + SAMPLE_EVERY
    assert np.array_equal(replayed.results()[0].position_mm, told.results()[0].position_mm)


def test_a_replayed_run_goes_on_from_where_it_was_kept():
    check_going_on(replays=True)


@pytest.mark.parametrize("replays", [False, True])
@pytest.mark.parametrize("spoil", [spoil_a_place, forbid_long_solves])
def test_a_run_that_fails_costs_the_others_of_its_launch_nothing(spoil, replays, monkeypatch):
    """It is given up where it fails; those beside it have the bits that they have alone, and nobody computes twice."""
    injection, reason = spoil(monkeypatch, replays=replays)
    finish(injection)
    check_the_others(injection, reason)


def test_a_launch_of_which_no_run_is_left_ends(monkeypatch):
    monkeypatch.setattr("simulate.fluid.viscosity.ITERATIONS_AT_MOST", 0)
    injection = ready(PASTES[:2])
    with pytest.raises(NumericalError, match="did not converge"):
        finish(injection)
    assert len(injection.failed) == 2


def test_time_that_is_spent_waiting_for_the_device_is_the_frames(monkeypatch):
    """A GPU computes while the host goes on; who reads first would else find its time nowhere."""
    injection = ready(PASTES[:1])
    injection.advance()
    before_s = injection.statistics.frames_s
    monkeypatch.setattr("warp.synchronize_device", lambda _: time.sleep(0.02))
    injection.snapshot()
    assert 0.02 <= injection.statistics.frames_s - before_s < 1


def test_fluids_computed_at_once_are_what_each_is_alone(told_together):
    """Bit for bit: a study in one launch must not depend on which runs share it."""
    for number, run in enumerate(told_together):
        single = alone(number)
        assert np.array_equal(run.position_mm, single.position_mm)
        assert np.array_equal(run.velocity_mm_s, single.velocity_mm_s)
        here, there = run.health.recorded(), single.health.recorded()
        for name in ("density_error_mean", "density_error_max", "most_neighbours", "moving_mean", "moving_most"):
            assert here[name] == there[name], name
        for name in ("volume_factor", "viscosity_iterations_mean"):
            assert here[name] == there[name], name
    assert told_together[-1].settings["fluid"]["yield_stress_pa"] == 12.0


def test_two_threads_give_the_same_bits_as_one(monkeypatch):
    """Slices of a launch write rows of their own, and sums are taken in the same parts."""
    monkeypatch.setattr("simulate.fluid.launcher.LEAST_SLICE", 10)
    (run,) = together(PASTES[:1], threads=2)
    assert np.array_equal(run.position_mm, alone(0).position_mm)


@pytest.mark.parametrize("paste", [PASTES[2], PASTES[2].model_copy(update={"structuration_pa_per_s": 50.0})])
def test_paste_with_a_yield_stress_falls_asleep_and_the_run_ends(paste):
    injection = finish(ready((paste,), settle_s=20.0))
    assert injection.at_rest
    assert injection.t_s < 5.0
    (run,) = injection.results()
    assert (run.velocity_mm_s == 0).all()
    assert run.escaped_particles == 0


def test_what_froze_by_its_age_is_not_woken():
    """Paste that yields and freezes too: what moves at one time stays what the nozzle gave in that time."""
    paste = PASTES[2].model_copy(update={"freeze_after_s": 0.2})
    (run,) = together((paste,))
    assert run.health.recorded()["moving_most"] <= 0.2 / run.health.recorded()["frame_s"] * 7 + 7
    assert (run.velocity_mm_s[run.age_s > 0.21] == 0).all()


def test_a_radius_left_to_us_is_four_abreast():
    """3.1 mm: 0.388 mm; it is written out where the run says what it was made with."""
    crack = slot(12.0)
    run = pour(crack, path(crack[1], 0.02, speed_mm_s=20.0), radius_mm="auto")
    assert run.radius_mm == pytest.approx(crack[1].mean_width_mm / 8, rel=2e-3)
    assert run.settings["solver"]["radius_mm"] == run.radius_mm
    assert run.health.recorded()["particles_across"] == pytest.approx(4.0, rel=2e-3)
