"""Floors that rise and fall along the crack, against closed forms and a dense sum."""

import numpy as np
import pytest

from digitise.geometry.mesh_topology import check_mesh
from digitise.settings import CrackShape, Tilt
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_floor
from sealtwin.core.records import FaceLabel, Outline, Solid
from tests.digitise.test_solid import TILTS
from tests.support.shapes import CUT, OPEN, arc_slot, straight_slot

Table = tuple[tuple[float, float], ...]
SLOPE = np.tan(np.radians(11.0))
L, W = 80.0, 3.1
HILLS: Table = ((0.0, 6.0), (30.0, 16.0), (50.0, 10.0))


def build(outline: Outline, table: Table, tilt: Tilt = "vertical", **changes) -> Solid:
    solid = build_solid(outline, CrackShape.model_validate({"depth_mm": table, "tilt": tilt} | changes))
    assert check_mesh(solid.vertices_mm, solid.faces, expected_euler=2) == []
    return solid


def slot_mm3(tilt: Tilt) -> float:
    """Of the hills under a straight slot: each section a trapezium, or the triangle that is left of it."""
    s_mm = np.linspace(0.0, L, 80_001)
    depth_mm = np.interp(s_mm, *np.array(HILLS).T)
    if tilt == "flare":
        area_mm2 = W * depth_mm + 2 * SLOPE * (16.0 * depth_mm - depth_mm**2 / 2)
    elif tilt == "undercut":
        area_mm2 = W * depth_mm + SLOPE * depth_mm**2
    elif tilt == "funnel":
        open_mm = np.minimum(depth_mm, W / (2 * SLOPE))
        area_mm2 = W * open_mm - SLOPE * open_mm**2
    else:
        area_mm2 = W * depth_mm
    return float(np.trapezoid(area_mm2, s_mm))


@pytest.mark.parametrize(("ends", "tilt"), [(OPEN, "flare"), *((CUT, tilt) for tilt in TILTS)])
def test_a_straight_slot_is_as_deep_as_its_table_says(ends, tilt):
    """The floor's triangles meet along the table's own stations, so that nothing is lost to them."""
    solid = build(straight_slot(L, W, ends), HILLS, tilt)
    assert solid.cavity_volume_mm3 == pytest.approx(slot_mm3(tilt), rel=1e-6)
    assert solid.depth_mm == 16.0
    assert solid.depth_at_mm(np.array([0.0, 15.0, 40.0, 70.0])) == pytest.approx([6.0, 11.0, 13.0, 10.0])


def test_lines_across_do_not_cross_inside_a_tight_bend():
    """A loop of radius 3 mm whose cavity reaches past its own centre: every place as deep as its nearest station."""
    outline = arc_slot(3.0, 300.0, 2.0, CUT)
    shape = CrackShape(depth_mm=((0.0, 4.0), (15.7, 20.0)), tilt="flare", wall_angle_deg=10.0)
    floor = lay_floor(outline.centreline_mm, shape, 6.0, (-9.0, -9.0, 9.0, 9.0))
    assert floor is not None
    rng = np.random.default_rng(0)
    away_mm, turn = rng.uniform(0.8, 5.5, 2000), np.radians(rng.uniform(10.0, 290.0, 2000))
    place_mm = away_mm[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    expected_mm = shape.depth_at_mm(3.0 * turn)
    error_mm = np.abs(floor.depth_at_mm(place_mm) - expected_mm)
    # Triangles of a millimetre over lines that fan out: a slope of 1.1 over a few hundredths of a millimetre.
    assert np.median(error_mm) < 0.05
    assert error_mm[away_mm > 2.0].max() < 0.35
    build(arc_slot(3.0, 170.0, 2.0, CUT), ((0.0, 4.0), (8.9, 14.0)), "flare", wall_angle_deg=10.0)


@pytest.mark.parametrize("tilt", TILTS)
def test_the_floor_is_labelled_as_such(tilt):
    """Seen from above it is as large as the cavity is at its level, also where it rises like a wall."""
    table = ((0.0, 4.0), (40.0, 4.0), (40.5, 8.0), (80.0, 8.0))
    solid = build(straight_slot(L, W, CUT), table, tilt, wall_angle_deg=3.0)
    floor = solid.vertices_mm[solid.faces[solid.face_label == FaceLabel.FLOOR]]
    plan_mm2 = np.cross(floor[:, 1] - floor[:, 0], floor[:, 2] - floor[:, 0])[:, 2].sum() / 2
    s_mm = np.linspace(0.0, L, 80_001)
    depth_mm = np.interp(s_mm, *np.array(table).T)
    opening_mm = {"flare": 8.0 - depth_mm, "funnel": -depth_mm, "undercut": depth_mm}
    width_mm = W + 2 * np.tan(np.radians(3.0)) * opening_mm.get(tilt, np.zeros_like(s_mm))
    assert plan_mm2 == pytest.approx(np.trapezoid(width_mm, s_mm), rel=1e-5)
    step = np.abs(floor[:, :, 0].mean(axis=1) - 40.25) < 0.25
    assert np.ptp(floor[step][:, :, 2]) == pytest.approx(4.0, abs=1e-6)


def test_a_waver_of_the_trace_does_not_ripple_the_floor():
    """0.02 mm from station to station turns the raw normals by 10 degrees; the floor's level lines stay straight."""
    s_mm = np.arange(0.0, L + 0.05, 0.1)
    noisy = np.column_stack([s_mm, 0.02 * np.random.default_rng(0).standard_normal(len(s_mm))])
    floor = lay_floor(noisy, CrackShape(depth_mm=((0.0, 2.0), (90.0, 42.0))), 4.0, (0.0, -9.0, L, 9.0))
    assert floor is not None
    across = np.array([(40.0, y) for y in np.linspace(-1.5, 1.5, 31)])
    assert np.ptp(floor.depth_at_mm(across)) < 0.05


@pytest.mark.parametrize(
    ("to_mm", "to_depth_mm", "keys"),
    [(80.0, 20.0, ["solid.long-table"]), (20.0, 12.0, ["solid.short-table"]), (39.0, 12.0, [])],
)
def test_a_table_of_another_length_than_the_crack_is_said(to_mm, to_depth_mm, keys):
    """Its deepest place is the crack's own: 12 mm of a table that goes on to 20."""
    solid = build(straight_slot(40.0, W, CUT), ((0.0, 4.0), (to_mm, to_depth_mm)))
    assert [warning.key for warning in solid.figures.warnings] == keys
    assert solid.depth_mm == pytest.approx(12.0)
    if to_mm == 80.0:
        assert solid.cavity_volume_mm3 == pytest.approx(40.0 * W * 8.0, rel=1e-6)
