"""The judge of the fluid: what a tolerance means, and which order of convergence three sizes show."""

from unittest.mock import Mock

import numpy as np
import pytest

from benchmarks.physics_findings import Finding, reported, within
from benchmarks.physics_flow import REFINED, _worst, convergence_index
from benchmarks.physics_rest import pressure_at
from benchmarks.physics_tanks import Pit, Tank, resolution
from benchmarks.physics_yield import WIDTH_MM, _crept_mm
from simulate.fluid.solver import SLOWEST_SHEAR
from simulate.settings import particle_volume


def test_a_figure_passes_inside_its_tolerance_and_nowhere_else():
    band = within("width", 10.4, "mm", 10.0, 0.05, "a ruler")
    assert band.met
    assert band.judged
    assert within("width", 10.6, "mm", 10.0, 0.05, "a ruler").missed
    assert within("width", 9.4, "mm", 10.0, 0.5, "a ruler", share=False).missed
    assert Finding("width", float("nan"), "mm", 9.5, 10.5, "10", "a ruler").missed
    assert Finding("width", 3.0, "mm", 0, 2.0, "10", "a ruler").missed
    assert not reported("width", 3.0, "mm", "10", "a ruler").judged


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_the_index_of_convergence_is_roaches(order):
    """Of f = 2 + 0.3 R^p it finds p, and 1.25 times the error that the finest has, relative."""
    coarse, middle, fine = (2 + 0.3 * REFINED ** (order * power) for power in (2, 1, 0))
    index = convergence_index(coarse, middle, fine)
    assert f"order {order:.1f}" in index.name
    assert index.value == pytest.approx(100 * 1.25 * 0.3 / 2.3)


@pytest.mark.parametrize(("three", "words"), [((1.0, 1.2, 1.1), "oscillatory"), ((1.0, 1.1, 1.3), "no order")])
def test_what_does_not_converge_gets_no_index(three, words):
    assert words in convergence_index(*three).goal


def test_an_awake_bank_creeps_by_its_law():
    """Its place by small steps of dy / dt, from just under the limit; seen to fail with the root left out of it."""
    length_mm, creep_mm_s, step_s = 20.0, SLOWEST_SHEAR * WIDTH_MM / 2, 1e-3
    lower = 1e-6
    for _ in range(10_000):
        lower += step_s * creep_mm_s / length_mm / np.sqrt(2 * lower)
    assert _crept_mm(10.0, length_mm) == pytest.approx(length_mm * lower, rel=0.01)


def test_the_law_of_local_pressure_has_the_squares_of_its_kernel():
    """8100 / pi / 105 over h^5 is the integral of (45 / (pi h^6) (h - r)^2)^2, and C = 0.1 holds 1.15 times as much."""
    h = 1.6
    r = np.linspace(0, h, 20_001)
    squares = np.trapezoid(4 * np.pi * r**2 * (45 / np.pi / h**6 * (h - r) ** 2) ** 2, r)
    assert squares == pytest.approx(8100 / np.pi / 105 / h**5, rel=1e-6)
    tank = Tank.of(Pit(4.0, 4.0, 4.0), np.array([[2.0, 0.0, 1.0]]), radius_mm=0.4, step_s=2e-3)
    volume_mm3 = 1.07 * particle_volume(0.4)
    expected_pa = 4 * 0.115 / (volume_mm3 * squares + 1.5 / h**2) / 2e-3**2
    assert pressure_at(0.1, tank) == pytest.approx(expected_pa, rel=1e-4)


@pytest.mark.parametrize(
    ("preset", "radius_mm", "width_mm", "becomes_mm", "longer", "measured"),
    [
        ("accurate", 0.4, 3.1, 0.4, 1.0, 4),
        ("draft", 0.4, 3.1, 0.596, 1.4589, 2),  # 3.1 / 5.2
        ("draft", 0.4, 8.0, 0.4 * 4 / 2.6, 1.4825, 2),
        ("draft", 0.6, 3.1, 0.6, 1.1952, 2),  # sqrt(0.05 / 0.035)
    ],
)
def test_a_tank_of_a_draft_has_its_particles_and_substeps_and_measures_shear_once_a_frame(
    preset, radius_mm, width_mm, becomes_mm, longer, measured
):
    how = resolution(preset, radius_mm, 2e-3, width_mm)
    assert (how["radius_mm"], how["step_s"]) == (pytest.approx(becomes_mm), pytest.approx(2e-3 * longer, rel=1e-4))
    tank = Tank.of(Pit(4.0, 4.0, 4.0), np.array([[2.0, 0.0, 1.0]]), yield_mm2_s2=7e3, **how)
    tank.engine.viscosity.measure_shear = shear = Mock(wraps=tank.engine.viscosity.measure_shear)
    tank.wait(4 * tank.step_s)
    assert (tank.steps, shear.call_count) == (4, measured)
    assert tank.step_s == pytest.approx(how["step_s"])


def test_a_dam_is_off_a_table_by_its_share_of_the_place():
    front = np.column_stack([np.linspace(0, 4, 41), 1 + np.linspace(0, 4, 41)])
    assert _worst(front, np.array([[1.0, 2.0], [2.0, 2.5]])) == pytest.approx(20.0)
