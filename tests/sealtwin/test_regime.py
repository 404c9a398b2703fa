"""Numbers of a flow against those worked out by hand."""

import pytest

from sealtwin.core.regime import regime_of

PAPER = {"density_kg_m3": 1690.0, "speed_mm_s": 70.8, "nozzle_mm": 2.4, "width_mm": 3.1}


def test_the_papers_paste_flows_slowly_and_is_held_by_its_yield_stress():
    """32 mm2/s and 12 Pa: 70.8 * 2.4 / 32 = 5.3; 1690 * 9.81 * 0.0031^2 / 0.072 = 2.2; 12 / 1.6 Pa = 7.5."""
    regime = regime_of(viscosity_m2_s=3.2e-5, yield_stress_pa=12.0, **PAPER)
    assert regime.reynolds == pytest.approx(5.3, abs=0.05)
    assert regime.bond == pytest.approx(2.21, abs=0.01)
    assert regime.bingham == pytest.approx(7.5, abs=0.1)


def test_a_fluid_without_viscosity_has_no_number_that_divides_by_it():
    regime = regime_of(viscosity_m2_s=0.0, yield_stress_pa=0.0, **PAPER)
    assert (regime.reynolds, regime.bingham) == (None, None)
    assert regime.bond > 0


def test_a_paste_that_thins_has_the_viscosity_of_its_shear_in_the_nozzle():
    """K over density at 1/s; 70.8 / 2.4 = 29.5 /s, where n = 0.5 leaves 0.184 of it: Reynolds 5.3 / 0.184."""
    regime = regime_of(viscosity_m2_s=3.2e-5, yield_stress_pa=12.0, **PAPER, flow_index=0.5)
    assert regime.reynolds == pytest.approx(5.31 / 0.1841, rel=0.01)
    assert regime.bingham == pytest.approx(7.52 / 0.1841, rel=0.01)
