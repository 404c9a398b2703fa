"""Read the lines of a DXF drawing in millimetres, and make a crack from them.

Polylines, lines, arcs, splines and ellipses of the requested layers are read, including those in inserted blocks. Lines
that meet end to end are joined.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import ezdxf.filemanagement
import numpy as np
import trimesh
from ezdxf import edgeminer
from ezdxf.path import make_path
from manifold3d import CrossSection, FillRule
from scipy.spatial import KDTree

from digitise.drawing.given_lines import Given, outline_of_line, outline_within, same_way
from digitise.geometry.polyline import Box, signed_area
from digitise.geometry.region import traced_region
from digitise.mesh_import.import_mesh import MAX_MM
from digitise.settings import CrackShape
from digitise.solid.footprint import lay_out
from digitise.solid.wedges import carve
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats, Outline

DrawnUnit = Literal["mm", "cm", "m", "inch", "foot"]
MM: dict[DrawnUnit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "foot": 304.8}
STATED: dict[int, DrawnUnit] = {1: "inch", 2: "foot", 4: "mm", 5: "cm", 6: "m"}
"""Accepted units by their code in $INSUNITS. Code 0 means unspecified."""
DRAWN = {"LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "SPLINE", "ELLIPSE"}
HIDDEN = "lines on a layer that is off or frozen"
LARGEST_BYTES = 50_000_000
MAX_ENTITIES = 200_000  # Largest number of parts, including parts of blocks, which may contain blocks
DEEPEST = 16  # Deepest nesting of blocks
MAX_POINTS = 20_000  # Largest number of points on one layer, ten times that of a traced crack
FARTHEST_MM = 1e6  # Largest coordinate: one kilometre from the drawing's origin
SAG_MM = 0.02  # Largest distance of a curve from its chords, and height range of a level line: 1/5 of a photo's pixel
MEETS_MM = 1e-3  # Largest gap between two lines that are joined
COPY_MM = 1e-6  # Two lines are copies if their points differ by no more than this: digits are rounded in a file
FACE, OUTLINE, ISLANDS = "FACE", "OUTLINE", "ISLANDS"
"""Layers of 'sealtwin export': the edge of the sample, the crack's edge, and its stones."""
MIN_CRACK_MM = 3.0  # Least length of a crack: three widths of the finest crack that can be injected
BESIDE_MM2 = 1e-3  # An area up to this outside another line comes only from the chords of two curves


