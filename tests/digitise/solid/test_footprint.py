"""The crack from above: run out past its flat ends, and which wall each piece of its outline is."""

import numpy as np
import pytest
from manifold3d import Error, Manifold, Mesh64

from digitise.drawing.given_lines import outline_of_line
from digitise.geometry.polyline import signed_area
from digitise.geometry.region import traced_region
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out, sides
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline
from tests.support.section_volumes import cavity_volume_mm3
from tests.support.shapes import CLOSED, straight_slot


def hook(gap_mm: float, before_mm: float) -> Outline:
    """A crack from the origin along x that comes back beside itself, and runs past its own cut end or across it."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 20)
    bend_mm = np.array([40.0, gap_mm / 2]) + gap_mm / 2 * np.column_stack([np.cos(turn), np.sin(turn)])
    across_mm = [(-before_mm, gap_mm), (-before_mm, -gap_mm)] if before_mm else [(-20.0, gap_mm)]
    return outline_of_line(np.vstack([(0.0, 0.0), bend_mm, across_mm]), np.array([[0.0, 3.0]]), None, "hook")[0]


@pytest.mark.parametrize(("gap_mm", "before_mm"), [(3.3, 0.0), (10.0, 0.0), (10.0, 3.5), (6.0, 8.0)])
@pytest.mark.parametrize("tilt", ["vertical", "funnel"])
def test_a_crack_may_come_back_past_its_cut_end(gap_mm, before_mm, tilt):
    """The cavity is one body of the sections' volume: its other part is not filled, and nothing leaks past the cut."""
    outline, shape = hook(gap_mm, before_mm), CrackShape(depth_mm=10.0, tilt=tilt, wall_angle_deg=4.0)
    solid = build_solid(outline, shape)
    expected_mm3 = cavity_volume_mm3(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    if tilt == "vertical":
        assert expected_mm3 == pytest.approx(10.0 * signed_area(outline.outline_mm), rel=1e-3)
    body = Manifold(Mesh64(solid.vertices_mm, solid.faces.astype(np.uint64)))
    assert body.status() == Error.NoError
    low, high = np.reshape(body.bounding_box(), (2, 3))
    cavity = Manifold.cube(high - low).translate(low) - body
    assert len([room for room in cavity.decompose() if room.volume() > 1e-3]) == 1
    assert cavity.volume() == pytest.approx(expected_mm3, rel=1e-4)


def test_a_crack_that_touches_its_cut_end_from_beyond_is_refused():
    """An undercut takes the other part, two millimetres before the end, into the end."""
    with pytest.raises(InputError, match=r"cut at \(0\.0, "):
        lay_out(hook(10.0, 3.5), CrackShape(depth_mm=10.0, tilt="undercut", wall_angle_deg=12.0), 2.2)


def test_the_end_of_a_crack_that_turns_just_before_it_is_square_to_its_cut_and_stops_no_other_part():
    """A lean takes the long leg beyond the plane of the cut, which fills what is within a lean and a width of it."""
    outline, _ = outline_of_line(np.array([(0.0, 0.0), (0.0, 1.0), (40.0, 1.0)]), np.array([[0.0, 0.5]]), None, "turn")
    footprint = lay_out(outline, CrackShape(depth_mm=10.0, tilt="lean", wall_angle_deg=14.0, lean_to="right"), 2.5)
    assert footprint.ends[0].outward == pytest.approx([0.0, -1.0], abs=0.05)
    floor = traced_region(outline.outline_mm)[0].translate(tuple(2.5 * footprint.lean))
    assert (floor ^ footprint.stoppers).area() < 0.1 * floor.area()


UP, DOWN, RIGHT, LEFT = np.array([[0, 1], [0, -1], [1, 0], [-1, 0]], dtype=float)


def share(outline, place: tuple[float, float], outward: Floats) -> float:
    return float(sides(outline, 10.0).left_share(np.array([place]), outward[None])[0])


@pytest.mark.parametrize(("tip_x", "out"), [(40.0, RIGHT), (0.0, LEFT)])
def test_a_tip_goes_over_from_left_to_right(tip_x, out):
    """Straight out it is half of either; what faces up by a third of the way to all left, more of the left."""
    slot = straight_slot(40.0, 3.0, CLOSED)
    assert share(slot, (tip_x, 0.4), out) == pytest.approx(0.5)
    turned = np.radians(20.0)
    assert share(slot, (tip_x, 0.4), np.cos(turned) * out + np.sin(turned) * UP) == pytest.approx(0.5 + 20 / 120)
    assert share(slot, (tip_x, -0.4), np.cos(turned) * out + np.sin(turned) * DOWN) == pytest.approx(0.5 - 20 / 120)
    assert share(slot, (tip_x, 0.4), UP) == 1.0
    # Away from the tip a wall is one or the other, however rough.
    assert share(slot, (20.0, 1.5), out) == 1.0


def test_a_cavity_that_a_sharp_bend_and_its_tilt_make_smaller_is_said():
    outline, _ = outline_of_line(np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0)]), np.array([[0.0, 1.0]]), None, "bend")
    leaning = build_solid(outline, CrackShape(depth_mm=10.0, tilt="lean", wall_angle_deg=11.0))
    assert any("times the volume of its sections" in text.text for text in leaning.figures.warnings)
    assert build_solid(outline, CrackShape(depth_mm=10.0, tilt="vertical")).figures.warnings == ()
