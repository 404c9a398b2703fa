"""Lines of a DXF drawing, by layer: polylines, lines, arcs, splines and ellipses, in millimetres."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import ezdxf.filemanagement
import numpy as np
from ezdxf.path import make_path

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

DrawnUnit = Literal["mm", "cm", "m", "inch", "foot"]
MM: dict[DrawnUnit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "foot": 304.8}
STATED: dict[int, DrawnUnit] = {1: "inch", 2: "foot", 4: "mm", 5: "cm", 6: "m"}
"""Units by the number that a drawing states, of those that a sample may be drawn in; 0 states none."""
DRAWN = {"LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "SPLINE", "ELLIPSE"}
LARGEST_BYTES = 50_000_000
MOST_POINTS = 100_000  # Largest number of points on one layer, fifty times a traced crack's
FARTHEST_MM = 1e6  # Largest coordinate: a kilometre from the drawing's origin
SAG_MM = 0.02  # Largest distance of a curve from its chords: a fifth of a fine photo's pixel
MEETS_MM = 1e-3  # Largest gap between two lines that are one


@dataclass(frozen=True)
class DrawnLine:
    """A polyline in mm; a closed one does not repeat its first point."""

    points_mm: Floats  # (n, 2)
    closed: bool


def read_layers(path: Path, given: DrawnUnit | None) -> tuple[dict[str, list[DrawnLine]], list[str]]:
    """Return the lines of each layer that has any, seen from above, and notes.

    Lines that meet end to end are one. Raises InputError if the file is missing, too large or no DXF, if nobody states
    the unit, or if ``given`` is another one than the drawing's own.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such drawing.")
    if path.suffix.lower() == ".dwg":
        raise InputError(f"{path}: DWG is not read; save the drawing as DXF.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB; save the crack's layers alone.")
    try:
        # Its recovering reader would take 53.Q3 for 53, and nobody would know.
        drawing = ezdxf.filemanagement.readfile(path)
        space = drawing.modelspace()
        stated = STATED.get(drawing.units)
        scale = MM[_unit(path, given, stated, drawing.units)]
        pieces: dict[str, list[DrawnLine]] = {}
        left_out = 0
        for entity in space:
            if entity.dxftype() in DRAWN:
                line = _points(entity, scale)
                pieces.setdefault(entity.dxf.layer, []).extend([line] if line is not None else [])
            else:
                left_out += 1
    except InputError:
        raise
    except Exception as fault:  # ezdxf raises whatever its parsing of a damaged drawing stumbles over.
        raise InputError(
            f"{path}: no readable DXF ({str(fault) or type(fault).__name__:.80}). Save it again as DXF R2010 or newer."
        ) from fault
    for layer, lines in pieces.items():
        if sum(len(line.points_mm) for line in lines) > MOST_POINTS:
            raise InputError(f"{path}, layer {layer}: over {MOST_POINTS} points; simplify its lines.")
    notes = (
        [f"{path.name}: {left_out} texts, blocks and other things that are no lines were left out"] if left_out else []
    )
    return {layer: joined(lines) for layer, lines in pieces.items() if lines}, notes


def _unit(path: Path, given: DrawnUnit | None, stated: DrawnUnit | None, number: int) -> DrawnUnit:
    if given is not None and stated is not None and given != stated:
        raise InputError(f"{path}: the drawing states {stated}, and --units is {given}. Correct one of them.")
    if (unit := given or stated) is None:
        said = "states no unit" if number == 0 else "states a unit that no sample is drawn in"
        raise InputError(f"{path}: the drawing {said}; give --units.")
    return unit


def _points(entity: Any, scale: float) -> DrawnLine | None:
    """Return a line's points in mm; None for one of no length."""
    way = make_path(entity)
    points_mm = scale * np.array([(point.x, point.y) for point in way.flattening(SAG_MM / scale)], dtype=float)
    if not (np.abs(points_mm) < FARTHEST_MM).all():
        raise ValueError(f"a point is beyond {FARTHEST_MM:g} mm")
    kept = [0, *(1 + np.flatnonzero(np.linalg.norm(np.diff(points_mm, axis=0), axis=1) > 0))] if len(points_mm) else []
    points_mm = points_mm[kept]
    if len(points_mm) < 2:
        return None
    closed = len(points_mm) > 3 and float(np.linalg.norm(points_mm[0] - points_mm[-1])) <= MEETS_MM
    return DrawnLine(points_mm[:-1] if closed else points_mm, closed)


def joined(lines: Sequence[DrawnLine]) -> list[DrawnLine]:
    """Join open lines that meet end to end, as a CAD program's segments do."""
    done, waiting = [line for line in lines if line.closed], [line.points_mm for line in lines if not line.closed]
    while waiting:
        chain = waiting.pop()
        while (found := next(_continuations(chain, waiting), None)) is not None:
            index, chain = found
            waiting.pop(index)
        closed = len(chain) > 3 and float(np.linalg.norm(chain[0] - chain[-1])) <= MEETS_MM
        done.append(DrawnLine(chain[:-1] if closed else chain, closed))
    return done


def _continuations(chain: Floats, others: Sequence[Floats]) -> Iterator[tuple[int, Floats]]:
    for index, other in enumerate(others):
        for first in (chain, chain[::-1]):
            for second in (other, other[::-1]):
                if np.linalg.norm(first[-1] - second[0]) <= MEETS_MM:
                    yield index, np.vstack([first, second[1:]])