@dataclass
class Drawing:
    """A drawing. Names of layers are compared without regard to upper and lower case."""

    file: Path
    unit: DrawnUnit
    unit_source: str
    entities: dict[str, list[Any]]  # Entities of each layer. Names are in upper case
    hidden: set[str]  # Names of layers that are off or frozen, in upper case
    notes: list[Fact] = field(default_factory=list)

    def lines(self, layer: str) -> tuple[list[Floats], list[Floats]]:
        """Return the closed lines and the open lines of a layer, each (n, 2), in mm and in plan view.

        Lines that meet end to end are joined. A closed line does not repeat its first point. Parts that are not read,
        such as widths of polylines, are listed in ``notes``. Raises InputError if there are no lines, if more than two
        lines meet at a point, or if a line is not level or is far from the drawing's origin.
        """
        left_out, ways, count = Counter[str](), dict[Any, Floats](), 0
        for entity in self.entities.get(layer.upper(), ()):
            unread = entity.dxftype() if not _is_line(entity) else HIDDEN if layer.upper() in self.hidden else ""
            if unread or entity.dxf.get("invisible", 0):
                left_out[unread or "invisible lines"] += 1
                continue
            way_mm = self._points_mm(entity, layer)
            count += len(way_mm)
            if count > MAX_POINTS:
                raise InputError(f"{self.file}, layer {layer}: it has over {MAX_POINTS} points. Simplify its lines.")
            left_out["widths of polylines"] += getattr(entity, "has_width", False)
            # A copy may begin at the other end, or at another corner.
            places = frozenset(map(tuple, np.rint(way_mm / COPY_MM).tolist()))
            shape = places, round(np.linalg.norm(np.diff(way_mm, axis=0), axis=1).sum() / COPY_MM)
            left_out["lines of no length"] += len(places) < 2
            left_out["exact copies of lines"] += shape in ways
            if len(places) > 1:
                ways.setdefault(shape, way_mm)
        counted = ", ".join(f"{what} ({number})" for what, number in (+left_out).items())
        if not ways:
            with_lines = (key for key, entities in self.entities.items() if any(map(_is_line, entities)))
            raise InputError(
                f"{self.file}: the layer {layer} has no readable lines in model space. Left out: "
                f"{counted or 'nothing'}. Layers with lines: {', '.join(with_lines) or 'none'}."
            )
        if counted:
            text = f"{self.file.name}, layer {layer}: these parts were left out: {counted}"
            self.notes.append(doubt("drawing.left-out", text, layer))
        return self._joined(list(ways.values()), layer)

    def place(self, place_mm: Iterable[float]) -> str:
        """Return a point as text, in the drawing's own unit."""
        x, y, *_ = place_mm
        return f"({x / MM[self.unit]:.7g}, {y / MM[self.unit]:.7g})"

    def gap(self, lines: Iterable[Floats]) -> str:
        """Return the smallest gap between the ends of open lines as text."""
        ends_mm = np.array([line_mm[end] for line_mm in lines for end in (0, -1)])
        sizes_mm = KDTree(ends_mm).query(ends_mm, k=2)[0][:, 1]
        return f"the smallest gap is {sizes_mm.min():.3g} mm at {self.place(ends_mm[sizes_mm.argmin()])}"

    def _points_mm(self, entity: Any, layer: str) -> Floats:
        """Return a line's points in mm, (n, 2), without repeated points."""
        kind = f"{self.file}, layer {layer}: its {entity.dxftype()} #{entity.dxf.get('handle', '?')}"
        if entity.dxftype() == "POLYLINE":
            # A spline-fit polyline keeps both the curve and the frame that it was fitted to.
            curve = [vertex for vertex in entity.vertices if not vertex.dxf.flags & vertex.SPLINE_FRAME_CONTROL_POINT]
            entity.vertices[:] = curve
        try:
            path = make_path(entity).flattening(SAG_MM / MM[self.unit])
            points_mm = MM[self.unit] * np.array([tuple(point) for point in path], dtype=float).reshape(-1, 3)
        except Exception as fault:  # ezdxf raises many types of errors for a damaged line.
            raise InputError(
                f"{kind} cannot be read ({str(fault) or type(fault).__name__:.80}). Draw it as a polyline."
            ) from fault
        if not (np.abs(points_mm) < FARTHEST_MM).all():
            raise InputError(
                f"{kind} is not within {FARTHEST_MM / 1e6:g} km of the origin. Move the drawing to the origin, or "
                "delete that line."
            )
        z_mm = np.sort(points_mm[:, 2])
        if len(z_mm) and z_mm[-1] - z_mm[0] > SAG_MM:
            raise InputError(
                f"{kind} is not level: z is {z_mm[0]:.4g} to {z_mm[-1]:.4g} mm. Drawings are read in plan view, so "
                "move the line into the XY plane."
            )
        fresh = np.append(True, (np.diff(points_mm[:, :2], axis=0) != 0).any(axis=1))
        return points_mm[fresh[: len(points_mm)], :2]

    def _joined(self, ways: list[Floats], layer: str) -> tuple[list[Floats], list[Floats]]:
        """Join open lines that meet end to end. A joined line has the direction of the part that was drawn first."""
        rings, lines = [way_mm[:-1] for way_mm in ways if _closes(way_mm)], list[Floats]()
        edges = [edgeminer.make_edge(way[0], way[-1], payload=way) for way in ways if not _closes(way)]
        if not edges:
            return rings, lines
        deposit = edgeminer.Deposit(edges, gap_tol=MEETS_MM)
        for vertex in deposit.unique_vertices():
            if (meeting := deposit.degree(vertex)) > 2:
                raise InputError(
                    f"{self.file}, layer {layer}: {meeting} lines meet at {self.place(vertex)}, so the line forks. "
                    "Draw one line from end to end."
                )
        for chain in edgeminer.find_all_simple_chains(deposit):
            way_mm = np.concatenate([edge.payload[:: -1 if edge.is_reverse else 1] for edge in chain])
            if min(chain, key=lambda edge: edge.id).is_reverse:
                way_mm = way_mm[::-1]
            if _closes(way_mm):
                rings.append(way_mm[:-1])
            else:
                lines.append(way_mm)
        return rings, lines


