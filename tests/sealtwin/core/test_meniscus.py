"""The meniscus between two walls, against its closed forms in a narrow and in a wide crack."""

import numpy as np
import pytest

from sealtwin.core.regime import capillary_length_mm, mean_level_mm, raise_and_height_mm


def test_in_a_narrow_crack_it_is_half_a_circle():
    mean_mm, wall_mm = raise_and_height_mm(0.02, 1.75)
    assert wall_mm == pytest.approx(0.01, rel=1e-3)
    assert mean_mm == pytest.approx(0.01 * (1 - np.pi / 4), rel=1e-3)


def test_in_a_wide_crack_each_wall_lifts_its_surface_tension_in_weight():
    """Two walls hold 2 gamma / (rho g) of area, and lift the edge by sqrt(2) capillary lengths."""
    for width_mm in (60.0, 104.9, 105.1):
        mean_mm, wall_mm = raise_and_height_mm(width_mm, 1.75)
        assert wall_mm == pytest.approx(1.75 * np.sqrt(2), rel=1e-3)
        assert mean_mm * width_mm == pytest.approx(2 * 1.75**2, rel=1e-3)


@pytest.mark.parametrize("width_mm", [0.5, 3.1, 8.0])
def test_weight_and_curvature_carry_what_the_walls_pull(width_mm):
    """The force balance of the liquid above its lowest line, by the profile integrated step by step."""
    capillary_mm = 1.75
    mean_mm, wall_mm = raise_and_height_mm(width_mm, capillary_mm)
    # z(phi = 90 degrees) = l^2 (sqrt(k^2 + 2 / l^2) - k) gives the curvature k at the lowest line.
    curvature = (2 * capillary_mm**2 - wall_mm**2) / (2 * wall_mm * capillary_mm**2)
    assert mean_mm * width_mm == pytest.approx(capillary_mm**2 * (2 - width_mm * curvature), rel=1e-6)


def test_it_flattens_at_the_brim_and_is_absent_without_surface_tension():
    levels_mm = np.array([-10.0, -0.2, 0.0])
    capillary_mm = capillary_length_mm(0.03, 998)
    assert capillary_mm == pytest.approx(1.75, abs=0.01)
    lifted_mm = mean_level_mm(levels_mm, 3.1, capillary_mm) - levels_mm
    assert lifted_mm[0] == pytest.approx(raise_and_height_mm(3.1, capillary_mm)[0])
    assert 0 < lifted_mm[1] < lifted_mm[0]
    assert lifted_mm[2] == 0
    assert mean_level_mm(levels_mm, 3.1, 0.0) == pytest.approx(levels_mm)
