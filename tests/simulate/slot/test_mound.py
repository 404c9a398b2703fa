"""The mound of paste under the nozzle's last position."""

import numpy as np
import pytest

from simulate.slot.fill import mound_mm2
from simulate.slot.sections import Trapezoids, sections_of
from tests.support.small_fluids import slot

HELD_MM = 0.4
UNDER = {"held_mm": HELD_MM, "middle_mm": 30.0, "nozzle_mm": 2.4, "surface_mm": -4.0}


def upright(cells: int = 600) -> Trapezoids:
    solid, outline = slot(60.0, 5.0, 12.0, "vertical", 0.0)
    return sections_of(outline, solid, cells, reach_per_mm=1.0)


def test_a_mound_of_paste_has_the_height_and_flanks_of_the_closed_form():
    """It is 4 tau / rho g high under the nozzle; outside, the square of the height falls by 2 tau / rho g per mm."""
    sections = upright()
    rise_mm = mound_mm2(sections, 1e4, **UNDER) / 5.0
    assert rise_mm.max() == pytest.approx(4 * HELD_MM)
    flank = (sections.s_mm > 31.3) & (rise_mm > 0)
    np.testing.assert_allclose(np.diff(rise_mm[flank] ** 2) / sections.step_mm, -2 * HELD_MM, rtol=1e-6)
    assert sections.s_mm[rise_mm > 0].max() == pytest.approx(30 + 1.2 + 8 * HELD_MM, abs=0.1)
    np.testing.assert_allclose(rise_mm, rise_mm[::-1], atol=1e-9)
