"""A scan of an empty crack gives its depths and walls as far as they are seen, and says what is not."""

import re
from dataclasses import fields

import numpy as np
import pytest

import sealtwin as st
from sealtwin.api.samples import CrackOutline
from sealtwin.core.errors import InputError
from tests.support.scan_beds import OUTLINE, bed

CORNERS_MM = ((-8.0, -8.0), (48.0, -8.0), (35.0, 9.0))
POINTS = [{"name": f"{x}", "scan": (x, y, 0.0), "sample_mm": (x, y)} for x, y in CORNERS_MM]


@pytest.fixture
def build(tmp_path):
    def build(points_mm):
        np.savetxt(tmp_path / "empty.xyz", points_mm, fmt="%.4f")
        parts = {field.name: getattr(OUTLINE, field.name) for field in fields(OUTLINE)}
        crack = CrackOutline(**parts, photo=None, data="synthetic", sha256="")
        placement = {"units": "mm", "up": "z", "points": POINTS}
        return st.build_solid(crack, depth_mm=20.0, tilt="vertical", scan=tmp_path / "empty.xyz", placement=placement)

    return build


def empty(tilt_deg, depth_mm=6.0):
    """Return a scan of walls that close downward by an angle, and of the floor."""
    points_mm = bed(lambda s_mm: np.full_like(s_mm, -depth_mm), spacing_mm=0.15)
    y_mm = [np.interp(points_mm[:, 0], *wall.T) for wall in (OUTLINE.left_wall_mm, OUTLINE.right_wall_mm)]
    inside_mm = np.minimum(y_mm[0] - points_mm[:, 1], points_mm[:, 1] - y_mm[1])
    wall_mm = -inside_mm / np.tan(np.radians(tilt_deg))
    points_mm[:, 2] = np.where(points_mm[:, 2] < -1, np.maximum(wall_mm, points_mm[:, 2]), points_mm[:, 2])
    return points_mm


def test_depths_and_walls_of_an_empty_crack_are_those_of_its_scan(build):
    """Cells of 0.2 mm across walls that are 0.6 mm wide blur their angle by some degrees."""
    with pytest.warns(RuntimeWarning) as shown:
        solid = build(empty(8.0))
    assert any("walls are those of the scan" in str(fact.message) for fact in shown)
    assert any("6.0 mm deep, but crack.depth_mm 20.0 mm" in str(fact.message) for fact in shown)
    assert solid.tilt == "funnel"
    assert solid.wall_angles_deg == pytest.approx((8.0, 8.0), abs=2.5)
    assert solid.depth_at_mm(np.array([10.0, 30.0])) == pytest.approx([6.0, 6.0], abs=0.1)


def test_a_floor_that_is_not_seen_keeps_its_declared_depth_with_a_warning(build):
    points_mm = empty(0.01)
    hidden = (points_mm[:, 0] > 20) & (points_mm[:, 2] < -1)
    with pytest.warns(RuntimeWarning) as shown:
        solid = build(points_mm[~hidden])
    assert any(re.search("does not show the floor along 5.% of the crack", str(fact.message)) for fact in shown)
    assert solid.depth_at_mm(np.array([10.0, 35.0])) == pytest.approx([6.0, 20.0], abs=0.1)


def test_a_scan_that_shows_no_floor_is_refused(build):
    points_mm = empty(0.01)
    with pytest.raises(InputError, match="floor of the crack is not seen"):
        build(points_mm[points_mm[:, 2] > -1])
