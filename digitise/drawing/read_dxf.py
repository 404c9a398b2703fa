"""Read the lines of a DXF drawing in millimetres, and make a crack from them.

Polylines, lines, arcs, splines and ellipses of the requested layers are read, including those in inserted blocks. Lines
that meet end to end are joined.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import ezdxf.filemanagement
import numpy as np
from ezdxf import edgeminer
from ezdxf.path import make_path
from scipy.spatial import KDTree

from digitise.drawing.given import DrawnLines, DrawnUnit
from digitise.drawing.given_lines import Given, outline_between, outline_of_line, same_way
from digitise.geometry.polyline import signed_area
from digitise.mesh_import.import_mesh import MAX_MM
from sealtwin.core.arc_length import step_lengths
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats

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
COPY_MM = 1e-6  # Lines whose points differ by no more than this are copies, since files round digits
MIN_CRACK_MM = 3.0  # Least length of a crack: three widths of the finest crack that can be injected


@dataclass
class Drawing:
    """A drawing. Names of layers are compared without regard to upper and lower case."""

    file: Path
    unit: DrawnUnit
    unit_source: str
    entities: dict[str, list[Any]]  # Entities of each layer. Names are in upper case
    hidden: set[str]  # Names of layers that are off or frozen, in upper case
    notes: list[Fact] = field(default_factory=list)

    def lines(self, layer: str) -> list[Floats]:
        """Return the lines of a layer, each (n, 2), in mm and in plan view.

        Lines that meet end to end are joined. A closed line repeats its first point. Parts that are not read, such as
        widths of polylines, are listed in ``notes``. Raises InputError if there are no lines, if more than two
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
            shape = places, round(step_lengths(way_mm).sum() / COPY_MM)
            left_out["lines of no length"] += len(places) < 2
            left_out["exact copies of lines"] += shape in ways
            if len(places) > 1:
                ways.setdefault(shape, way_mm)
        counted = ", ".join(f"{kind} ({number})" for kind, number in (+left_out).items())
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
            points_mm = MM[self.unit] * np.array([tuple(point) for point in path], float).reshape(-1, 3)
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

    def _joined(self, ways: list[Floats], layer: str) -> list[Floats]:
        """Join open lines that meet end to end. A joined line has the direction of the part that was drawn first."""
        lines = [way_mm for way_mm in ways if _closes(way_mm)]
        edges = [edgeminer.make_edge(way[0], way[-1], payload=way) for way in ways if not _closes(way)]
        if not edges:
            return lines
        deposit = edgeminer.Deposit(edges, gap_tol=MEETS_MM)
        for vertex in deposit.unique_vertices():
            if (meeting := deposit.degree(vertex)) > 2:
                raise InputError(
                    f"{self.file}, layer {layer}: {meeting} lines meet at {self.place(vertex)}, so the line forks. "
                    "Draw one line from end to end."
                )
        for chain in edgeminer.find_all_simple_chains(deposit):
            way_mm = np.concatenate([edge.payload[:: -1 if edge.is_reverse else 1] for edge in chain])
            lines.append(way_mm[:: -1 if min(chain, key=lambda edge: edge.id).is_reverse else 1])
        return lines


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


def drawn_crack(drawing: Drawing, crack: DrawnLines) -> Given:
    """Return the crack between two drawn walls, in either order, or along a line with a width.

    s is 0 at the left end. The unit and the size are the outline's ``scale_source``. Raises InputError if a layer is
    missing, if its lines are of the wrong kind, or if the lines bound no crack.
    """
    lines_mm = [_way(drawing, layer) for layer in crack.layers]
    _require_size(drawing, np.vstack(lines_mm))
    name = f"{drawing.file}, layer {' and '.join(crack.layers)}"
    first_mm = lines_mm[0] if lines_mm[0][0, 0] <= lines_mm[0][-1, 0] else lines_mm[0][::-1]
    if crack.width_mm is not None:
        outline, photo = outline_of_line(first_mm, np.array([[0.0, crack.width_mm]]), crack.box_mm, name)
    else:
        walls_mm = first_mm, same_way(first_mm, lines_mm[1])
        upper_first = signed_area(np.concatenate([walls_mm[1], walls_mm[0][::-1]])) > 0
        left_mm, right_mm = walls_mm if upper_first else walls_mm[::-1]
        outline, photo = outline_between(left_mm, right_mm, crack.box_mm, name)
    text = f"unit of the drawing: {drawing.unit} ({drawing.unit_source}); the crack is {_size(outline.outline_mm)}" + (
        "" if crack.face_mm else ", and closed at both ends, since face_mm is not given"
    )
    return replace(outline, scale_source=text), photo


def _way(drawing: Drawing, name: str) -> Floats:
    """Return the single open line of a layer. Raises InputError for several lines or a closed line."""
    line_mm, *others_mm = drawing.lines(name)
    if _closes(line_mm):
        raise InputError(f"{drawing.file}, layer {name}: it has a closed line. Draw one open line from end to end.")
    if others_mm:
        raise InputError(
            f"{drawing.file}, layer {name}: it has {1 + len(others_mm)} lines; "
            f"{drawing.gap([line_mm, *others_mm])}. Draw one open line from end to end."
        )
    return line_mm


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
