"""Sections along the crack and across its depth: closed forms, and together the cavity."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.records import Floats
from tests.support.section_volumes import cavity_volume_mm3
from tests.support.shapes import CUT, closed_crack, cut_crack, straight_slot, wandering_crack

W = 3.1
SLOPE = np.tan(np.radians(5.0))


@pytest.mark.parametrize(
    ("tilt", "area_mm2"),
    [
        ("vertical", 12.0 * W),
        ("lean", 12.0 * W),
        ("flare", 12.0 * W + SLOPE * 12.0 * (2 * 16.0 - 12.0)),
        ("funnel", 12.0 * W - SLOPE * 12.0**2),
        ("undercut", 12.0 * W + SLOPE * 12.0**2),
    ],
)
def test_a_section_is_what_stands_between_two_walls_and_a_floor(tilt, area_mm2):
    """Half way up a floor that rises from 16 to 8 mm; a flare's walls start from the deepest place."""
    shape = CrackShape(depth_mm=((0.0, 16.0), (80.0, 8.0)), tilt=tilt, wall_angle_deg=5.0)
    sections = build_solid(straight_slot(80.0, W, CUT), shape).sections
    middle = int(np.argmin(np.abs(sections.s_mm - 40.0)))
    assert sections.depth_mm[middle] == pytest.approx(12.0)
    assert sections.area_mm2[middle] == pytest.approx(area_mm2)


def block(x_mm: float, y_mm: float, length_mm: float, width_mm: float) -> Floats:
    """A rectangular stone, clockwise."""
    half = np.array([length_mm, width_mm]) / 2
    return np.array([x_mm, y_mm]) + half * np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)])


@pytest.mark.parametrize(
    ("tilt", "angle_deg", "within"),
    [
        ("lean", 5.0, 0.02),
        ("flare", 5.0, 0.02),
        # A larger angle lets the stone of 1.2 mm hang.
        ("undercut", 2.0, 0.02),
        # 4.5 % too much without what stones take by growing longer downward; 1 % for stations a millimetre apart.
        ("funnel", (2.0, 9.0), 0.012),
    ],
)
def test_sections_among_stones_add_up_to_the_cavity(tilt, angle_deg, within):
    """Stones of a fifth of the mouth; one is a ridge under the face of the flare, one stands over a shallow floor."""
    stones = (block(10.0, 0.0, 7.0, 1.2), block(30.0, 1.0, 9.0, 3.0), block(30.0, -2.0, 5.0, 1.0))
    outline = replace(straight_slot(40.0, 7.0, CUT), islands_mm=stones)
    for depth_mm in (12.0, ((0.0, 12.0), (40.0, 5.0))):
        solid = build_solid(outline, CrackShape(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=angle_deg))
        total_mm3 = np.trapezoid(solid.sections.area_mm2, solid.sections.s_mm)
        assert total_mm3 == pytest.approx(solid.cavity_volume_mm3, rel=within)


HILLS = ((0, 6), (20, 16), (40, 10))


@pytest.mark.parametrize(
    ("outline", "tilt", "depth_mm"),
    [
        (wandering_crack(), "lean", 16.0),
        (wandering_crack(), "undercut", HILLS),
        (closed_crack(), "flare", HILLS),
        (closed_crack(), "undercut", 16.0),
        (cut_crack(), "funnel", 16.0),
        (cut_crack(), "vertical", HILLS),
    ],
)
def test_the_mesh_encloses_the_integral_of_the_sections(outline, tilt, depth_mm):
    """Two ways to one volume, within a thousandth: wedges subtracted from a block, and offsets of the outline."""
    shape = CrackShape(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=4.0)
    integral_mm3 = cavity_volume_mm3(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    assert build_solid(outline, shape).cavity_volume_mm3 == pytest.approx(integral_mm3, rel=1e-3)
