"""The conjugate gradients as a GPU runs them, in a launch of several runs and by blocks of threads, both on the CPU."""

from functools import partial

import numpy as np
import pytest
import warp as wp

from simulate.fluid.solver import FluidSolver
from simulate.fluid.state import State
from simulate.settings import Fluid
from tests.launches import SPOILED, ready
from tests.simulate.test_viscosity import chaos, set_velocity, still_block

FRAMES = 25


def begun(pastes: tuple[Fluid, ...]) -> State:
    injection = ready(pastes)
    for _ in range(FRAMES):
        injection.advance()
    return injection.engine.state


def test_a_run_that_is_solved_earlier_than_others_has_the_bits_that_it_has_alone(monkeypatch):
    """Its rows are then left out of the products, with a GPU's lists and loops."""
    monkeypatch.setattr("simulate.injection.FluidSolver", partial(FluidSolver, native=False))
    together = begun(SPOILED)
    for number, paste in enumerate(SPOILED):
        alone = begun((paste,))
        assert np.array_equal(together.position_mm()[alone.count * number :][: alone.count], alone.position_mm())


@pytest.mark.parametrize("lanes", [8, 64])
def test_blocks_of_any_width_find_the_same_velocities(lanes, monkeypatch):
    """To the rounding of sums in another order: with 8 threads, for parts of 12 rows, up to 4e-6 of 9 cm/s apart."""
    velocities = []
    for width in (1, lanes, lanes):
        monkeypatch.setattr(wp.config, "enable_cpu_blocks", width > 1)
        monkeypatch.setattr("simulate.kernels.conjugate_gradients.LANES", width)
        engine = still_block((300.0, 0.3), native=False)
        set_velocity(engine, chaos(engine))
        engine.viscosity.solve_implicit(engine.rows)
        velocities.append(engine.state.velocity.numpy())
    assert np.abs(velocities[0] - velocities[1]).max() < 1e-4
    assert np.array_equal(velocities[1], velocities[2])