def open_drawing(path: Path, option: DrawnUnit | None) -> Drawing:
    """Open a drawing. ``option`` replaces the unit that the drawing states.

    Raises InputError if the file is missing, too large or not a DXF, or if neither the drawing nor ``option`` states a
    unit.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such drawing.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: the file is larger than {LARGEST_BYTES / 1e6:g} MB. Save only the crack's layers.")
    entities = dict[str, list[Any]]()
    try:
        # ezdxf's recovering reader would silently read 53.Q3 as 53.
        document = ezdxf.filemanagement.readfile(path)
        unit, unit_source = _unit(path, option, document.units)
        for number, (layer, entity) in enumerate(_parts(document.modelspace())):
            if number == MAX_ENTITIES:
                raise ValueError(f"it has over {MAX_ENTITIES} parts: save only the crack's layers")
            entities.setdefault(layer.upper(), []).append(entity)
        hidden = {layer.dxf.name.upper() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    except InputError:
        raise
    except Exception as fault:  # ezdxf raises many types of errors for a damaged drawing.
        raise InputError(
            f"{path}: not a readable DXF ({str(fault) or type(fault).__name__:.80}). Save it again as DXF R2010 or "
            "newer."
        ) from fault
    return Drawing(path, unit, unit_source, entities, hidden)


def _parts(space: Iterable[Any], inherited: str | None = None, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield each part of a drawing with its layer. Blocks are split into their parts."""
    for entity in space:
        layer = str(entity.dxf.get("layer", "0"))
        # A block's lines on layer 0 belong to the layer on which the block is inserted.
        layer = inherited if inherited is not None and layer == "0" else layer
        if entity.dxftype() == "INSERT" and depth < DEEPEST:
            if depth and entity.mcount > 1:
                raise ValueError("it has an array of a block inside a block: explode it")
            for copy in entity.multi_insert() if entity.mcount > 1 else (entity,):
                yield from _parts(copy.virtual_entities(), layer, depth + 1)
        else:
            yield layer, entity


def _unit(path: Path, option: DrawnUnit | None, number: int) -> tuple[DrawnUnit, str]:
    """Return the unit of the drawing, and a text that states who gave it.

    Raises InputError if neither the drawing nor ``option`` states a unit.
    """
    stated = STATED.get(number)
    unit = stated or ("no unit" if number == 0 else f"unit {number} of $INSUNITS, which is not accepted")
    if option is not None:
        return option, f"by --units; the drawing states {unit}" if option != stated else "by --units and by the drawing"
    if stated is None:
        raise InputError(f"{path}: the drawing states {unit}. Give its unit with --units.")
    return stated, "by the drawing"


def _is_line(entity: Any) -> bool:
    return entity.dxftype() in DRAWN and not (
        entity.dxftype() == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh)
    )


def _closes(way_mm: Floats) -> bool:
    """Return True if the last point of a line repeats its first."""
    return len(way_mm) > 3 and bool(np.linalg.norm(way_mm[0] - way_mm[-1]) <= MEETS_MM)


def drawn_crack(
    drawing: Drawing,
    *,
    outline: str | None = None,
    walls: tuple[str, str] | None = None,
    line: tuple[str, float] | None = None,
) -> Given:
    """Return the crack inside an ``outline``, between ``walls``, or along a ``line`` with a width in mm.

    By default the crack is inside the closed line of the layer OUTLINE and outside the closed lines of the layer
    ISLANDS. A rectangle on the layer FACE is the edge of the sample, and its lower left corner is the origin. Notes are
    added to the drawing. Raises InputError if a layer is missing or its lines are of the wrong kind, and ShapeError if
    the lines bound no crack.
    """
    face_mm, origin_mm = _face(drawing) if FACE in drawing.entities else (None, np.zeros(2))
    if line is not None:
        line_mm = _way(drawing, line[0])
        _require_size(drawing, line_mm)
        name = f"{drawing.file}, layer {line[0]}"
        crack = outline_of_line(line_mm - origin_mm, np.array([[0.0, line[1]]]), face_mm, name)
    else:
        edge_mm, stones_mm = _edge(drawing, outline, walls)
        _require_size(drawing, edge_mm)
        region, warnings = traced_region(edge_mm, stones_mm)
        drawing.notes += warnings
        region = region.translate((-origin_mm[0], -origin_mm[1]))
        crack = outline_within(region, face_mm, str(drawing.file))
    size = _size(crack[0].outline_mm)
    text = f"unit of the drawing: {drawing.unit} ({drawing.unit_source}); the crack is {size}"
    drawing.notes.append(Fact("drawing.unit", text, drawing.unit))
    return crack


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
    """Return a mesh of the sample with upright walls and a level floor.

    The format is OBJ, a text format that keeps all digits.
    """
    shape = CrackShape(depth_mm=depth_mm, tilt="vertical")
    mesh = carve(lay_out(outline, shape, 0.0), shape, ()).to_mesh64()
    solid = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    return str(solid.export(file_type="obj", digits=9)).encode()


