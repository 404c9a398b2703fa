"""Pressure iterations that start from the last substep's pressure, in sufficiently viscous fluids."""

import numpy as np
import pytest

from benchmarks.loose_fluid import substep_s
from simulate.fluid.pressure import Iterations, iterations_of
from tests.support.tanks import Pit, Tank, settled_mm

RADIUS_MM = 0.4
STEP_S = substep_s(RADIUS_MM)


@pytest.mark.parametrize(
    ("damping", "expected"), [(0.0, (0.0, 4)), (0.99, (0.0, 4)), (1.0, (0.5, 3)), (100.0, (0.5, 3)), (101.0, (0.0, 4))]
)
def test_medium_damping_allows_fewer_iterations_by_carrying_pressure_over(damping, expected):
    assert iterations_of(damping, alone=4) == expected
    assert iterations_of(damping, alone=1).number == 1


def test_a_deep_column_between_slip_walls_does_not_oscillate():
    """Its viscosity alone damps it. The mean speed is 1 mm/s, or 57 with 0.7 or 0.83 of the pressure carried over."""
    pit = Pit(4.0, 3.1, 40.0)
    place_mm = settled_mm(pit, RADIUS_MM, STEP_S, 24.0)
    tank = Tank.of(pit, place_mm, radius_mm=RADIUS_MM, step_s=STEP_S, viscosity_mm2_s=300.0)
    assert tank.engine.iterations == [Iterations(0.5, 3)]
    tank.wait(0.6)
    assert np.mean([np.linalg.norm(tank.velocity_mm_s, axis=1).mean() for _ in tank.run(0.2)]) < 6.0
