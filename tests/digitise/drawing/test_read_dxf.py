"""DXF drawings: written drawings are read back, and other forms that CAD draws give the same crack."""

from itertools import pairwise
from typing import Any

import ezdxf.filemanagement
import numpy as np
import pytest
from ezdxf import units

from digitise.drawing.given import DrawnLines
from digitise.drawing.given_lines import outline_of_line
from digitise.drawing.read_dxf import drawn_crack, open_drawing
from digitise.exports import dxf_text
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError
from tests.support.shapes import CLOSED, arc_slot, straight_slot
from tests.support.small_fluids import path

RING = np.array([(0.0, 0.0), (40.0, 0.0), (40.0, 3.0), (0.0, 3.0)])
DEPTH_MM = 8.0


def _saved(folder, draw, unit=units.MM):
    drawing = ezdxf.filemanagement.new(units=unit)
    draw(drawing.modelspace())
    drawing.saveas(folder / "drawn.dxf")
    return folder / "drawn.dxf"


def _crack(file, **asked):
    return drawn_crack(open_drawing(file, None), DrawnLines(**asked))[0]


def _volume_mm3(outline):
    """Volume of the cavity, checked against the block's volume less that of its mesh if there are no dams."""
    solid = build_solid(outline, CrackShape(depth_mm=DEPTH_MM, tilt="vertical"))
    if not solid.figures.dams:
        corners = solid.vertices_mm[solid.faces]
        inside_mm3 = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        block_mm3 = np.prod(np.ptp(solid.vertices_mm, axis=0))
        assert solid.cavity_volume_mm3 == pytest.approx(block_mm3 - inside_mm3, rel=1e-6)
    return solid.cavity_volume_mm3


def test_a_traced_crack_is_unchanged_after_writing_and_reading(tmp_path):
    outline = arc_slot()
    (tmp_path / "a.dxf").write_text(dxf_text(outline, None))
    drawing = open_drawing(tmp_path / "a.dxf", None)
    for layer, line_mm in (("wall_left", outline.left_wall_mm), ("CENTRELINE", outline.centreline_mm)):
        (read_mm,) = drawing.lines(layer)
        assert np.abs(read_mm - line_mm).max() < 1e-9
    assert drawing.notes == []


def test_the_nozzle_path_is_written_as_a_3d_polyline(tmp_path):
    outline = straight_slot(40.0, 3.0, CLOSED)
    planned = path(outline, 0.5, 20.0)
    (tmp_path / "a.dxf").write_text(dxf_text(outline, planned))
    (line,) = ezdxf.filemanagement.readfile(tmp_path / "a.dxf").query('POLYLINE[layer=="NOZZLE_PATH"]')
    points: Any = line
    assert np.allclose([tuple(point) for point in points.points()], planned.position_mm)


@pytest.mark.parametrize(("unit", "mm"), [(units.CM, 10.0), (units.IN, 25.4)])
def test_separate_segments_in_any_unit_are_joined_to_a_wall(tmp_path, unit, mm):
    """The segments are LINEs in any order and direction."""

    def draw(space):
        for layer, y in (("A", 3.0), ("B", 0.0)):
            sides = [*pairwise(np.column_stack([np.linspace(0, 40, 5), np.full(5, y)]) / mm)]
            for index in (2, 0, 3, 1):
                first, last = sides[index][:: -1 if index % 2 else 1]
                space.add_line(first, last, dxfattribs={"layer": layer})

    outline = _crack(_saved(tmp_path, draw, unit), walls=("A", "B"))
    assert _volume_mm3(outline) == pytest.approx(40 * 3 * DEPTH_MM, rel=1e-4)
    assert (outline.ends, outline.length_mm) == (CLOSED, pytest.approx(40.0, rel=1e-4))


@pytest.mark.parametrize("closed", [True, False])
def test_a_drawn_centreline_gives_the_same_crack_as_its_points(tmp_path, closed):
    """The crack ends square to the line at its ends; at the edge of the face it is open."""
    line_mm = np.array([(10.0 * closed, 20.0), (30.0, 24.0), (50.0, 18.0)])

    def draw(space):
        space.add_lwpolyline(line_mm, dxfattribs={"layer": "L", "const_width": 2.5})
        space.add_text("scratch")

    drawing = open_drawing(_saved(tmp_path, draw), None)
    outline, _ = drawn_crack(drawing, DrawnLines(line="L", width_mm=3.0, face_mm=(60.0, 40.0)))
    same, _ = outline_of_line(line_mm, np.array([[0.0, 3.0]]), (0.0, 0.0, 60.0, 40.0), "line")
    assert _volume_mm3(outline) == pytest.approx(_volume_mm3(same), rel=1e-9)
    assert outline.centreline_mm == pytest.approx(same.centreline_mm)
    assert outline.ends == same.ends == ("cut" if closed else "open", "cut")
    assert any("layer L: these parts were left out: widths of polylines (1)" in note.text for note in drawing.notes)


def test_lines_in_blocks_get_the_scale_and_layer_of_the_insert(tmp_path):
    """The block is nested, doubled and mirrored; lines on layer 0 are on the layer of the insert."""

    def draw(space):
        blocks = space.doc.blocks
        blocks.new("SIDE").add_line((0, 0), (10, 0))
        for x in (0, 10):
            (blocks.get("SIDES") or blocks.new("SIDES")).add_blockref("SIDE", (x, 0))
        for y in (0, 3):
            space.add_blockref("SIDES", (40, y), dxfattribs={"layer": f"WALL{y}", "xscale": -2})

    assert _volume_mm3(_crack(_saved(tmp_path, draw), walls=("WALL3", "WALL0"))) == pytest.approx(
        40 * 3 * DEPTH_MM, rel=1e-6
    )


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        (
            {"walls": ("A", "B")},
            "layer B has no readable lines in model space. Left out: nothing. Layers with",
        ),
        ({"walls": ("A", "C")}, "layer C: it has a closed line"),
        ({"line": "A", "width_mm": 3.0}, "within 3 mm of itself, at s = "),
        ({"line": "A", "width_mm": 3.0, "unit": 0}, "--units"),
    ],
)
def test_the_error_for_a_missing_or_unsuitable_layer_names_the_layer(tmp_path, asked, named):
    """A drawing without a unit is refused too. The line of 3 mm in width is a hairpin whose legs touch."""
    unit = asked.pop("unit", units.MM)
    line_mm = RING - np.array([0, 0.002])

    def draw(space):
        space.add_lwpolyline(line_mm, dxfattribs={"layer": "A"})
        space.add_circle((20, 1.5), 0.5, dxfattribs={"layer": "C"})

    file = _saved(tmp_path, draw, unit)
    with pytest.raises(InputError, match=r"drawn\.dxf") as fault:
        _crack(file, **asked)
    assert named in str(fault.value)


def test_copies_of_a_line_are_read_once(tmp_path):
    def draw(space):
        for shift, step in ((0, 1), (1, -1), (2, 1), (3, -1)):
            space.add_lwpolyline(np.roll(RING, shift, axis=0)[::step], close=True, dxfattribs={"layer": "A"})
            space.add_lwpolyline(RING[::step], dxfattribs={"layer": "B"})

    drawing = open_drawing(_saved(tmp_path, draw), None)
    assert [len(drawing.lines(name)) for name in "AB"] == [1, 1]
    assert all("exact copies of lines (3)" in note.text for note in drawing.notes)
