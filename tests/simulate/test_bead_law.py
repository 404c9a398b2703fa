"""The law of a bead by its whole outline, against closed forms of the disc and of the endless ridge."""

import math

import numpy as np
import pytest

from simulate.bead_law import STRETCH, PasteArea, laid_section, slumped_stress
from simulate.spread_law import GRAVITY_M_S2, flat_stress_pa

ONE, NO = np.ones(1), np.zeros(1)


def capsule(straight_mm: float, half_mm: float, cells: int = 2000) -> PasteArea:
    """A capsule's area by depth, and of its middle the ridge's."""
    inward = (np.arange(cells) + 0.5) / cells * half_mm
    ridge = np.full(cells, 2 * half_mm / cells)
    area = ridge * straight_mm + 2 * np.pi * (half_mm - inward) * half_mm / cells
    return PasteArea(inward, area, 2 * straight_mm + 2 * np.pi * half_mm, 10 * ridge, 10.0)


def test_a_flat_disc_and_an_endless_ridge_have_their_closed_forms_and_stretching_makes_them_higher():
    """A disc has Roussel and Coussot's stress.

    A flat ridge has A = 4/3 a sqrt(2 k a); with stretching, A is the integral of its height in closed form.
    """
    disc_per_mm = capsule(0.0, 50.0).per_mm(30e3 * ONE, ONE, NO, 0.0)[0]
    assert disc_per_mm * 1e-3 * 1690 * GRAVITY_M_S2 == pytest.approx(
        float(flat_stress_pa(30e3, 50.0, 1690.0)), rel=1e-4
    )
    ridge, half_mm, per_mm = capsule(1e6, 8.0), 8.0, 0.5
    flat = 4 / 3 * half_mm * math.sqrt(2 * per_mm * half_mm)
    c = STRETCH * per_mm
    high = 2 * (c * half_mm + ((c * c + 2 * per_mm * half_mm) ** 1.5 - c**3) / (3 * per_mm))
    for area_mm2, stretch in ((flat, 0.0), (high, STRETCH)):
        assert ridge.per_mm(1e6 * area_mm2 * ONE, ONE, NO, stretch)[0] == pytest.approx(per_mm, rel=1e-4)
        assert ridge.volume_mm3(per_mm * ONE, ONE, NO, stretch)[1][0] == pytest.approx(area_mm2, rel=1e-4)


def test_an_edge_that_lies_farther_out_is_that_of_the_wider_bead():
    narrow, wide = capsule(30.0, 8.0), capsule(30.0, 8.2)
    volumes = narrow.volume_mm3(0.5 * ONE, ONE, 0.2 * ONE, STRETCH)
    assert np.ravel(volumes) == pytest.approx(np.ravel(wide.volume_mm3(0.5 * ONE, ONE, NO, STRETCH)), rel=2e-3)
    # All lengths and the stress over weight twice as long: eight times the volume.
    large = narrow.volume_mm3(1.0 * ONE, 2 * ONE, NO, STRETCH)
    assert large[0] == pytest.approx(8 * narrow.volume_mm3(0.5 * ONE, ONE, NO, STRETCH)[0])


def test_the_correction_turns_with_stiffness_and_needs_no_unit():
    stiff, soft = (slumped_stress(k * ONE, 64.0 * ONE)[0] / k for k in (1.2, 0.5))
    assert 0.94 < soft < 1 < stiff < 1.15
    assert slumped_stress(2.4 * ONE, 256.0 * ONE)[0] == pytest.approx(2 * slumped_stress(1.2 * ONE, 64.0 * ONE)[0])
    assert 1.03 < laid_section(0.8 * ONE, 64.0 * ONE)[0] / 64 < 1.12
