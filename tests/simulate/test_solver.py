from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simulate.fluid.solver import AGAIN_S, PATIENCE_S, RESTLESS_S, WAKING_CM_S, FluidSolver, substeps_for
from simulate.kernels.status import ASLEEP, MOVING, RESTS
from simulate.settings import Fluid, Solver, particle_volume
from simulate.setup.rheology import Rheology
from simulate.setup_checks import rheology_of
from tests.support.small_fluids import FRAME_S, check, engine_with, lattice, positions_mm, slot

LENGTH_MM, WIDTH_MM, DEPTH_MM = 4.0, 3.1, 24.0
COLUMN = 540


@cache
def settled(**solver: Any) -> FluidSolver:
    """A column about 15 mm high in a slot that is deeper than that, let fall from a loose lattice."""
    points = lattice(np.array([0.2, -1.35, -DEPTH_MM + 0.4]), np.array([LENGTH_MM - 0.2, 1.4, 0.0]), 0.745)
    column = points[np.argsort(points[:, 2])][:COLUMN]
    # U = 1 is water: enough to end the sloshing, little against the weight.
    solver = {"volume_factor": 1.0, "substeps": 8, "iterations": 5, **solver}
    engine = engine_with(column, slot(LENGTH_MM, depth_mm=DEPTH_MM), weights=(1.0, 0.0), **solver)
    for _ in range(90 * 8):
        engine.step()
    assert check(engine) == {}
    return engine


def slab(engine: FluidSolver, from_floor_mm: float, to_mm: float) -> NDArray[np.bool_]:
    """Which particles lie that far above the floor."""
    height = positions_mm(engine)[:, 2] + DEPTH_MM
    return (height > from_floor_mm) & (height < to_mm)


def test_the_volume_of_a_particle_is_that_of_eq_6_once_compression_is_allowed_for():
    """Calibrated walls: Vp rho / m = 1.00 +- 0.03. The source's walls push the fluid off: half as much again.

    Six columns of 4 to 4.8 mm lie at 0.993 +- 0.009, however their walls' particles are placed.
    """
    ratio = {}
    for preset, engine in (("accurate", settled()), ("paper", settled(preset="paper"))):
        middle = slab(engine, 2, 9)
        # Between the walls, as the photo shows them: what the stand-off takes belongs to the particles.
        volume_mm3 = LENGTH_MM * WIDTH_MM * 7.0
        density = engine.state.density.numpy()[middle].mean()
        ratio[preset] = volume_mm3 / middle.sum() * density / particle_volume(0.4)
    assert ratio["accurate"] == pytest.approx(1.0, abs=0.03)
    assert ratio["paper"] > 1.3


def test_fluid_rests_on_walls_at_the_clearance():
    engine = settled()
    distance = engine.barrier.exact_mm(positions_mm(engine))
    assert distance.min() == pytest.approx(0.86 * 0.4, abs=0.02)


@pytest.mark.parametrize(
    ("radius_mm", "frame_s", "carried", "alone"),
    [(0.4, 7.225e-3, 4, 4), (0.4, 7.14e-3, 3, 4), (0.5, 14.1e-3, 6, 6), (0.4, 1e-3, 1, 1)],
)
def test_substeps_follow_the_fall_of_a_particle(radius_mm, frame_s, carried, alone):
    """4 x 4 at R = 0.4 and 6 x 4 at R = 0.5 mm are what the prototype recommends for the paper's trial."""
    paste, the_papers, water = (
        rheology_of(Fluid.model_validate({"freeze_after_s": "never", **fluid}), radius_mm * 0.4, frame_s)
        for fluid in (
            {"U": 30.0, "D_cm": 0.3, "yield_stress_pa": 12.0},
            {"U": 30.0, "D_cm": 0.3, "freeze_after_s": 2.0},
            {"viscosity_pa_s": 0.001},
        )
    )
    local = Solver(radius_mm=radius_mm)
    assert substeps_for(local, paste, frame_s) == carried
    assert substeps_for(local, the_papers, frame_s) == substeps_for(local, water, frame_s) == alone
    assert substeps_for(Solver(radius_mm=radius_mm, substeps=3), paste, frame_s) == 3


SLEEPY = Rheology(30.0, 0.3, yield_cm2_s2=71.0)


@pytest.mark.parametrize(
    ("speed", "flowed_s", "wakes"),
    [
        (1.1 * WAKING_CM_S, 0.0, True),
        (0.4 * WAKING_CM_S, 0.0, False),
        (0.4 * WAKING_CM_S, 1.1 * RESTLESS_S, True),
        (0.4 * WAKING_CM_S, 0.9 * RESTLESS_S, False),
    ],
)
def test_a_sleeper_wakes_beside_what_is_fast_or_goes_on_flowing(speed, flowed_s, wakes):
    """Paste that flows back at 2 mm/s would else stand as a step on a bed that sleeps."""
    engine = engine_with(np.array([[3.0, 0.0, -8.0], [3.0, 0.0, -7.0]]), slot(), fluid=SLEEPY)
    state = engine.state
    engine.find_neighbours()
    position, status = state.position.numpy().copy(), state.status.numpy().copy()
    position[0, 3], status[0] = RESTS, ASLEEP
    state.position.assign(position)
    state.status.assign(status)
    state.velocity.assign(np.array([[0.0, 0.0, 0.0], [speed, 0.0, 0.0]], dtype=np.float32))
    quiet_s = engine.lasting()["quiet_s"]
    quiet_s.assign(np.array([PATIENCE_S, -flowed_s], dtype=np.float32))
    engine.find_movers()
    engine.find_neighbours()
    engine.viscosity.weigh_pairs(engine.rows)
    engine._wake(engine.rows)
    assert (state.status.numpy()[0] == int(MOVING)) == wakes
    if wakes:
        # It lies down again soon, if it does not flow.
        assert quiet_s.numpy()[0] == pytest.approx(PATIENCE_S - AGAIN_S)


def test_a_moment_of_quiet_forgets_the_flow_and_one_of_flow_the_quiet():
    engine = engine_with(np.array([[3.0, 0.0, -8.0]]), slot(), fluid=SLEEPY)
    quiet_s = engine.lasting()["quiet_s"]
    for speed, before, after in ((0.0, -5.0, FRAME_S), (1.0, 0.2, -FRAME_S), (1.0, -0.2, -0.2 - FRAME_S)):
        engine.state.velocity.assign(np.array([[speed, 0.0, 0.0]], dtype=np.float32))
        quiet_s.fill_(before)
        engine._fall_asleep(engine.rows)
        assert quiet_s.numpy()[0] == pytest.approx(after, rel=1e-4)
