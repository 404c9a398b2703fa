"""Flow between plates, free clouds and the cases of ``benchmarks/physics.py``, by closed forms and symmetries."""

import numpy as np
import pytest

from benchmarks.channels import Channel
from benchmarks.loose_fluid import filled_box_mm
from benchmarks.physics import CASES
from sealtwin.core.records import Floats
from tests.support.small_fluids import FRAME_S, prepared
from tests.support.tanks import Pit, Tank, raised


@pytest.mark.parametrize(
    ("viscosity_mm2_s", "yield_mm2_s2"), [(32.2, 0.0), (322.0, 0.0), (32.2, 7100.0)], ids=["U 30", "U 300", "12 Pa"]
)
def test_viscosity_conserves_linear_and_angular_momentum_of_a_cloud(viscosity_mm2_s, yield_mm2_s2):
    """The cloud turns with random velocities for 11 ms; particles overlap, so that densities differ.

    Without the last shift of a solve the first change is 1e-4; with forces that are not central the second is 0.1.
    """
    cube = filled_box_mm((0.0, -3.0, 0.0), (6.0, 3.0, 6.0), 0.4)
    random = np.random.default_rng(3)
    position_mm = raised(cube + random.uniform(-0.15, 0.15, cube.shape), 30.0)
    paste = {"viscosity_mm2_s": viscosity_mm2_s, "yield_mm2_s2": yield_mm2_s2}
    tank = Tank.of(Pit(8.0, 8.0, 4.0), position_mm, radius_mm=0.4, step_s=FRAME_S / 4, falls=True, **paste)
    away = position_mm - position_mm.mean(axis=0)
    turn = 20.0 * np.column_stack([-away[:, 1], away[:, 0], 0 * away[:, 0]])
    tank.set_velocity(turn + random.normal(0.0, 40.0, position_mm.shape))

    def momenta() -> tuple[Floats, Floats]:
        """Means over the particles: velocity, and angular momentum about their middle."""
        position_mm, velocity = tank.place_mm, tank.velocity_mm_s
        about = np.cross(position_mm - position_mm.mean(axis=0), velocity - velocity.mean(axis=0))
        return velocity.mean(axis=0), about.mean(axis=0)

    before, rms_mm_s = momenta(), np.sqrt((tank.velocity_mm_s**2).sum(axis=1).mean())
    engine = prepared(tank.engine)
    for _ in range(6):
        if yield_mm2_s2:
            engine.viscosity.measure_shear(engine.rows)
        engine.viscosity.solve_implicit(engine.rows)
    pushed, turned = (after - once for after, once in zip(momenta(), before, strict=True))
    assert np.abs(pushed).max() / rms_mm_s < 1e-5
    assert np.linalg.norm(turned) / np.linalg.norm(before[1]) < 0.01


@pytest.mark.parametrize("channel", [Channel(5.0, 3000.0), Channel(8.0, 226.0, 0.2, index=0.5, radius_mm=0.25)])
def test_flow_between_plates_has_the_mean_speed_of_the_closed_form(channel):
    """The fluids are Newton's and Herschel and Bulkley's; Bingham's takes long and is in the benchmark.

    If particles moved before the viscosity acts, the Newtonian fluid would be 5.5 times as fast.
    """
    mean_mm_s, exact_mm_s = channel.flow(0.15)
    assert mean_mm_s / exact_mm_s == pytest.approx(1.0, abs=0.1)


def test_paste_between_plates_does_not_flow_below_its_yield_stress():
    """Without sleep it creeps at the slowest shear that float32 allows, 0.002 /s."""
    creep_mm_s, _ = Channel(8.0, 32.0, 1.2, mean_mm_s=6.0).flow(0.15, sleep=False)
    assert 0 <= creep_mm_s < 0.01


SLOW = ("hydrostatic", "sloshing", "shear_wave", "slot_current", "channel", "bingham", "herschel")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in CASES]
)
def test_each_case_of_the_physics_benchmark_meets_its_tolerances(name):
    """Seen to fail with a volume factor of 1, 2 lambda_i in a pair, twice the resistance or gamma^2, and half of g."""
    assert [row.name for row in CASES[name]() if row.missed] == []
