"""Lines of a DXF drawing: polylines, lines, arcs, splines and ellipses of the requested layers, in millimetres."""

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

import ezdxf.filemanagement
import numpy as np
from ezdxf.path import make_path

from digitise.drawing.join_lines import DrawnLine, closes, joined, without_copies
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

DrawnUnit = Literal["mm", "cm", "m", "inch", "foot"]
MM: dict[DrawnUnit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "foot": 304.8}
STATED: dict[int, DrawnUnit] = {1: "inch", 2: "foot", 4: "mm", 5: "cm", 6: "m"}
"""Accepted units by their code, $INSUNITS; code 0 means unspecified."""
METRIC = 1  # $MEASUREMENT of a metric drawing; 0 is one in inches
DRAWN = {"LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "SPLINE", "ELLIPSE"}
LARGEST_BYTES = 50_000_000
MOST_POINTS = 100_000  # Largest number of points on one layer, fifty times a traced crack's
FARTHEST_MM = 1e6  # Largest coordinate: a kilometre from the drawing's origin
SAG_MM = 0.02  # Largest distance of a curve from its chords, and of a level line from level: a fifth of a photo's pixel
MOST_NAMED = 8  # Most layers that a note lists
DEEPEST = 16  # Deepest nesting of blocks that is searched


class Drawing:
    """A drawing. Its layers are read on demand, and upper and lower case in their names are equal."""

    def __init__(self, file: Path, document: Any, unit: DrawnUnit, unit_source: str) -> None:
        self.file, self.unit_source = file, unit_source
        self.unit: DrawnUnit = unit
        self.notes = list[str]()
        self._document = document
        self._entities = dict[str, list[Any]]()
        self._spelled = dict[str, str]()
        for entity in document.modelspace():
            name = str(entity.dxf.get("layer", "0"))
            self._entities.setdefault(name.upper(), []).append(entity)
            self._spelled.setdefault(name.upper(), name)
        self._lines = dict[str, list[DrawnLine]]()
        self._pieces = dict[str, list[DrawnLine]]()
        self._heights_mm = dict[str, list[float]]()
        self._left_out = dict[str, Counter[str]]()
        self._block_lines = dict[str, Counter[str]]()

    @property
    def per_unit_mm(self) -> float:
        return MM[self.unit]

    def lines(self, layer: str) -> list[DrawnLine]:
        """Return the visible lines of a layer in plan view; those that meet end to end are joined.

        Raises InputError for a line that is not level or far from the drawing's origin, and for too many points.
        """
        key = layer.upper()
        if key not in self._lines:
            self._lines[key] = self._read(layer)
            if self._left_out[key]:
                self.notes.append(f"{self.file.name}, layer {layer}: left out: {self.left_out(layer)}")
        return self._lines[key]

    def pieces(self, layer: str) -> list[DrawnLine]:
        """Return the lines of a layer before they are joined."""
        self.lines(layer)
        return self._pieces[layer.upper()]

    def require_level(self, *layers: str) -> None:
        """Raise InputError unless the lines of these layers are all at one height."""
        heights_mm = [height_mm for layer in layers for height_mm in self._heights_mm[layer.upper()]]
        if heights_mm and (rise_mm := max(heights_mm) - min(heights_mm)) > SAG_MM:
            raise InputError(
                f"{self.file}, layer {' and '.join(layers)}: the lines are not level: z is "
                f"{min(heights_mm) / self.per_unit_mm:.4g} to {max(heights_mm) / self.per_unit_mm:.4g} {self.unit}, "
                f"{rise_mm:.3g} mm apart. A drawing is read in plan view: move it into the XY plane."
            )

    def left_out(self, layer: str) -> str:
        """List what the layer has other than visible lines; empty if there is nothing."""
        self.lines(layer)
        return ", ".join(f"{what} ({count})" for what, count in self._left_out[layer.upper()].items())

    def with_lines(self) -> list[str]:
        """Return the names of the layers that have lines, visible or not."""
        return [
            self._spelled[key]
            for key, entities in self._entities.items()
            if any(_is_line(entity) for entity in entities)
        ]

    def not_read(self) -> list[str]:
        """Return a note of the layers that were not read; empty if all were."""
        others = [name for key, name in self._spelled.items() if key not in self._lines]
        if not others:
            return []
        more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
        return [f"{self.file.name}: layers that were not read: {', '.join(others[:MOST_NAMED])}{more}"]

    def size(self, points_mm: Floats) -> str:
        """Return the extent of points in words, in the drawing's unit, and in mm if the unit differs."""
        x, y = np.ptp(points_mm, axis=0)
        in_mm = f"{x:.4g} x {y:.4g} mm"
        drawn = f"{x / self.per_unit_mm:.4g} x {y / self.per_unit_mm:.4g} {self.unit}"
        return in_mm if self.unit == "mm" else f"{drawn} = {in_mm}"

    def place(self, place_mm: Floats) -> str:
        """Return a place in words, in the drawing's own numbers."""
        x, y = place_mm / self.per_unit_mm
        return f"({x:.7g}, {y:.7g})"

    def _read(self, layer: str) -> list[DrawnLine]:
        key = layer.upper()
        left_out, lines, heights_mm = Counter[str](), list[DrawnLine](), list[float]()
        self._left_out[key] = left_out
        hidden = self._hidden(layer)
        points = 0
        for entity in self._entities.get(key, ()):
            if not _is_line(entity):
                # A block's own lines on this layer are counted below, whichever layer the block is on.
                left_out.update([] if entity.dxftype() == "INSERT" else [_kind(entity)])
            elif hidden or entity.dxf.get("invisible", 0):
                left_out[hidden or "invisible lines"] += 1
            else:
                places_mm = self._points_mm(entity, layer)
                points += len(places_mm)
                if points > MOST_POINTS:
                    raise InputError(
                        f"{self.file}, layer {layer}: it has over {MOST_POINTS} points; simplify its lines."
                    )
                if _has_width(entity):
                    left_out["pen widths of polylines"] += 1
                heights_mm += [float(places_mm[:, 2].min()), float(places_mm[:, 2].max())] if len(places_mm) else []
                line = _line(places_mm[:, :2])
                if line is None:
                    left_out["lines of no length"] += 1
                else:
                    lines.append(line)
        self._heights_mm[key] = heights_mm
        self.require_level(layer)
        self._count_elsewhere(key, left_out)
        self._pieces[key] = once = without_copies(lines)
        done = joined(once)
        rings = without_copies(done)
        if copies := len(lines) - len(once) + len(done) - len(rings):
            left_out["exact copies of lines"] += copies
        return rings

    def _hidden(self, layer: str) -> str:
        """Return the reason why a layer is hidden; empty if it is visible."""
        layers = self._document.layers
        if layer not in layers:
            return ""
        entry = layers.get(layer)
        if entry.is_off():
            return "lines on a layer that is switched off"
        return "lines on a layer that is frozen" if entry.is_frozen() else ""

    def _points_mm(self, entity: Any, layer: str) -> Floats:
        """Return a line's points in mm, (n, 3)."""
        kind = f"{entity.dxftype()} #{entity.dxf.get('handle', '?')}"
        try:
            points = np.array([tuple(point) for point in _flattened(entity, SAG_MM / self.per_unit_mm)], dtype=float)
        except Exception as fault:  # ezdxf raises many types of errors for a damaged line.
            raise InputError(
                f"{self.file}, layer {layer}: its {kind} cannot be read ({str(fault) or type(fault).__name__:.80}). "
                "Draw it as a polyline."
            ) from fault
        points_mm = self.per_unit_mm * points.reshape(-1, 3)
        if not (beside := np.abs(points_mm) < FARTHEST_MM).all():
            far = points_mm[~beside.all(axis=1)][0] / self.per_unit_mm
            raise InputError(
                f"{self.file}, layer {layer}: its {kind} has a point at ({far[0]:.6g}, {far[1]:.6g}, {far[2]:.6g}), "
                f"which is not within {FARTHEST_MM / 1e6:g} km of the origin. Move the drawing to the origin, or "
                "delete that line."
            )
        return points_mm

    def _count_elsewhere(self, key: str, left_out: "Counter[str]") -> None:
        """Count the lines of a layer in blocks, and on sheets of paper."""
        for entities in self._entities.values():
            for entity in entities:
                if entity.dxftype() == "INSERT":
                    name, own = str(entity.dxf.get("name", "")), str(entity.dxf.get("layer", "0")).upper()
                    by_layer = self._in_block(name, ())
                    # A block's lines on layer 0 belong to the layer on which the block is inserted.
                    if count := by_layer[key] * (key != "0") + by_layer["0"] * (key == own):
                        left_out[f'lines in the block "{name}" (explode it)'] += count
        for layout in self._document.layouts:
            if layout.name != self._document.modelspace().name:
                count = sum(_is_line(entity) and str(entity.dxf.get("layer", "0")).upper() == key for entity in layout)
                if count:
                    left_out[f'lines on the sheet "{layout.name}" (move them to model space)'] += count

    def _in_block(self, name: str, within: tuple[str, ...]) -> "Counter[str]":
        """Return the number of lines in a block and in the blocks inside it, by layer."""
        block = self._document.blocks.get(name)
        if block is None or name in within or len(within) > DEEPEST:
            return Counter()
        if name not in self._block_lines:
            by_layer = Counter[str]()
            for entity in block:
                layer = str(entity.dxf.get("layer", "0")).upper()
                if entity.dxftype() == "INSERT":
                    inside = self._in_block(str(entity.dxf.get("name", "")), (*within, name))
                    for where, count in inside.items():
                        by_layer[layer if where == "0" else where] += count
                elif _is_line(entity):
                    by_layer[layer] += 1
            self._block_lines[name] = by_layer
        return self._block_lines[name]


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
    try:
        # ezdxf's recovering reader would silently read 53.Q3 as 53.
        document = ezdxf.filemanagement.readfile(path)
        number, system = document.units, document.header.get("$MEASUREMENT", None)
        drawing = Drawing(path, document, *_unit(path, given, number, system))
    except InputError:
        raise
    except Exception as fault:  # ezdxf raises many types of errors for a damaged drawing.
        raise InputError(
            f"{path}: not a readable DXF ({str(fault) or type(fault).__name__:.80}). Save it again as DXF R2010 or "
            "newer."
        ) from fault
    return drawing


def _unit(path: Path, given: DrawnUnit | None, number: int, system: Any) -> tuple[DrawnUnit, str]:
    """Return the unit of the drawing, and the source of the unit."""
    stated = STATED.get(number)
    unit = stated or ("no unit" if number == 0 else f"unit {number} of $INSUNITS, which is not accepted")
    if given is not None:
        return given, f"by --units; the drawing states {unit}" if given != stated else "by --units and by the drawing"
    if stated is None:
        raise InputError(f"{path}: the drawing states {unit}; give --units.")
    doubt = ""
    # The reverse is the default of many programs, and means nothing.
    if system == METRIC and stated in ("inch", "foot"):
        doubt = ", though its $MEASUREMENT is metric: if it was drawn in mm, give --units mm"
    return stated, f"by the drawing{doubt}"


def _is_line(entity: Any) -> bool:
    return entity.dxftype() in DRAWN and not (
        entity.dxftype() == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh)
    )


