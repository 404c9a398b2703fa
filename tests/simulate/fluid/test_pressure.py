"""Pressure that begins with what the last substep's came to, in fluids that are viscous enough."""

import numpy as np
import pytest

from simulate.fluid.pressure import Iterations, iterations_of
from simulate.loose_fluid import substep_s
from simulate.setup.rheology import Rheology, viscous_weight
from tests.support.small_fluids import engine_with, lay_down, prepared, sealant, slot
from tests.support.tanks import Pit, Tank, cube_mm, settled_mm

RADIUS_MM = 0.4
STEP_S = substep_s(RADIUS_MM)
PIT = Pit(4.0, 3.1, 24.0)


@pytest.fixture(scope="module")
def column_mm():
    return settled_mm(PIT, RADIUS_MM, STEP_S, 4.0)


@pytest.mark.parametrize(
    ("damping", "expected"), [(0.0, (0.0, 4)), (0.99, (0.0, 4)), (1.0, (0.5, 3)), (100.0, (0.5, 3)), (101.0, (0.0, 4))]
)
def test_a_fluid_that_carries_pressure_over_has_fewer_iterations(damping, expected):
    assert iterations_of(damping, alone=4) == expected
    assert iterations_of(damping, alone=1).number == 1


def test_the_damping_is_what_pairs_take_of_a_speed_among_neighbours_that_stand():
    """At rest: the first-order share that the viscosity's weights stand for."""
    place_mm = cube_mm(6.0) + np.array([0.0, 0.0, 5.0])
    support = 0.4 * RADIUS_MM
    fluid = Rheology(viscous_weight(3.0, support, STEP_S), 0.0, physical=True)
    taken = []
    for particle in np.flatnonzero((np.abs(place_mm - place_mm.mean(axis=0)) < 1.2).all(axis=1))[:8]:
        engine = engine_with(place_mm, slot(), fluid=fluid, frame_s=STEP_S, substeps=1, radius_mm=RADIUS_MM)
        prepared(engine)
        lay_down(engine, np.arange(len(place_mm)) != particle)
        engine.find_neighbours()
        engine.viscosity.weigh_pairs(1)
        taken.append(engine.viscosity.system.restraint.numpy()[0])
    assert len(taken) == 8
    assert fluid.damping(support, STEP_S, 1) == pytest.approx(np.mean(taken), rel=0.1)


@pytest.mark.parametrize(
    ("fluid", "settings", "expected"),
    [
        ({"viscosity_pa_s": 0.5}, {}, (0.5, 3)),
        ({"consistency_pa_s_n": 0.1, "flow_index": 0.5}, {}, (0.0, 4)),
        ({"viscosity_pa_s": 0.003}, {}, (0.0, 4)),
        # Thin as it flows, whatever it is at rest.
        ({"viscosity_pa_s": 0.003, "yield_stress_pa": 0.1}, {}, (0.0, 4)),
        ({"viscosity_pa_s": 0.003, "yield_stress_pa": 12.0}, {}, (0.5, 3)),
        ({"viscosity_pa_s": 0.5, "yield_stress_pa": 120.0}, {}, (0.0, 4)),
        ({"U": 1e4, "D_cm": 0.3}, {}, (0.0, 4)),
        ({"viscosity_pa_s": 0.5}, {"iterations": 6}, (0.5, 6)),
        ({"viscosity_pa_s": 0.5}, {"preset": "paper"}, (0.0, 4)),
    ],
)
def test_what_is_carried_over_follows_from_the_fluid_and_the_settings(column_mm, fluid, settings, expected):
    tank = Tank.of(PIT, column_mm, radius_mm=RADIUS_MM, step_s=STEP_S, fluid=sealant(**fluid), **settings)
    assert tank.engine.iterations == [Iterations(*expected)]
    tank.engine.step()
    kept = tank.engine.state.pressed.numpy()[:, 3]
    assert (kept <= 0).all()
    # Otherwise every iteration begins at zero, as the paper's.
    assert (kept < 0).any() == (expected[0] > 0)


def test_a_deep_column_between_walls_that_slip_does_not_swing():
    """Only its own viscosity calms it. The mean speed is 1 mm/s, but 57 with 0.7 or 0.83 for the share of 0.5."""
    pit = Pit(4.0, 3.1, 40.0)
    place_mm = settled_mm(pit, RADIUS_MM, STEP_S, 24.0)
    tank = Tank.of(pit, place_mm, radius_mm=RADIUS_MM, step_s=STEP_S, viscosity_mm2_s=300.0)
    assert tank.engine.iterations == [Iterations(0.5, 3)]
    tank.wait(0.6)
    assert np.mean([np.linalg.norm(tank.velocity_mm_s, axis=1).mean() for _ in tank.run(0.2)]) < 6.0
