"""Walls to which fluid sticks: the weight of their drag that follows from a viscosity in physical units."""

from math import erf, exp, pi, sqrt

import pytest

from simulate.setup.rheology import no_slip_weight
from simulate.setup_checks import effective_d_cm, rheology_of
from tests.support.small_fluids import FRAME_S, path, pour, sealant, slot

SUPPORT_CM = 0.16


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


@pytest.mark.parametrize("d_cm", [None, 0.2])
def test_a_viscosity_brings_its_walls_and_a_weight_that_is_given_stands(d_cm):
    """54 mPa s at 1690 kg/m3 are 0.3195 cm2/s."""
    fluid = sealant(viscosity_pa_s=0.054, D_cm=d_cm)
    rheology = rheology_of(fluid, SUPPORT_CM, FRAME_S)
    expected = d_cm or pytest.approx(no_slip_weight(0.054 / 1690.0 * 1e4, SUPPORT_CM, FRAME_S))
    assert effective_d_cm(fluid, rheology, SUPPORT_CM, FRAME_S) == expected
    assert rheology.sticks == (d_cm is None)


def test_a_run_records_the_drag_in_effect_and_where_it_comes_from():
    crack = slot(12.0)
    trajectory = path(crack[1], 0.02, speed_mm_s=40.0)
    by_unit, by_weight = (
        pour(crack, trajectory, sealant(**fluid), radius_mm=0.6) for fluid in ({"viscosity_pa_s": 0.054}, {"U": 30.0})
    )
    expected = no_slip_weight(0.054 / 1690.0 * 1e4, 0.24, by_unit.health.recorded()["frame_s"])
    for run, d_cm, origin in ((by_unit, pytest.approx(expected), "no slip"), (by_weight, 0.3, None)):
        assert run.settings["fluid"]["D_cm"] == run.health.recorded()["D_cm"] == d_cm
        assert run.settings["fluid"].get("D_from") == origin
