"""Walls to which fluid sticks: the weight of their drag that follows from a viscosity in physical units."""

from math import erf, exp, pi, sqrt

import numpy as np
import pytest

from benchmarks.physics_tanks import Pit, settled_mm
from sealtwin.core.records import Floats
from simulate.settings import Fluid
from simulate.setup.rheology import no_slip_weight
from simulate.setup_checks import effective_d_cm, rheology_of
from tests.fluids import FRAME_S, engine_with, path, pour, prepared, slot

WIDTH_MM, LENGTH_MM, DEPTH_MM, RADIUS_MM = 3.1, 18.0, 14.0, 0.4
SUPPORT_CM = 4 * RADIUS_MM / 10


def test_drag_that_stands_for_no_slip_grows_with_viscosity_and_step_alone():
    """D is a length: at twice the radius, four times the viscosity and the same step it is twice as long.

    Its size in closed form: D = nu dt / (I h), I = 4 sqrt(pi) times the integral of (exp(-(u + 1/4)^2) - 1/e) u from 0
    to 3/4.
    """
    once = no_slip_weight(30.0, 1.6, 2e-3)
    assert no_slip_weight(60.0, 1.6, 2e-3) == pytest.approx(2 * once)
    assert no_slip_weight(120.0, 3.2, 2e-3) == pytest.approx(2 * once)
    gauss = (exp(-1 / 16) - exp(-1)) / 2 - sqrt(pi) / 8 * (erf(1) - erf(0.25))
    integral = 4 * sqrt(pi) * (gauss - exp(-1) * 9 / 32)
    assert once == pytest.approx(0.06 / integral / 1.6, rel=1e-4)


def test_a_viscosity_brings_its_walls_and_a_weight_that_is_given_stands():
    """54 mPa s at 1690 kg/m3 are 0.3195 cm2/s."""
    fluid = Fluid(viscosity_pa_s=0.054, freeze_after_s="never")
    expected = no_slip_weight(0.054 / 1690.0 * 1e4, SUPPORT_CM, FRAME_S)
    assert effective_d_cm(fluid, rheology_of(fluid, SUPPORT_CM, FRAME_S), SUPPORT_CM, FRAME_S) == pytest.approx(
        expected
    )
    assert rheology_of(fluid, SUPPORT_CM, FRAME_S).sticks
    given = Fluid(viscosity_pa_s=0.054, D_cm=0.2, freeze_after_s="never")
    assert effective_d_cm(given, rheology_of(given, SUPPORT_CM, FRAME_S), SUPPORT_CM, FRAME_S) == 0.2
    assert not rheology_of(given, SUPPORT_CM, FRAME_S).sticks


DRIVEN_MM_S2 = 1000.0


@pytest.fixture(scope="module")
def packed_mm() -> Floats:
    """A slot four particles wide, as packed as a liquid, floor at z = 0."""
    return settled_mm(Pit(LENGTH_MM, WIDTH_MM, DEPTH_MM + 4), RADIUS_MM, FRAME_S / 4, DEPTH_MM)


@pytest.mark.broad
@pytest.mark.parametrize(("viscosity_mm2_s", "substeps"), [(32.2, 80), (322.0, 30), (2700.0, 20)])
def test_a_viscosity_in_physical_units_flows_between_plates_as_poiseuille_says(packed_mm, viscosity_mm2_s, substeps):
    """A force along the slot until the flow is steady; half-way between its ends, floor and surface; particles stay.

    It is some 10 % fast at four abreast, alike at all viscosities: particles of 0.8 mm across 3.1. With D = 0.3, which
    was taken for any viscosity before, it is 0.38, 1.37 and 8.1 times as fast as the theory.
    """
    fluid = Fluid(viscosity_pa_s=viscosity_mm2_s * 1e-3, density_kg_m3=1000.0, freeze_after_s="never")
    pit = Pit(LENGTH_MM, WIDTH_MM, DEPTH_MM + 4)
    engine = engine_with(
        packed_mm - [0, 0, pit.depth_mm],
        pit.crack,
        fluid=rheology_of(fluid, SUPPORT_CM, FRAME_S),
        radius_mm=RADIUS_MM,
        reach_mm=pit.box_mm,
    )
    prepared(engine)
    velocity_mm_s = engine.state.velocity_mm_s()
    for _ in range(substeps):
        velocity_mm_s[:, 0] += DRIVEN_MM_S2 * engine.step_s
        engine.state.velocity.assign((velocity_mm_s / 10).astype(np.float32))
        engine.viscosity.solve_implicit(engine.rows)
        velocity_mm_s = engine.state.velocity_mm_s()
    x, y, z = packed_mm.T
    middle = (np.abs(x - LENGTH_MM / 2) < 3) & (z > 5) & (z < DEPTH_MM - 1)
    theory_mm_s = DRIVEN_MM_S2 / (2 * viscosity_mm2_s) * ((WIDTH_MM / 2) ** 2 - y[middle] ** 2)
    assert 0.9 < velocity_mm_s[middle, 0].mean() / theory_mm_s.mean() < 1.2


def test_a_run_records_the_drag_in_effect_and_where_it_comes_from():
    crack = slot(12.0)
    trajectory = path(crack[1], 0.02, speed_mm_s=40.0)
    by_unit = pour(crack, trajectory, Fluid(viscosity_pa_s=0.054, freeze_after_s="never"), radius_mm=0.6)
    recorded = by_unit.settings["fluid"]
    expected = no_slip_weight(0.054 / 1690.0 * 1e4, 0.24, by_unit.health.recorded()["frame_s"])
    assert recorded["D_cm"] == by_unit.health.recorded()["D_cm"] == pytest.approx(expected)
    assert recorded["D_from"] == "no slip"
    by_weight = pour(crack, trajectory, Fluid(U=30.0, freeze_after_s="never"), radius_mm=0.6)
    assert by_weight.settings["fluid"]["D_cm"] == by_weight.health.recorded()["D_cm"] == 0.3
    assert "D_from" not in by_weight.settings["fluid"]
