"""Particles of long runs are renumbered by cells: their pour, and all that is read of it, stays what it was."""

import numpy as np
import pytest

from sealtwin.core.errors import NumericalError
from simulate.injection import Injection
from simulate.watchers import take_frame
from tests.support.batches import PASTES, finish, ready

ALIKE_MM = 5e-5
"""Apart after a frame, where sums in another order round otherwise: by 4e-6."""


def begun(frames: int) -> Injection:
    """A paste under way: some of it moves."""
    injection = ready(PASTES[2:])
    for _ in range(frames):
        injection.advance()
    return injection


def test_a_renumbered_pour_is_the_same_pour(monkeypatch):
    """Two frames on from one state, renumbered between the two or not.

    Broken on purpose, with what was pressed left in its old places, it is off by 7e-4 mm; with velocities, by 0.04.
    """
    as_released = begun(30)
    monkeypatch.setattr("simulate.fluid.solver.RENUMBER_EVERY", 30)
    renumbered = ready(PASTES[2:])
    renumbered.restore(as_released.snapshot())
    for injection in (as_released, renumbered):
        injection.advance()
        injection.advance()
    number, out = renumbered.engine.state.number.numpy(), renumbered.out
    assert (number[:out] != np.arange(out)).mean() > 0.5
    assert np.array_equal(number[out:], np.arange(out, len(number)))
    here, there = take_frame(renumbered), take_frame(as_released)
    assert np.abs(here.position_mm - there.position_mm).max() < ALIKE_MM
    assert np.array_equal(here.age_s, there.age_s)
    assert np.array_equal(here.state, there.state)
    assert np.allclose(here.density, there.density, atol=1e-3)
    state = renumbered.engine.state
    assert np.array_equal(state.by_release(state.release_frame), renumbered.schedule.frame_of)


def test_a_fault_names_the_particle_by_its_release(monkeypatch):
    monkeypatch.setattr("simulate.fluid.solver.RENUMBER_EVERY", 3)
    injection = begun(31)
    state = injection.engine.state
    at = 5
    released = int(state.number.numpy()[at])
    assert released != at
    position = state.position.numpy().copy()
    position[at] = np.nan
    state.position.assign(position)
    with pytest.raises(NumericalError, match=f"particle {released} at"):
        finish(injection)