def _kind(entity: Any) -> str:
    return "POLYLINE with faces" if entity.dxftype() == "POLYLINE" else entity.dxftype()


def _has_width(entity: Any) -> bool:
    """Return True for a polyline with a pen width, which may be meant as the crack's width."""
    if entity.dxftype() == "LWPOLYLINE":
        return bool(entity.dxf.get("const_width", 0)) or any(begin or end for begin, end in entity.get_points("se"))
    if entity.dxftype() != "POLYLINE":
        return False
    return any(entity.dxf.get(name, 0) for name in ("default_start_width", "default_end_width"))


def _flattened(entity: Any, sag: float) -> Iterable[Any]:
    if entity.dxftype() == "LINE":
        # Ten times as fast as by a path, for the same two points.
        return entity.dxf.start, entity.dxf.end
    if entity.dxftype() == "POLYLINE" and any(_is_frame(vertex) for vertex in entity.vertices):
        # A spline-fit polyline keeps both the curve and the frame that it was fitted to.
        entity.vertices[:] = [vertex for vertex in entity.vertices if not _is_frame(vertex)]
    return make_path(entity).flattening(sag)


def _is_frame(vertex: Any) -> bool:
    return bool(vertex.dxf.get("flags", 0) & vertex.SPLINE_FRAME_CONTROL_POINT)


def _line(points_mm: Floats) -> DrawnLine | None:
    """Return a polyline without repeated points; None if its length is zero."""
    distinct = (
        [0, *(1 + np.flatnonzero(np.linalg.norm(np.diff(points_mm, axis=0), axis=1) > 0))] if len(points_mm) else []
    )
    points_mm = points_mm[distinct]
    if len(points_mm) < 2:
        return None
    closed = closes(points_mm)
    return DrawnLine(points_mm[:-1] if closed else points_mm, closed)
