"""The crack that the lines of a drawing bound, and a mesh of a sample with it."""

from collections.abc import Sequence

import numpy as np
import trimesh
from manifold3d import CrossSection, FillRule

from digitise.drawing.given_lines import Given, outline_of_line, outline_within, same_way
from digitise.drawing.read_dxf import MM, Drawing
from digitise.geometry.polyline import Box, signed_area
from digitise.geometry.region import traced_region
from digitise.mesh_import.import_mesh import MOST_MM
from digitise.settings import CrackShape
from digitise.solid.footprint import lay_out
from digitise.solid.wedges import carve
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact
from sealtwin.core.records import Floats, Outline

FACE, OUTLINE, ISLANDS = "FACE", "OUTLINE", "ISLANDS"
"""Layers of 'sealtwin export' with the edge of the sample, the crack's edge and its stones."""
LEAST_CRACK_MM = 3.0  # Least length of a crack: three widths of the finest crack that is injected
BESIDE_MM2 = 1e-3  # Area outside another line that is only the sag of two curves


def drawn_crack(
    drawing: Drawing,
    *,
    outline: str | None = None,
    walls: tuple[str, str] | None = None,
    line: tuple[str, float] | None = None,
) -> Given:
    """Return the crack inside an ``outline``, between ``walls``, or along a ``line`` with a width in mm.

    Without any of them it is inside the closed line of the layer OUTLINE, and outside those of the layer ISLANDS. A
    rectangle on the layer FACE is the edge of the sample, and its lower left corner the origin. Notes are added to the
    drawing. Raises InputError if a layer is missing or its lines are of the wrong kind, and ShapeError if the lines
    bound no crack.
    """
    face_mm, origin_mm = _face(drawing) if FACE in drawing.entities else (None, np.zeros(2))
    if line is not None:
        line_mm = _way(drawing, line[0])
        _require_size(drawing, line_mm)
        name = f"{drawing.file}, layer {line[0]}"
        given = outline_of_line(line_mm - origin_mm, np.array([[0.0, line[1]]]), face_mm, name)
    else:
        edge_mm, stones_mm = _edge(drawing, outline, walls)
        _require_size(drawing, edge_mm)
        region, warnings = traced_region(edge_mm, stones_mm)
        drawing.notes += warnings
        region = region.translate((-float(origin_mm[0]), -float(origin_mm[1])))
        given = outline_within(region, face_mm, str(drawing.file))
    size = _size(given[0].outline_mm)
    text = f"unit of the drawing: {drawing.unit} ({drawing.unit_source}); the crack is {size}"
    drawing.notes.append(Fact("drawing.unit", text, drawing.unit))
    return given


def _edge(drawing: Drawing, outline: str | None, walls: tuple[str, str] | None) -> tuple[Floats, list[Floats]]:
    """Return the crack's edge as a ring, and the rings of its stones."""
    if walls is not None:
        one_mm, other_mm = (_way(drawing, layer) for layer in walls)
        return np.vstack([one_mm, same_way(one_mm, other_mm)[::-1]]), []
    edge_mm, *stones_mm = _rings(drawing, outline or OUTLINE)
    if outline is None and ISLANDS in drawing.entities:
        stones_mm += _rings(drawing, ISLANDS)
    _require_stones(drawing, edge_mm, stones_mm)
    return edge_mm, stones_mm


def sample_obj(outline: Outline, depth_mm: float) -> bytes:
    """Return a mesh of the sample with upright walls and a level floor, in the text format OBJ, which keeps digits."""
    shape = CrackShape(depth_mm=depth_mm, tilt="vertical")
    mesh = carve(lay_out(outline, shape, 0.0), shape, ()).to_mesh64()
    solid = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    return str(solid.export(file_type="obj", digits=9)).encode()


def _face(drawing: Drawing) -> tuple[Box, Floats]:
    """Return the sample's face, from (0, 0), and its lower left corner in the drawing. Raises InputError if unfit."""
    ring_mm, *others = _rings(drawing, FACE)
    low, high = ring_mm.min(axis=0), ring_mm.max(axis=0)
    x, y = high - low
    if others or signed_area(ring_mm) < x * y - BESIDE_MM2:
        raise InputError(
            f"{drawing.file}, layer {FACE}: {1 + len(others)} closed lines, the largest {_size(ring_mm)}; "
            "expected one rectangle along x and y, the edge of the sample. Draw it so, or put it on another layer."
        )
    return (0.0, 0.0, float(x), float(y)), low


def _rings(drawing: Drawing, name: str) -> list[Floats]:
    """Return the closed lines of a layer, the largest first, counter-clockwise.

    Raises InputError for an open line.
    """
    rings_mm, opened = drawing.lines(name)
    if opened:
        raise InputError(
            f"{drawing.file}, layer {name}: {len(opened)} open lines: {drawing.gap(opened)}. Close the edge there."
        )
    rings_mm = [ring_mm[:: 1 if signed_area(ring_mm) > 0 else -1] for ring_mm in rings_mm]
    return sorted(rings_mm, key=signed_area, reverse=True)


def _require_stones(drawing: Drawing, edge_mm: Floats, stones_mm: Sequence[Floats]) -> None:
    """Raise InputError for a stone that is not inside the crack's edge, or that overlaps another one."""
    free = CrossSection([edge_mm])
    for ring_mm in stones_mm:
        stone = CrossSection([ring_mm], FillRule.NonZero)
        if (stone - free).area() > BESIDE_MM2:
            raise InputError(
                f"{drawing.file}: the closed line at {_middle(drawing, ring_mm)} is not inside the crack's edge, the "
                f"closed line at {_middle(drawing, edge_mm)}, or overlaps another one in it. Lines inside the edge are "
                "stones, and a trial has one crack. Put each crack on a layer of its own and give it as --outline."
            )
        free -= stone


def _way(drawing: Drawing, name: str) -> Floats:
    """Return the one open line of a layer. Raises InputError if there are several lines, or one that is closed."""
    rings_mm, lines_mm = drawing.lines(name)
    if rings_mm or len(lines_mm) > 1:
        gap = f"; {drawing.gap(lines_mm)}" if lines_mm else ""
        raise InputError(
            f"{drawing.file}, layer {name}: {len(rings_mm)} closed lines and {len(lines_mm)} open ones{gap}. Draw one "
            "open line from end to end, once."
        )
    return lines_mm[0]


def _require_size(drawing: Drawing, crack_mm: Floats) -> None:
    """Raise InputError for a crack that is too short or too long. A wrong unit may be the cause."""
    longest_mm = np.ptp(crack_mm, axis=0).max()
    if LEAST_CRACK_MM <= longest_mm <= MOST_MM:
        return
    fitting = [unit for unit in MM if LEAST_CRACK_MM <= longest_mm * MM[unit] / MM[drawing.unit] <= MOST_MM]
    remedy = f"Give --units {' or '.join(fitting)} if it is drawn in that unit." if fitting else "Draw it to scale."
    raise InputError(
        f"{drawing.file}: the crack is {_size(crack_mm)}; {LEAST_CRACK_MM:g} to {MOST_MM:g} mm are expected. "
        f"The unit is {drawing.unit}, {drawing.unit_source}. {remedy}"
    )


def _size(points_mm: Floats) -> str:
    return "{:.4g} x {:.4g} mm".format(*np.ptp(points_mm, axis=0))


def _middle(drawing: Drawing, ring_mm: Floats) -> str:
    return drawing.place((ring_mm.min(axis=0) + ring_mm.max(axis=0)) / 2)
