"""What paste holds by itself: a mound under the nozzle's last place, and a crown across the crack."""

import numpy as np
import pytest

from simulate.slot.fill import MOST_MOUND, HerschelBulkley, crown_mm, fill, mound_mm2
from simulate.slot.sections import Trapezoids, sections_of
from tests.support.small_fluids import path, slot

HELD_MM = 0.4
UNDER = {"held_mm": HELD_MM, "middle_mm": 30.0, "nozzle_mm": 2.4, "surface_mm": -4.0}


def upright(cells: int = 600) -> Trapezoids:
    solid, outline = slot(60.0, 5.0, 12.0, "vertical", 0.0)
    return sections_of(outline, solid, cells, reach_per_mm=1.0)


def test_a_mound_is_as_high_as_paste_pushed_against_paste_and_its_flanks_are_a_slumps():
    """4 tau / rho g on the nozzle's width; from there the square of its height falls by 2 tau / rho g a millimetre."""
    sections = upright()
    rise_mm = mound_mm2(sections, 1e4, **UNDER) / 5.0
    assert rise_mm.max() == pytest.approx(4 * HELD_MM)
    flank = (sections.s_mm > 31.3) & (rise_mm > 0)
    np.testing.assert_allclose(np.diff(rise_mm[flank] ** 2) / sections.step_mm, -2 * HELD_MM, rtol=1e-6)
    assert sections.s_mm[rise_mm > 0].max() == pytest.approx(30 + 1.2 + 8 * HELD_MM, abs=0.1)
    np.testing.assert_allclose(rise_mm, rise_mm[::-1], atol=1e-9)


def test_a_mound_is_half_of_what_lands_at_most_and_nothing_of_a_liquid():
    sections = upright()
    few_mm3 = mound_mm2(sections, 20.0, **UNDER).sum() * sections.step_mm
    assert few_mm3 == pytest.approx(MOST_MOUND * 20.0)
    assert not mound_mm2(sections, 0.0, **UNDER).any()
    assert not mound_mm2(sections, 1e4, **UNDER | {"held_mm": 0.0}).any()
    assert not crown_mm(np.full(3, 5.0), np.full(3, 12.0), 0.0).any()


def test_a_crown_is_no_thicker_than_the_bed_and_ends_at_the_face():
    """A third of 2 tau / rho g over the mean where there is room for it."""
    height_mm, depth_mm = np.array([-0.1, 0.0, 0.1, 6.0, 11.9, 12.0, 13.0]), np.full(7, 12.0)
    found_mm = crown_mm(height_mm, depth_mm, HELD_MM)
    np.testing.assert_allclose(found_mm, [0, 0, 0.1, 2 * HELD_MM / 3, 0.1, 0, 0], atol=1e-9)


def test_the_level_rises_where_the_nozzle_stops_and_no_sealant_is_made_of_it():
    crack = slot(60.0, 5.0, 12.0)
    trajectory = path(crack[1], 1.0, trim_mm=10.0)
    paste = HerschelBulkley(1690.0, 8.0, 0.3)
    held_mm = 8.0 / paste.weight_pa_mm
    filled = fill(*crack, trajectory, paste, nozzle_mm=2.4, settle_s=3.0)
    assert filled.mass_error < 1e-12
    top = int(filled.level_mm.argmax())
    assert filled.sections.s_mm[top] == pytest.approx(trajectory.s_mm[trajectory.giving][-1], abs=3.0)
    mean_mm = filled.sections.bottom_mm + filled.sections.height_mm(filled.area_mm2)
    assert np.median(filled.level_mm - mean_mm) == pytest.approx(2 * held_mm / 3)
    # The bed below it is the front of what flowed, and slopes as its walls hold it.
    assert filled.level_mm[top] - np.median(filled.level_mm[20:40]) == pytest.approx(4 * held_mm, rel=0.35)
