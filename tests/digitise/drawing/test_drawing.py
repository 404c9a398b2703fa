"""Drawings in and out: what is written is read back, and what CAD draws in other ways is the same crack."""

from contextlib import suppress
from itertools import pairwise
from typing import Any

import ezdxf.filemanagement
import numpy as np
import pytest
from ezdxf import units

from digitise.drawing.drawn_block import FLOOR_MM, drawn_crack
from digitise.drawing.drawn_layers import DrawnLayers
from digitise.drawing.join_lines import DrawnLine, without_copies
from digitise.drawing.read_dxf import open_drawing
from digitise.exports import dxf_text
from sealtwin.core.errors import InputError
from tests.fluids import path
from tests.shapes import CLOSED, arc_slot, straight_slot

RING = np.array([(0.0, 0.0), (40.0, 0.0), (40.0, 3.0), (0.0, 3.0)])
DEPTH_MM = 8.0


def _saved(folder, draw, unit=units.MM):
    drawing = ezdxf.filemanagement.new(units=unit)
    draw(drawing.modelspace())
    drawing.saveas(folder / "drawn.dxf")
    return folder / "drawn.dxf"


def _layers(file, unit=None):
    return DrawnLayers(open_drawing(file, unit))


def _volume_mm3(crack, box_mm2):
    """Volume that the crack takes out of its block."""
    corners = crack.vertices_mm[crack.faces]
    inside = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    return box_mm2 * (DEPTH_MM + FLOOR_MM) - inside


def test_a_traced_crack_is_read_back_as_it_was(tmp_path):
    outline = arc_slot()
    (tmp_path / "a.dxf").write_text(dxf_text(outline, None))
    drawing = open_drawing(tmp_path / "a.dxf", None)
    (ring,) = drawing.lines("OUTLINE")
    assert ring.closed
    assert np.abs(ring.points_mm - outline.outline_mm).max() < 1e-9
    for name, line_mm in (("WALL_LEFT", outline.left_wall_mm), ("CENTRELINE", outline.centreline_mm)):
        (line,) = drawing.lines(name)
        assert np.abs(line.points_mm - line_mm).max() < 1e-9
    assert drawing.notes == []


def test_the_nozzles_path_is_a_line_in_space(tmp_path):
    outline = straight_slot(40.0, 3.0, CLOSED)
    planned = path(outline, 0.5, 20.0)
    (tmp_path / "a.dxf").write_text(dxf_text(outline, planned))
    (line,) = ezdxf.filemanagement.readfile(tmp_path / "a.dxf").query('POLYLINE[layer=="NOZZLE_PATH"]')
    points: Any = line
    assert np.allclose([tuple(point) for point in points.points()], planned.position_mm)


@pytest.mark.parametrize("unit", ["mm", "cm", "inch"])
def test_an_outline_in_segments_and_any_unit_is_one_crack(tmp_path, unit):
    """As LINEs in any order and direction, and backwards."""
    scale = {"mm": 1.0, "cm": 0.1, "inch": 1 / 25.4}[unit]
    number = {"mm": units.MM, "cm": units.CM, "inch": units.IN}[unit]

    def draw(space):
        sides = [*pairwise([*RING * scale, RING[0] * scale])]
        for index in (2, 0, 3, 1):
            first, last = sides[index][:: -1 if index % 2 else 1]
            space.add_line(first, last, dxfattribs={"layer": "outline"})

    layers = _layers(_saved(tmp_path, draw, number))
    crack = drawn_crack(layers, DEPTH_MM)
    assert _volume_mm3(crack, 64 * 27) == pytest.approx(40 * 3 * DEPTH_MM, rel=1e-4)
    assert np.ptp(crack.vertices_mm, axis=0) == pytest.approx([64, 27, DEPTH_MM + FLOOR_MM], rel=1e-6)


def test_walls_either_way_round_are_the_outline(tmp_path):
    def draw(space):
        space.add_lwpolyline(RING[:2], dxfattribs={"layer": "A"})
        space.add_lwpolyline(RING[2:], dxfattribs={"layer": "B"})

    layers = _layers(_saved(tmp_path, draw))
    for walls in (("A", "B"), ("b", "a")):
        assert _volume_mm3(drawn_crack(layers, DEPTH_MM, walls=walls), 64 * 27) == pytest.approx(960, rel=1e-6)


def test_a_line_has_its_width_and_round_ends_and_a_face_its_sides(tmp_path):
    def draw(space):
        space.add_lwpolyline([(0, 0, 0), (40, 0, 0)], format="xyb", dxfattribs={"layer": "L"})
        space.add_lwpolyline([(-10, -10), (60, -10), (60, 10), (-10, 10)], close=True, dxfattribs={"layer": "FACE"})
        space.add_text("scratch")

    crack = drawn_crack(_layers(_saved(tmp_path, draw)), DEPTH_MM, line=("L", 3.0))
    # The ends are polygons of 32 corners, 0.6 % smaller than a disc.
    assert _volume_mm3(crack, 70 * 20) == pytest.approx((40 * 3 + np.pi * 1.5**2) * DEPTH_MM, rel=1e-3)
    assert crack.line_mm == pytest.approx(np.array([(0, 0), (40, 0)]))


def test_an_island_stands_in_the_crack(tmp_path):
    def draw(space):
        space.add_lwpolyline(RING, close=True, dxfattribs={"layer": "edge"})
        space.add_circle((20, 1.5), 0.5, dxfattribs={"layer": "edge"})

    crack = drawn_crack(_layers(_saved(tmp_path, draw)), DEPTH_MM, outline="edge")
    assert _volume_mm3(crack, 64 * 27) == pytest.approx((120 - np.pi / 4) * DEPTH_MM, rel=1e-3)


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        ({}, "layer OUTLINE has no lines to read; layers with lines: A"),
        ({"outline": "A"}, "layer A: an open line: a gap of 3 mm at (0, 0)"),
        ({"walls": ("A", "B")}, "layer B has no lines to read"),
        ({"line": ("B", 3.0)}, "layer B has no lines to read"),
        ({"unit": 0}, "states no unit; give --units"),
    ],
)
def test_a_layer_that_is_not_there_or_something_else_is_named(tmp_path, asked, named):
    """Nor is a unit ever guessed."""
    unit = asked.pop("unit", units.MM)
    file = _saved(tmp_path, lambda space: space.add_lwpolyline(RING, dxfattribs={"layer": "A"}), unit)
    with pytest.raises(InputError, match=r"drawn\.dxf") as fault:
        drawn_crack(_layers(file), DEPTH_MM, **asked)
    assert named in str(fault.value)


def test_a_line_drawn_twice_is_once_whatever_end_or_corner_it_begins_at():
    ring = [DrawnLine(np.roll(RING, shift, axis=0)[::step], True) for shift in range(4) for step in (1, -1)]
    line = [DrawnLine(RING[::step], False) for step in (1, -1)]
    assert len(without_copies([*ring, *line])) == 2


def test_any_damage_gives_lines_or_a_sentence(tmp_path):
    (tmp_path / "a.dxf").write_text(dxf_text(arc_slot(), None))
    sound, chance = (tmp_path / "a.dxf").read_bytes(), np.random.default_rng(0)
    for _ in range(30):
        content = bytearray(sound)
        for at in chance.integers(0, len(content), 20):
            content[at] = chance.integers(256)
        (tmp_path / "a.dxf").write_bytes(content[: chance.integers(1, len(content))])
        with suppress(InputError):
            drawn_crack(_layers(tmp_path / "a.dxf", None), DEPTH_MM)
