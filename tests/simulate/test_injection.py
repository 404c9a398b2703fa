"""Several fluids at once, several threads, and an injection followed by hand."""

import numpy as np
import pytest

from sealtwin.records import Run
from simulate.injection import prepare
from simulate.settings import Fluid, Nozzle, Solver
from tests.fluids import path, pour, slot

PASTES = (
    Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.2),
    Fluid(U=1000.0, D_cm=0.01, freeze_after_s="never"),
    Fluid(U=30.0, D_cm=0.3, yield_stress_pa=12.0, freeze_after_s="never"),
)


def together(pastes: tuple[Fluid, ...], threads: int = 1, replays: bool = False) -> list[Run]:
    solid, outline = slot(12.0)
    injection = prepare(
        solid,
        outline,
        path(outline, 0.1, speed_mm_s=20.0),
        pastes,
        Solver(settle_s=0.3),
        Nozzle(),
        seed=0,
        device="cpu",
        threads=threads,
    )
    injection.engine.replays = replays
    while injection.done < injection.frames and not injection.at_rest:
        injection.advance()
    assert injection.engine.recorded == replays
    return injection.results()


def test_a_frame_recorded_once_and_replayed_is_the_same_frame():
    """What a GPU does, done on the CPU: no count of movers, no residual, no frame number comes from the host."""
    for replayed, told in zip(together(PASTES, replays=True), together(PASTES), strict=True):
        assert np.array_equal(replayed.position_mm, told.position_mm)
        # Counted in fewer frames, and not the room for all that may.
        assert 0 < replayed.health["moving_most"] <= told.health["moving_most"]


def test_fluids_computed_at_once_are_what_each_is_alone():
    """Bit for bit: a study in one launch must not depend on which runs share it."""
    runs = together(PASTES)
    for run, paste in zip(runs, PASTES, strict=True):
        alone = pour(slot(12.0), path(slot(12.0)[1], 0.1, speed_mm_s=20.0), paste, settle_s=0.3)
        assert np.array_equal(run.position_mm, alone.position_mm)
        assert np.array_equal(run.velocity_mm_s, alone.velocity_mm_s)
    assert runs[-1].settings["fluid"]["yield_stress_pa"] == 12.0


def test_two_threads_give_the_same_bits_as_one(monkeypatch):
    """Slices of a launch write rows of their own, and sums are taken in the same parts."""
    monkeypatch.setattr("simulate.launch.LEAST_SLICE", 10)
    for one, two in zip(together(PASTES[:1]), together(PASTES[:1], threads=2), strict=True):
        assert np.array_equal(one.position_mm, two.position_mm)


@pytest.mark.parametrize("paste", [PASTES[2], PASTES[2].model_copy(update={"structuration_pa_per_s": 50.0})])
def test_paste_with_a_yield_stress_falls_asleep_and_the_run_ends(paste):
    solid, outline = slot(12.0)
    injection = prepare(
        solid,
        outline,
        path(outline, 0.1, speed_mm_s=20.0),
        [paste],
        Solver(settle_s=20.0),
        Nozzle(),
        seed=0,
        device="cpu",
    )
    while injection.done < injection.frames and not injection.at_rest:
        injection.advance()
    assert injection.at_rest
    assert injection.t_s < 5.0
    (run,) = injection.results()
    assert (run.velocity_mm_s == 0).all()
    assert run.escaped_particles == 0


def test_what_froze_by_its_age_is_not_woken():
    """Paste that yields and freezes too: what moves at one time stays what the nozzle gave in that time."""
    paste = PASTES[2].model_copy(update={"freeze_after_s": 0.2})
    (run,) = together((paste,))
    assert run.health["moving_most"] <= 0.2 / run.health["frame_s"] * 7 + 7
    assert (run.velocity_mm_s[run.age_s > 0.21] == 0).all()


def test_a_radius_left_to_us_is_four_abreast():
    """3.1 mm: 0.388 mm; it is written out where the run says what it was made with."""
    crack = slot(12.0)
    run = pour(crack, path(crack[1], 0.02, speed_mm_s=20.0), radius_mm="auto")
    assert run.radius_mm == pytest.approx(crack[1].mean_width_mm / 8, rel=2e-3)
    assert run.settings["solver"]["radius_mm"] == run.radius_mm
    assert run.health["particles_across"] == pytest.approx(4.0, rel=2e-3)
