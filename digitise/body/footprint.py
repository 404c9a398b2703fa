"""The crack and its block as seen from above: one clean region, run out past its flat ends."""

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, OpType
from scipy.spatial import KDTree

from digitise.body.flat_ends import RUN_OUT_MM, FlatEnd, flat_ends, on_side, require_open_ends_at_side, run_out, stopper
from digitise.body.floor import Floor, lay_floor
from digitise.body.sides import Sides, sides
from digitise.geometry.region import PIECE_MM2, Box, cleaned, nearest_side, rectangle, traced_region
from digitise.settings import CrackShape
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, arc_length


@dataclass(frozen=True)
class Footprint:
    """What the solid is made of, seen from above at the level of the traced walls."""

    crack: CrossSection
    """Run out past flat ends; every edge of it is a wall."""
    block_mm: Box
    stoppers: CrossSection
    """Solid ground beyond cut ends, inside the block."""
    ends: tuple[FlatEnd, ...]
    lean: Floats
    """Unit vector from the mouth to where the floor lies, if the walls lean."""
    sides: Sides
    floor: Floor | None
    """None where it is a plane."""
    warnings: tuple[str, ...]

    @property
    def block(self) -> CrossSection:
        return rectangle(self.block_mm)


def lay_out(outline: Outline, shape: CrackShape, spread_mm: float) -> Footprint:
    """Prepare the outline for its solid; ``spread_mm`` is what the tilt may add to either side.

    Raises InputError where the outline crosses itself, is empty, or an open end does not lie at the block's side.
    """
    ring = outline.outline_mm
    traced, crossing_warnings = traced_region(ring, outline.islands_mm)
    ends = flat_ends(outline)
    lean = _lean(outline.centreline_mm, shape)
    block_mm = outline.face_mm or _grown_box(ring, ends, shape, lean, spread_mm)
    require_open_ends_at_side(ends, block_mm, outline.mean_width_mm)
    ends = tuple(on_side(end, ring, block_mm, outline.mean_width_mm) for end in ends)
    reach_mm = spread_mm + RUN_OUT_MM + outline.mean_width_mm
    run_outs = [run_out(end, reach_mm) for end in ends]
    crack, cleaning_warnings = cleaned(CrossSection.batch_boolean([traced, *run_outs], OpType.Add))
    stoppers = [stopper(end, reach_mm, spread_mm) for end in ends if end.kind == "cut"]
    beyond = CrossSection.batch_boolean(stoppers, OpType.Add) ^ rectangle(block_mm) if stoppers else CrossSection()
    _require_clear(traced, beyond, outline.mean_width_mm)
    if ((traced ^ rectangle(block_mm)) - beyond).area() < PIECE_MM2:
        raise InputError(f"No crack lies on the face {_listed(block_mm)} mm. Check ends_px and face_mm.")
    return Footprint(
        crack=crack,
        block_mm=block_mm,
        stoppers=beyond,
        ends=ends,
        lean=lean,
        sides=sides(outline, reach_mm),
        floor=lay_floor(outline.centreline_mm, shape, _breadth_mm(outline, traced) + spread_mm, block_mm),
        warnings=(*crossing_warnings, *cleaning_warnings),
    )


def _breadth_mm(outline: Outline, traced: CrossSection) -> float:
    """How far from the centreline the crack reaches."""
    away_mm, _ = KDTree(outline.centreline_mm).query(np.vstack(traced.to_polygons()))
    return float(away_mm.max())


def _lean(centreline_mm: Floats, shape: CrackShape) -> Floats:
    """Square to the crack's mean direction, which is its chord: the mean of the tangent over the arc."""
    chord = centreline_mm[-1] - centreline_mm[0]
    length_mm = float(np.linalg.norm(chord))
    if length_mm < 0.05 * arc_length(centreline_mm)[-1]:
        if shape.tilt == "lean":
            raise InputError('The crack ends where it began, so it has no side to lean to. Choose tilt = "flare".')
        return np.zeros(2)
    to_left = np.array([-chord[1], chord[0]]) / length_mm
    return to_left if shape.lean_to == "left" else -to_left


def _grown_box(ring_mm: Floats, ends: tuple[FlatEnd, ...], shape: CrackShape, lean: Floats, spread_mm: float) -> Box:
    """Bounding box of mouth and floor with the margin around; no margin where an open end lies."""
    low, high = ring_mm.min(axis=0), ring_mm.max(axis=0)
    box = np.concatenate([low, high])
    sides = [nearest_side(end.centre_mm, tuple(box)) for end in ends if end.kind == "open"]
    floor = spread_mm * lean if shape.tilt == "lean" else np.zeros(2)
    mouth_mm = spread_mm if shape.tilt == "flare" else 0.0
    grown = np.concatenate(
        [
            np.minimum(low, low + floor) - mouth_mm - shape.margin_mm,
            np.maximum(high, high + floor) + mouth_mm + shape.margin_mm,
        ]
    )
    grown[sides] = box[sides]
    return float(grown[0]), float(grown[1]), float(grown[2]), float(grown[3])


def _require_clear(traced: CrossSection, stoppers: CrossSection, width_mm: float) -> None:
    buried_mm2 = (traced ^ stoppers).area()
    if buried_mm2 > width_mm**2:
        raise InputError(
            f"The crack comes back past one of its own cut ends ({buried_mm2:.1f} mm² lie beyond it). "
            "Cut it farther from its other parts."
        )


def _listed(box_mm: Box) -> str:
    return f"({', '.join(f'{value:g}' for value in box_mm)})"