def _face(drawing: Drawing) -> tuple[Box, Floats]:
    """Return the sample's face, a box from (0, 0), and the position of its lower left corner in the drawing.

    Raises InputError if the layer FACE is not one rectangle.
    """
    ring_mm, *others = _rings(drawing, FACE)
    low, high = ring_mm.min(axis=0), ring_mm.max(axis=0)
    x, y = high - low
    if others or signed_area(ring_mm) < x * y - BESIDE_MM2:
        raise InputError(
            f"{drawing.file}, layer {FACE}: it has {1 + len(others)} closed lines, the largest {_size(ring_mm)}. "
            "Expected is one rectangle with sides along x and y, the edge of the sample. Draw that rectangle, or "
            "move other lines to another layer."
        )
    return (0.0, 0.0, float(x), float(y)), low


def _rings(drawing: Drawing, name: str) -> list[Floats]:
    """Return the closed lines of a layer, largest first, counter-clockwise.

    Raises InputError for an open line.
    """
    rings_mm, opened = drawing.lines(name)
    if opened:
        raise InputError(
            f"{drawing.file}, layer {name}: it has {len(opened)} open lines; {drawing.gap(opened)}. Close the "
            "line there."
        )
    rings_mm = [ring_mm[:: 1 if signed_area(ring_mm) > 0 else -1] for ring_mm in rings_mm]
    return sorted(rings_mm, key=signed_area, reverse=True)


def _require_stones(drawing: Drawing, edge_mm: Floats, stones_mm: Sequence[Floats]) -> None:
    """Raise InputError for a stone that is not inside the crack's edge, or that overlaps another stone."""
    free = CrossSection([edge_mm])
    for ring_mm in stones_mm:
        stone = CrossSection([ring_mm], FillRule.NonZero)
        if (stone - free).area() > BESIDE_MM2:
            raise InputError(
                f"{drawing.file}: the closed line at {_middle(drawing, ring_mm)} is not inside the crack's edge (the "
                f"closed line at {_middle(drawing, edge_mm)}), or overlaps another line inside it. Lines inside the "
                "edge are stones, and a trial has one crack. Put each crack on its own layer and name that layer "
                "with --outline."
            )
        free -= stone


def _way(drawing: Drawing, name: str) -> Floats:
    """Return the single open line of a layer. Raises InputError for several lines or a closed line."""
    rings_mm, lines_mm = drawing.lines(name)
    if rings_mm or len(lines_mm) > 1:
        gap = f"; {drawing.gap(lines_mm)}" if lines_mm else ""
        raise InputError(
            f"{drawing.file}, layer {name}: it has {len(rings_mm)} closed lines and {len(lines_mm)} open lines{gap}. "
            "Draw a single open line from end to end."
        )
    return lines_mm[0]


def _require_size(drawing: Drawing, crack_mm: Floats) -> None:
    """Raise InputError for a crack that is too short or too long, for example because of a wrong unit."""
    longest_mm = np.ptp(crack_mm, axis=0).max()
    if MIN_CRACK_MM <= longest_mm <= MAX_MM:
        return
    fitting = [unit for unit in MM if MIN_CRACK_MM <= longest_mm * MM[unit] / MM[drawing.unit] <= MAX_MM]
    remedy = f"Give --units {' or '.join(fitting)} if it is drawn in that unit." if fitting else "Draw it to scale."
    raise InputError(
        f"{drawing.file}: the crack measures {_size(crack_mm)}, but a length of {MIN_CRACK_MM:g} to {MAX_MM:g} mm "
        f"is expected. The unit is {drawing.unit}, {drawing.unit_source}. {remedy}"
    )


def _size(points_mm: Floats) -> str:
    return "{:.4g} x {:.4g} mm".format(*np.ptp(points_mm, axis=0))


def _middle(drawing: Drawing, ring_mm: Floats) -> str:
    return drawing.place((ring_mm.min(axis=0) + ring_mm.max(axis=0)) / 2)
