"""Dimensionless numbers of a flow, and the meniscus between two walls."""

import numpy as np
import pytest

from sealtwin.core.regime import capillary_length_mm, mean_level_mm, raise_and_height_mm, regime_of

PAPER = {"density_kg_m3": 1690.0, "speed_mm_s": 70.8, "nozzle_mm": 2.4, "width_mm": 3.1}


@pytest.mark.parametrize(("flow_index", "share"), [(1.0, 1.0), (0.5, 0.1841)])
def test_reynolds_bond_and_bingham_numbers_equal_a_hand_calculation(flow_index, share):
    """32 mm2/s and 12 Pa: 70.8 * 2.4 / 32 = 5.3; 1690 * 9.81 * 0.0031^2 / 0.072 = 2.2; 12 / 1.6 Pa = 7.5.

    A thinning paste has the viscosity at the shear rate of the nozzle, 70.8 / 2.4 = 29.5 /s: 0.184 times K for n = 0.5.
    """
    regime = regime_of(viscosity_m2_s=3.2e-5, yield_stress_pa=12.0, **PAPER, flow_index=flow_index)
    assert regime == pytest.approx((5.31 / share, 2.21, 7.52 / share), rel=0.01)


def test_a_fluid_without_viscosity_has_no_reynolds_and_no_bingham_number():
    regime = regime_of(viscosity_m2_s=0.0, yield_stress_pa=0.0, **PAPER)
    assert regime == (None, pytest.approx(2.21, rel=0.01), None)


@pytest.mark.parametrize(
    ("width_mm", "mean_mm", "wall_mm"),
    [
        pytest.param(0.02, 0.01 * (1 - np.pi / 4), 0.01, id="half a circle in a narrow crack"),
        *((width_mm, 2 * 1.75**2 / width_mm, 1.75 * np.sqrt(2)) for width_mm in (60.0, 104.9, 105.1)),
    ],
)
def test_the_meniscus_equals_the_closed_forms_for_narrow_and_wide_cracks(width_mm, mean_mm, wall_mm):
    """Two walls raise an area of 2 gamma / (rho g), and lift the edge of a wide crack by sqrt(2) capillary lengths."""
    assert raise_and_height_mm(width_mm, 1.75) == pytest.approx((mean_mm, wall_mm), rel=1e-3)


def test_the_meniscus_flattens_at_the_brim_and_is_absent_without_surface_tension():
    levels_mm = np.array([-10.0, -0.2, 0.0])
    capillary_mm = capillary_length_mm(0.03, 998)
    assert capillary_mm == pytest.approx(1.75, abs=0.01)
    lifted_mm = mean_level_mm(levels_mm, 3.1, capillary_mm) - levels_mm
    assert lifted_mm[0] == pytest.approx(raise_and_height_mm(3.1, capillary_mm)[0])
    assert 0 < lifted_mm[1] < lifted_mm[0]
    assert lifted_mm[2] == 0
    assert mean_level_mm(levels_mm, 3.1, 0.0) == pytest.approx(levels_mm)
