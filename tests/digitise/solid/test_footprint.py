"""The footprint of a crack with its flat ends, and floors of varying depth."""

import numpy as np
import pytest
from manifold3d import Manifold, Mesh64

from digitise.drawing.given_lines import outline_of_line
from digitise.geometry.mesh_topology import examine_mesh
from digitise.geometry.polyline import signed_area
from digitise.settings import CrackShape, Tilt
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out, sides
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Solid
from tests.digitise.solid.test_build_solid import TILTS
from tests.support.section_volumes import cavity_volume_mm3
from tests.support.shapes import CLOSED, CUT, OPEN, straight_slot


def hook(gap_mm: float, before_mm: float) -> Outline:
    """A crack from the origin along x that comes back beside itself, and runs past its own cut end or across it."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 20)
    bend_mm = np.array([40.0, gap_mm / 2]) + gap_mm / 2 * np.column_stack([np.cos(turn), np.sin(turn)])
    across_mm = [(-before_mm, gap_mm), (-before_mm, -gap_mm)] if before_mm else [(-20.0, gap_mm)]
    return outline_of_line(np.vstack([(0.0, 0.0), bend_mm, across_mm]), np.array([[0.0, 3.0]]), None, "hook")[0]


@pytest.mark.parametrize(
    ("gap_mm", "before_mm", "tilt"),
    [(3.3, 0.0, "funnel"), (10.0, 0.0, "vertical"), (10.0, 3.5, "funnel"), (6.0, 8.0, "vertical")],
)
def test_a_crack_that_bends_back_past_its_cut_end_has_one_cavity(gap_mm, before_mm, tilt):
    """Its volume is that of the sections: the returning part is not filled, and nothing leaks past the cut."""
    outline, shape = hook(gap_mm, before_mm), CrackShape(depth_mm=10.0, tilt=tilt, wall_angle_deg=4.0)
    solid = build_solid(outline, shape)
    expected_mm3 = cavity_volume_mm3(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    if tilt == "vertical":
        assert expected_mm3 == pytest.approx(10.0 * signed_area(outline.outline_mm), rel=1e-3)
    body = Manifold(Mesh64(solid.vertices_mm.copy(), solid.faces.astype(np.uint64)))
    low, high = np.reshape(body.bounding_box(), (2, 3))
    cavity = Manifold.cube(high - low).translate(low) - body
    assert len([room for room in cavity.decompose() if room.volume() > 1e-3]) == 1
    assert cavity.volume() == pytest.approx(expected_mm3, rel=1e-4)


def test_a_crack_that_bends_back_into_its_own_cut_end_is_refused():
    """An undercut widens the returning part, two millimetres before the end, into the end."""
    with pytest.raises(InputError, match=r"cut at \(0\.0, "):
        lay_out(hook(10.0, 3.5), CrackShape(depth_mm=10.0, tilt="undercut", wall_angle_deg=12.0), 2.2)


UP, RIGHT, LEFT = np.array([[0, 1], [1, 0], [-1, 0]], dtype=float)


@pytest.mark.parametrize(("tip_x", "out"), [(40.0, RIGHT), (0.0, LEFT)])
def test_the_share_of_the_left_wall_changes_gradually_around_a_tip(tip_x, out):
    """The share of the left wall is a half straight out and changes by 1/120 per degree of the normal."""
    turned = np.radians(20.0)
    aslant = np.cos(turned) * out + np.sin(turned) * np.array([[1], [-1]]) * UP
    # Away from the tip a point belongs to one wall, whatever its normal.
    points_mm = np.array([(tip_x, 0.4), (tip_x, 0.4), (tip_x, -0.4), (tip_x, 0.4), (20.0, 1.5)])
    shares = sides(straight_slot(40.0, 3.0, CLOSED), 10.0).left_share(points_mm, np.vstack([out, aslant, UP, out]))
    assert shares == pytest.approx([0.5, 0.5 + 20 / 120, 0.5 - 20 / 120, 1.0, 1.0])


Table = tuple[tuple[float, float], ...]
SLOPE = np.tan(np.radians(11.0))
L, W = 80.0, 3.1
HILLS: Table = ((0.0, 6.0), (30.0, 16.0), (50.0, 10.0))


def build(outline: Outline, table: Table, tilt: Tilt = "vertical", **changes) -> Solid:
    solid = build_solid(outline, CrackShape.model_validate({"depth_mm": table, "tilt": tilt} | changes))
    assert examine_mesh(solid.vertices_mm, solid.faces, expected_euler=2)[0] == []
    return solid


def slot_mm3(tilt: Tilt) -> float:
    """Volume of a straight slot above the hills: each section is a trapezium, or a triangle if its walls meet."""
    s_mm = np.linspace(0.0, L, 80_001)
    depth_mm = np.interp(s_mm, *np.array(HILLS).T)
    open_mm = np.minimum(depth_mm, W / (2 * SLOPE)) if tilt == "funnel" else depth_mm
    opening_mm2 = {"flare": 32.0 * open_mm - open_mm**2, "undercut": open_mm**2, "funnel": -(open_mm**2)}
    return float(np.trapezoid(W * open_mm + SLOPE * opening_mm2.get(tilt, 0.0), s_mm))


@pytest.mark.parametrize(("ends", "tilt"), [(OPEN, "flare"), *((CUT, tilt) for tilt in TILTS)])
def test_a_slot_with_a_depth_table_has_the_volume_of_the_closed_form(ends, tilt):
    """The floor's triangles meet at the table's stations, so that no volume is lost."""
    solid = build(straight_slot(L, W, ends), HILLS, tilt)
    assert solid.cavity_volume_mm3 == pytest.approx(slot_mm3(tilt), rel=1e-6)
    assert solid.depth_mm == 16.0
    assert solid.depth_at_mm(np.array([0.0, 15.0, 40.0, 70.0])) == pytest.approx([6.0, 11.0, 13.0, 10.0])


@pytest.mark.parametrize(
    ("to_mm", "to_depth_mm", "keys"),
    [(80.0, 20.0, ["solid.long-table"]), (20.0, 12.0, ["solid.short-table"]), (39.0, 12.0, [])],
)
def test_a_depth_table_longer_or_shorter_than_the_crack_gives_a_warning(to_mm, to_depth_mm, keys):
    """The depth is the largest within the crack: 12 mm of a table that reaches 20 mm."""
    solid = build(straight_slot(40.0, W, CUT), ((0.0, 4.0), (to_mm, to_depth_mm)))
    assert [warning.key for warning in solid.figures.warnings] == keys
    assert solid.depth_mm == pytest.approx(12.0)
    if to_mm == 80.0:
        assert solid.cavity_volume_mm3 == pytest.approx(40.0 * W * 8.0, rel=1e-6)
