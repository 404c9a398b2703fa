"""Sections along the crack: closed forms of its slots, and together its cavity."""

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid import build_solid
from sealtwin.files import read_solid, write_solid
from sealtwin.records import Solid
from tests.shapes import CUT, cut_crack, straight_slot, wandering_crack

W = 3.1
SLOPE = np.tan(np.radians(5.0))


def total_mm3(solid: Solid) -> float:
    return float(np.trapezoid(solid.sections.area_mm2, solid.sections.s_mm))


@pytest.mark.parametrize(
    ("tilt", "area_mm2"),
    [
        ("vertical", 12.0 * W),
        ("lean", 12.0 * W),
        ("flare", 12.0 * W + SLOPE * 12.0 * (2 * 16.0 - 12.0)),
        ("funnel", 12.0 * W - SLOPE * 12.0**2),
    ],
)
def test_a_section_is_what_stands_between_two_walls_and_a_floor(tilt, area_mm2):
    """Half way up a floor that rises from 16 to 8 mm; a flare's walls start from the deepest place."""
    shape = CrackShape(depth_mm=((0.0, 16.0), (80.0, 8.0)), tilt=tilt, wall_angle_deg=5.0)
    sections = build_solid(straight_slot(80.0, W, CUT), shape).sections
    middle = int(np.argmin(np.abs(sections.s_mm - 40.0)))
    assert sections.depth_mm[middle] == pytest.approx(12.0)
    assert sections.area_mm2[middle] == pytest.approx(area_mm2)


@pytest.mark.parametrize("tilt", ["vertical", "lean", "flare", "funnel"])
@pytest.mark.parametrize("depth_mm", [16.0, ((0.0, 16.0), (40.0, 6.0), (80.0, 12.0))], ids=["level", "table"])
def test_sections_add_up_to_the_cavity(tilt, depth_mm):
    """Within 2 %: a bend gives its outer wall more than its inner one, and a flare most of all."""
    shape = CrackShape(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=5.0)
    for outline in (wandering_crack(1), cut_crack(2, length_mm=80.0)):
        solid = build_solid(outline, shape)
        assert total_mm3(solid) == pytest.approx(solid.cavity_volume_mm3, rel=0.02)


def test_a_funnel_that_closes_has_no_section_below():
    solid = build_solid(
        straight_slot(80.0, W, CUT), CrackShape(depth_mm=16.0, tilt="funnel", wall_angle_deg=(6.0, 14.0))
    )
    closing = np.tan(np.radians([6.0, 14.0])).sum()
    assert solid.sections.area_mm2 == pytest.approx(np.full(81, W**2 / (2 * closing)))


def test_sections_come_back_from_the_folder(tmp_path):
    solid = build_solid(wandering_crack(1), CrackShape(depth_mm=((0.0, 16.0), (40.0, 6.0)), tilt="lean"))
    write_solid(tmp_path, solid)
    again = read_solid(tmp_path)
    for name in ("s_mm", "depth_mm", "area_mm2"):
        assert getattr(again.sections, name) == pytest.approx(getattr(solid.sections, name), abs=1e-5)
    assert again.wall_angles_deg == solid.wall_angles_deg
