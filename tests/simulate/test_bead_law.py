"""The law of a bead by its outline, compared with closed forms of a disc and of an endless ridge."""

import math

import numpy as np
import pytest

from simulate.bead_law import STRETCH, PasteArea, laid_section, slumped_stress
from simulate.spread_law import GRAVITY_M_S2, flat_stress_pa

ONE, NO = np.ones(1), np.zeros(1)


def capsule(straight_mm: float, half_mm: float, cells: int = 2000) -> PasteArea:
    """A capsule's area by depth, and that of the ridge in its middle."""
    inward = (np.arange(cells) + 0.5) / cells * half_mm
    ridge = np.full(cells, 2 * half_mm / cells)
    area = ridge * straight_mm + 2 * np.pi * (half_mm - inward) * half_mm / cells
    return PasteArea(inward, area, 2 * straight_mm + 2 * np.pi * half_mm, 10 * ridge, 10.0)


def test_a_disc_and_an_endless_ridge_agree_with_their_closed_forms():
    """The disc has Roussel and Coussot's stress.

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


def test_a_bead_with_its_edge_moved_outward_equals_a_wider_bead():
    narrow, wide = capsule(30.0, 8.0), capsule(30.0, 8.2)
    volumes = narrow.volume_mm3(0.5 * ONE, ONE, 0.2 * ONE, STRETCH)
    assert np.ravel(volumes) == pytest.approx(np.ravel(wide.volume_mm3(0.5 * ONE, ONE, NO, STRETCH)), rel=2e-3)
    # With all lengths doubled, stress over weight included, the volume is eight times as large.
    large = narrow.volume_mm3(1.0 * ONE, 2 * ONE, NO, STRETCH)
    assert large[0] == pytest.approx(8 * narrow.volume_mm3(0.5 * ONE, ONE, NO, STRETCH)[0])


def test_corrections_of_a_laid_bead_are_below_15_percent_and_dimensionless():
    stiff, soft = (slumped_stress(k * ONE, 64.0 * ONE)[0] / k for k in (1.2, 0.5))
    assert 0.94 < soft < 1 < stiff < 1.15
    assert slumped_stress(2.4 * ONE, 256.0 * ONE)[0] == pytest.approx(2 * slumped_stress(1.2 * ONE, 64.0 * ONE)[0])
    assert 1.03 < laid_section(0.8 * ONE, 64.0 * ONE)[0] / 64 < 1.12
