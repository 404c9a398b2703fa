"""Lines of a DXF drawing: polylines, lines, arcs, splines and ellipses of the requested layers, in millimetres.

Lines in blocks are read as they are inserted. Lines that meet end to end are joined.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import ezdxf.filemanagement
import numpy as np
from ezdxf import edgeminer
from ezdxf.path import make_path
from scipy.spatial import KDTree

from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats

DrawnUnit = Literal["mm", "cm", "m", "inch", "foot"]
MM: dict[DrawnUnit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "foot": 304.8}
STATED: dict[int, DrawnUnit] = {1: "inch", 2: "foot", 4: "mm", 5: "cm", 6: "m"}
"""Accepted units by their code, $INSUNITS; code 0 means unspecified."""
DRAWN = {"LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "SPLINE", "ELLIPSE"}
LARGEST_BYTES = 50_000_000
MOST_ENTITIES = 200_000  # Most parts of a drawing, those in blocks included: blocks in blocks multiply
DEEPEST = 16  # Deepest nesting of blocks
MOST_POINTS = 20_000  # Largest number of points on one layer, ten times a traced crack's
FARTHEST_MM = 1e6  # Largest coordinate: a kilometre from the drawing's origin
SAG_MM = 0.02  # Largest distance of a curve from its chords, and of a level line from level: a fifth of a photo's pixel
MEETS_MM = 1e-3  # Largest gap between two lines that are one
COPY_MM = 1e-6  # Largest distance of a copy's points from the original's: rounding of the digits in a file


@dataclass
class Drawing:
    """A drawing. Upper and lower case in the names of its layers are equal."""

    file: Path
    unit: DrawnUnit
    unit_source: str
    entities: dict[str, list[Any]]  # By layer, in upper case
    hidden: dict[str, str]  # Why a layer is not shown, by layer in upper case
    notes: list[Fact] = field(default_factory=list)

    def lines(self, layer: str) -> tuple[list[Floats], list[Floats]]:
        """Return the closed lines of a layer, without a repeated point, and the open ones, in plan view, (n, 2) in mm.

        Lines that meet end to end are joined.

        What is left out is noted, as are widths of polylines. Raises InputError if there are no lines, or more than two
        meet in a place, and for a line that is not level or far from the drawing's origin.
        """
        left_out, ways, count = Counter[str](), dict[Any, Floats](), 0
        for entity in self.entities.get(layer.upper(), ()):
            unread = self.hidden.get(layer.upper(), "") if _is_line(entity) else entity.dxftype()
            if unread or entity.dxf.get("invisible", 0):
                left_out[unread or "invisible lines"] += 1
                continue
            way_mm = self._points_mm(entity, layer)
            count += len(way_mm)
            if count > MOST_POINTS:
                raise InputError(f"{self.file}, layer {layer}: it has over {MOST_POINTS} points; simplify its lines.")
            left_out["widths of polylines"] += getattr(entity, "has_width", False)
            # A copy may begin at the other end, or at another corner.
            places = frozenset(map(tuple, np.rint(way_mm / COPY_MM).tolist()))
            shape = places, round(float(np.linalg.norm(np.diff(way_mm, axis=0), axis=1).sum()) / COPY_MM)
            left_out["lines of no length"] += len(places) < 2
            left_out["exact copies of lines"] += shape in ways
            if len(places) > 1:
                ways.setdefault(shape, way_mm)
        counted = ", ".join(f"{what} ({number})" for what, number in (+left_out).items())
        if not ways:
            with_lines = (key for key, entities in self.entities.items() if any(map(_is_line, entities)))
            raise InputError(
                f"{self.file}: the layer {layer} has no lines to read in model space; left out: "
                f"{counted or 'nothing'}; layers with lines: {', '.join(with_lines) or 'none'}."
            )
        if counted:
            text = f"{self.file.name}, layer {layer}: left out: {counted}"
            self.notes.append(doubt("drawing.left-out", text, layer))
        return self._joined(list(ways.values()), layer)

    def place(self, place_mm: Iterable[float]) -> str:
        """Return a place in words, in the drawing's own numbers."""
        x, y, *_ = place_mm
        return f"({x / MM[self.unit]:.7g}, {y / MM[self.unit]:.7g})"

    def gap(self, lines: Iterable[Floats]) -> str:
        """Return the smallest gap between the ends of open lines, in words."""
        ends_mm = np.array([line_mm[end] for line_mm in lines for end in (0, -1)])
        sizes_mm = KDTree(ends_mm).query(ends_mm, k=2)[0][:, 1]
        return f"the smallest gap is {sizes_mm.min():.3g} mm at {self.place(ends_mm[sizes_mm.argmin()])}"

    def _points_mm(self, entity: Any, layer: str) -> Floats:
        """Return a line's points in mm, (n, 2), without repeated ones."""
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
                f"{kind} is not level: z is {z_mm[0]:.4g} to {z_mm[-1]:.4g} mm. A drawing is read in plan view: move "
                "it into the XY plane."
            )
        fresh = np.append(True, (np.diff(points_mm[:, :2], axis=0) != 0).any(axis=1))
        return points_mm[fresh[: len(points_mm)], :2]

    def _joined(self, ways: list[Floats], layer: str) -> tuple[list[Floats], list[Floats]]:
        """Join open lines that meet end to end. A joined line runs as that part of it that was drawn first."""
        rings, lines = [way_mm[:-1] for way_mm in ways if _closes(way_mm)], list[Floats]()
        edges = [edgeminer.make_edge(way[0], way[-1], payload=way) for way in ways if not _closes(way)]
        if not edges:
            return rings, lines
        deposit = edgeminer.Deposit(edges, gap_tol=MEETS_MM)
        for vertex in deposit.unique_vertices():
            if (meeting := deposit.degree(vertex)) > 2:
                raise InputError(
                    f"{self.file}, layer {layer}: {meeting} lines meet at {self.place(vertex)}: the line forks. Draw "
                    "one line from end to end."
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


def open_drawing(path: Path, given: DrawnUnit | None) -> Drawing:
    """Open a drawing. A ``given`` unit replaces the drawing's own.

    Raises InputError if the file is missing, too large or not a DXF, or if the unit is neither stated nor given.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such drawing.")
    if path.suffix.lower() == ".dwg":
        raise InputError(f"{path}: DWG is not read; save the drawing as DXF.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB; save only the crack's layers.")
    entities, hidden = dict[str, list[Any]](), dict[str, str]()
    try:
        # ezdxf's recovering reader would silently read 53.Q3 as 53.
        document = ezdxf.filemanagement.readfile(path)
        unit, unit_source = _unit(path, given, document.units)
        for number, (layer, entity) in enumerate(_parts(document.modelspace())):
            if number == MOST_ENTITIES:
                raise ValueError(f"it has over {MOST_ENTITIES} parts: save only the crack's layers")
            entities.setdefault(layer.upper(), []).append(entity)
        for layer in document.layers:
            off = "switched off" if layer.is_off() else "frozen" if layer.is_frozen() else ""
            hidden[layer.dxf.name.upper()] = off and f"lines on a layer that is {off}"
    except InputError:
        raise
    except Exception as fault:  # ezdxf raises many types of errors for a damaged drawing.
        raise InputError(
            f"{path}: not a readable DXF ({str(fault) or type(fault).__name__:.80}). Save it again as DXF R2010 or "
            "newer."
        ) from fault
    return Drawing(path, unit, unit_source, entities, hidden)


def _parts(space: Iterable[Any], inherited: str | None = None, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield the layer of each part of a drawing, and the part. Blocks are taken apart."""
    for entity in space:
        layer = str(entity.dxf.get("layer", "0"))
        # A block's lines on layer 0 belong to the layer on which the block is inserted.
        layer = inherited if inherited is not None and layer == "0" else layer
        if entity.dxftype() == "INSERT" and depth < DEEPEST:
            if depth and entity.mcount > 1:
                raise ValueError("it has an array of a block inside of a block: explode it")
            for copy in entity.multi_insert() if entity.mcount > 1 else (entity,):
                yield from _parts(copy.virtual_entities(), layer, depth + 1)
        else:
            yield layer, entity


def _unit(path: Path, given: DrawnUnit | None, number: int) -> tuple[DrawnUnit, str]:
    """Return the unit of the drawing, and the source of the unit."""
    stated = STATED.get(number)
    unit = stated or ("no unit" if number == 0 else f"unit {number} of $INSUNITS, which is not accepted")
    if given is not None:
        return given, f"by --units; the drawing states {unit}" if given != stated else "by --units and by the drawing"
    if stated is None:
        raise InputError(f"{path}: the drawing states {unit}; give --units.")
    return stated, "by the drawing"


def _is_line(entity: Any) -> bool:
    return entity.dxftype() in DRAWN and not (
        entity.dxftype() == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh)
    )


def _closes(way_mm: Floats) -> bool:
    """Return True if the last point of a line repeats its first."""
    return len(way_mm) > 3 and float(np.linalg.norm(way_mm[0] - way_mm[-1])) <= MEETS_MM
