"""The conjugate gradients by blocks of threads against those of one thread for each part, both on the CPU."""

from functools import partial

import numpy as np
import pytest
import warp as wp

from simulate.fluid.solver import FluidSolver
from simulate.injection import Injection
from simulate.settings import Fluid
from tests.launches import SPOILED, ready
from tests.simulate.test_viscosity import chaos, set_velocity, still_block

FRAMES = 25


@pytest.fixture(autouse=True)
def _with_a_gpus_lists_and_loops(monkeypatch):
    monkeypatch.setattr("simulate.injection.FluidSolver", partial(FluidSolver, native=False))


def begun(pastes: tuple[Fluid, ...], *, in_blocks: bool) -> Injection:
    injection = ready(pastes)
    injection.engine.viscosity.bind_search(in_blocks)
    for _ in range(FRAMES):
        injection.advance()
    return injection


def test_a_block_of_one_thread_has_the_bits_of_a_thread():
    """Runs of 19 iterations and of 2, side by side: a block that went on after its run is solved would move them."""
    threads, blocks = (begun(SPOILED, in_blocks=in_blocks) for in_blocks in (False, True))
    assert threads.statistics.snapshot()["seen_solves"].max() > 2
    for name in ("seen_solves", "seen_moving"):
        assert np.array_equal(threads.statistics.snapshot()[name], blocks.statistics.snapshot()[name])
    assert np.array_equal(threads.engine.state.position_mm(), blocks.engine.state.position_mm())


def test_a_run_that_is_solved_earlier_than_others_has_the_bits_that_it_has_alone():
    """Its rows are then left out of the products."""
    together = begun(SPOILED, in_blocks=True)
    for number, paste in enumerate(SPOILED):
        alone = begun((paste,), in_blocks=True).engine.state
        assert np.array_equal(
            together.engine.state.position_mm()[alone.count * number :][: alone.count], alone.position_mm()
        )


@pytest.mark.parametrize("lanes", [1, 8, 64])
def test_blocks_of_any_width_find_the_same_velocities(lanes, monkeypatch):
    """To the rounding of sums in another order: with 8 threads, for parts of 12 rows, up to 4e-6 of 9 cm/s apart."""
    monkeypatch.setattr(wp.config, "enable_cpu_blocks", True)
    monkeypatch.setattr("simulate.kernels.conjugate_gradients_gpu.LANES", lanes)
    found = []
    for in_blocks in (False, True, True):
        engine = still_block((300.0, 0.3), native=False)
        engine.viscosity.bind_search(in_blocks)
        set_velocity(engine, chaos(engine))
        engine.viscosity.solve_implicit(engine.rows)
        found.append(engine.state.velocity.numpy())
    assert np.abs(found[0] - found[1]).max() < 1e-4
    assert np.array_equal(found[1], found[2])
