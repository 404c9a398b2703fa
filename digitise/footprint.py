"""The crack and its block as seen from above: one clean region, run out past its flat ends, and where dams stand."""

from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, OpType

from digitise.settings import CrackShape
from sealtwin.errors import InputError
from sealtwin.records import EndKind, Floats, Outline, arc_length

Box = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max."""

TOLERANCE_MM = 0.003
"""The outline is simplified within this: 0.01 mm, still below a pixel, takes 0.14 % of a smooth funnel's volume."""
NECK_MM = 0.005
"""A tooth or neck of up to twice this width is noise of the trace, which booleans turn into slivers. Wider limits would
blunt sharp tips: 0.02 mm takes 0.17 % of a flare's volume there."""
PIECE_MM2 = 0.05
ISLAND_MM2 = 0.1
"""Smaller pieces and islands are noise: a quarter of the particles' section."""
ON_SIDE_MM = 0.01
"""A point this close to the block's side lies on it: the outline's file rounds to a thousandth of this."""
RUN_OUT_MM = 5.0
"""How far the walls run straight beyond an end, more than what the tilt takes: nothing of the true end is disturbed."""
HEADING_MM = 5.0
"""The direction of an end is taken over this much centreline: long against pixels, short against the crack's wander."""
CLEARANCE_MM = 0.5
"""Least thickness of sample between the crack and the block's side."""
DAM_THICKNESS_MM = 4.0
DAM_OVERLAP_MM = 4.0
"""A dam covers this much of the block's side on either hand of the opening, as tape does."""


@dataclass(frozen=True)
class FlatEnd:
    """An end that is no tip: open at the block's side, or cut by a wall across."""

    number: int
    """0 at s = 0, 1 at the far end."""
    kind: EndKind
    left_mm: Floats
    right_mm: Floats
    outward: Floats
    """Unit vector along which the crack leaves."""

    @property
    def onward(self) -> Floats:
        """Unit vector of the walk from s = 0 to the far end, here."""
        return self.outward if self.number else -self.outward

    @property
    def centre_mm(self) -> Floats:
        return (self.left_mm + self.right_mm) / 2

    @property
    def across(self) -> Floats:
        """Unit vector from the right wall to the left."""
        chord = self.left_mm - self.right_mm
        return chord / np.linalg.norm(chord)

    @property
    def run_out(self) -> Floats:
        """Outward, stretched so that one unit of it is one unit square to the end."""
        facing = np.array([self.across[1], -self.across[0]])
        square = abs(float(facing @ self.outward))
        # An end oblique by more than 80 degrees is a side of the crack; stretching it further helps nobody.
        return self.outward / max(square, 0.17)


@dataclass(frozen=True)
class Dam:
    """A plate on the outside of the block's side, over one open end."""

    end: int
    side: int
    """Index in the block's box: 0 x_min, 1 y_min, 2 x_max, 3 y_max."""
    box_mm: Box


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
    traced_area_mm2: float
    warnings: tuple[str, ...]

    @property
    def block(self) -> CrossSection:
        return rectangle(self.block_mm)


def lay_out(outline: Outline, shape: CrackShape, spread_mm: float) -> Footprint:
    """Prepare the outline for its solid; ``spread_mm`` is what the tilt may add to either side.

    Raises InputError where the outline crosses itself, is empty, or an open end does not lie at the block's side.
    """
    ring = outline.outline_mm
    traced, crossing_warnings = _traced(ring)
    ends = tuple(_flat_end(outline, number) for number in (0, 1) if outline.ends[number] != "closed")
    lean = _lean(outline.centreline_mm, shape)
    block_mm = outline.face_mm or _grown_box(ring, ends, shape, lean, spread_mm)
    if (traced ^ rectangle(block_mm)).area() < PIECE_MM2:
        raise InputError(f"The crack lies outside the face {_listed(block_mm)} mm. Check ends_px and face_mm.")
    _require_open_ends_at_side(ends, block_mm, outline.mean_width_mm)
    ends = tuple(_on_side(end, ring, block_mm, outline.mean_width_mm) for end in ends)
    reach_mm = spread_mm + RUN_OUT_MM
    run_outs = [_run_out(end, reach_mm + outline.mean_width_mm) for end in ends]
    crack, cleaning_warnings = _cleaned(CrossSection.batch_boolean([traced, *run_outs], OpType.Add))
    stoppers = [_stopper(end, reach_mm + outline.mean_width_mm) for end in ends if end.kind == "cut"]
    beyond = CrossSection.batch_boolean(stoppers, OpType.Add) ^ rectangle(block_mm) if stoppers else CrossSection()
    _require_clear(traced, beyond, outline.mean_width_mm)
    return Footprint(
        crack=crack,
        block_mm=block_mm,
        stoppers=beyond,
        ends=ends,
        lean=lean,
        traced_area_mm2=traced.area(),
        warnings=(*crossing_warnings, *cleaning_warnings),
    )


def dams(footprint: Footprint, sections: list[CrossSection]) -> tuple[Dam, ...]:
    """One plate for each open end, over all that ``sections`` (the cavity at several depths) leave open at its side.

    Raises InputError where the cavity comes out of the block anywhere else.
    """
    opened = [(end, nearest_side(end.centre_mm, footprint.block_mm)) for end in footprint.ends if end.kind == "open"]
    points = np.vstack([polygon for section in sections for polygon in section.to_polygons()])
    plates = []
    for end, side in opened:
        at_side = points[np.abs(points[:, side % 2] - footprint.block_mm[side]) < 1e-6]
        rivals = [other.centre_mm for other, other_side in opened if other_side == side and other is not end]
        for rival in rivals:
            mine = np.linalg.norm(at_side - end.centre_mm, axis=1) <= np.linalg.norm(at_side - rival, axis=1)
            at_side = at_side[mine]
        if not len(at_side):
            raise InputError(
                f"End {end.number + 1} is open, but the crack does not reach the block's side there. "
                "Move the end to the edge of the face, or make it closed or cut."
            )
        plates.append(Dam(end.number, side, _plate(at_side, side, footprint.block_mm)))
    _require_clearance(footprint.block_mm, sections, plates)
    return tuple(plates)


def rectangle(box_mm: Box) -> CrossSection:
    x_min, y_min, x_max, y_max = box_mm
    return CrossSection.square((x_max - x_min, y_max - y_min)).translate((x_min, y_min))


def _listed(box_mm: Box) -> str:
    return f"({', '.join(f'{value:g}' for value in box_mm)})"


def nearest_side(point_mm: Floats, box_mm: Box) -> int:
    """Index into the box of the side closest to the point."""
    return int(np.argmin([abs(point_mm[side % 2] - box_mm[side]) for side in range(4)]))


def _traced(ring_mm: Floats) -> tuple[CrossSection, list[str]]:
    if not np.isfinite(ring_mm).all():
        raise InputError("The outline has points that are no finite numbers. Trace it again.")
    if len(ring_mm) < 3:
        raise InputError(f"The outline has {len(ring_mm)} points; a crack needs at least 3. Trace it again.")
    x, y = ring_mm.T
    signed_mm2 = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    traced = CrossSection([ring_mm if signed_mm2 > 0 else ring_mm[::-1]], FillRule.Positive)
    if traced.area() < PIECE_MM2:
        raise InputError(f"The outline encloses {traced.area():.3g} mm²: no crack. Trace it again.")
    lost_mm2 = abs(traced.area() - abs(signed_mm2))
    if lost_mm2 < 1e-6 * traced.area():
        return traced, []
    at = _first_crossing(ring_mm)
    where = f" near ({at[0]:.1f}, {at[1]:.1f}) mm" if at is not None else ""
    if lost_mm2 > PIECE_MM2:
        raise InputError(f"Outline crosses itself{where}, over {lost_mm2:.2g} mm²; retrace there.")
    return traced, [f"Loops of {lost_mm2:.2g} mm² where the outline crosses itself{where} were left out."]


def _first_crossing(ring_mm: Floats) -> Floats | None:
    """Where two edges that are no neighbours cross."""
    start, step = ring_mm, np.roll(ring_mm, -1, axis=0) - ring_mm
    n = len(ring_mm)
    for i in range(n - 2):
        others = np.arange(i + 2, n - (i == 0))
        gap = start[others] - start[i]
        denominator = _cross(step[i], step[others])
        with np.errstate(divide="ignore", invalid="ignore"):
            own = _cross(gap, step[others]) / denominator
            other = _cross(gap, step[i]) / denominator
        hit = np.flatnonzero((own >= 0) & (own <= 1) & (other >= 0) & (other <= 1))
        if len(hit):
            return start[i] + own[hit[0]] * step[i]
    return None


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _flat_end(outline: Outline, number: int) -> FlatEnd:
    centre = outline.centreline_mm if number == 0 else outline.centreline_mm[::-1]
    index = 0 if number == 0 else -1
    ahead = min(HEADING_MM, outline.length_mm)
    s_mm = arc_length(centre)
    inside = np.array([np.interp(ahead, s_mm, centre[:, axis]) for axis in (0, 1)])
    outward = centre[0] - inside
    return FlatEnd(
        number=number,
        kind=outline.ends[number],
        left_mm=outline.left_wall_mm[index],
        right_mm=outline.right_wall_mm[index],
        outward=outward / np.linalg.norm(outward),
    )


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


def _require_open_ends_at_side(ends: tuple[FlatEnd, ...], block_mm: Box, width_mm: float) -> None:
    for end in ends:
        if end.kind != "open":
            continue
        side = nearest_side(end.centre_mm, block_mm)
        away_mm = abs(float(end.centre_mm[side % 2]) - block_mm[side])
        if away_mm > width_mm:
            raise InputError(
                f"End {end.number + 1} is open but lies {away_mm:.1f} mm inside the face. "
                "Move it to the edge of the face, or make it closed or cut."
            )


def _on_side(end: FlatEnd, ring_mm: Floats, block_mm: Box, width_mm: float) -> FlatEnd:
    """An open end with its corners where the outline meets the block's side.

    The walls' first stations lie square to the centreline: of an oblique crack one is inside the block, one outside.
    """
    if end.kind != "open":
        return end
    side = nearest_side(end.centre_mm, block_mm)
    at_side = ring_mm[np.abs(ring_mm[:, side % 2] - block_mm[side]) < ON_SIDE_MM]
    # An end as oblique as 10 degrees to the side opens over six widths of it.
    at_side = at_side[np.linalg.norm(at_side - end.centre_mm, axis=1) < 6 * width_mm]
    if len(at_side) < 2:
        return end
    to_left = at_side @ np.array([-end.onward[1], end.onward[0]])
    return replace(end, left_mm=at_side[to_left.argmax()], right_mm=at_side[to_left.argmin()])


def _run_out(end: FlatEnd, reach_mm: float) -> CrossSection:
    """The crack's straight continuation beyond an end."""
    step = reach_mm * end.run_out
    corners = np.array([end.right_mm, end.right_mm + step, end.left_mm + step, end.left_mm])
    return _region(corners)


def _stopper(end: FlatEnd, reach_mm: float) -> CrossSection:
    """Ground beyond a cut end, wide and long enough to hold all of its run-out."""
    away = np.array([end.across[1], -end.across[0]])
    away = away if away @ end.outward > 0 else -away
    # The run-out drifts sideways by as much as the cut is oblique.
    drift_mm = reach_mm * float(np.linalg.norm(end.run_out))
    side = (drift_mm + reach_mm) * end.across
    depth = (reach_mm + RUN_OUT_MM) * away
    return _region(
        np.array([end.right_mm - side, end.right_mm - side + depth, end.left_mm + side + depth, end.left_mm + side])
    )


def _region(corners: Floats) -> CrossSection:
    return CrossSection([corners], FillRule.NonZero)


def _require_clear(traced: CrossSection, stoppers: CrossSection, width_mm: float) -> None:
    buried_mm2 = (traced ^ stoppers).area()
    if buried_mm2 > width_mm**2:
        raise InputError(
            f"The crack comes back past one of its own cut ends ({buried_mm2:.1f} mm² lie beyond it). "
            "Cut it farther from its other parts."
        )


def _cleaned(crack: CrossSection) -> tuple[CrossSection, list[str]]:
    """Without slits, necks, teeth, specks and steps below the tolerances; what goes is named."""
    miter = JoinType.Miter
    closed = crack.offset(NECK_MM / 2, miter).offset(-NECK_MM / 2, miter)
    opened = closed.offset(-NECK_MM, miter).offset(NECK_MM, miter).simplify(TOLERANCE_MM)
    apart = opened.offset(-0.001, miter)
    # Only where parts touch in a point does the gap cost its 0.001 mm.
    if apart.num_contour() != opened.num_contour():
        opened = apart
    warnings, kept = [], []
    for piece in opened.decompose():
        if piece.area() < PIECE_MM2:
            warnings.append(f"Outline piece of {piece.area():.3f} mm² dropped (smaller than {PIECE_MM2} mm²).")
            continue
        kept.append(piece)
    rings = []
    for ring in (polygon for piece in kept for polygon in piece.to_polygons()):
        x, y = ring.T
        area_mm2 = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        if -ISLAND_MM2 < area_mm2 < 0:
            warnings.append(f"Island of {-area_mm2:.3f} mm² filled (smaller than {ISLAND_MM2} mm²).")
            continue
        rings.append(ring)
    if len(kept) > 1:
        warnings.append(f"The crack is in {len(kept)} pieces: it is narrower than {2 * NECK_MM} mm between them.")
    return CrossSection(rings, FillRule.Positive), warnings


def _plate(at_side: Floats, side: int, block_mm: Box) -> Box:
    """The opening and an overlap, no farther than the block's corners, standing outside the block's side."""
    along = 1 - side % 2
    low = max(float(at_side[:, along].min()) - DAM_OVERLAP_MM, block_mm[along])
    high = min(float(at_side[:, along].max()) + DAM_OVERLAP_MM, block_mm[along + 2])
    face = block_mm[side]
    inner, outer = (face - DAM_THICKNESS_MM, face) if side < 2 else (face, face + DAM_THICKNESS_MM)
    return (inner, low, outer, high) if side % 2 == 0 else (low, inner, high, outer)


def _require_clearance(block_mm: Box, sections: list[CrossSection], plates: list[Dam]) -> None:
    x_min, y_min, x_max, y_max = block_mm
    safe = rectangle((x_min + CLEARANCE_MM, y_min + CLEARANCE_MM, x_max - CLEARANCE_MM, y_max - CLEARANCE_MM))
    for plate in plates:
        safe += rectangle(_behind(plate, block_mm))
    for section in sections:
        exposed = [piece for piece in (section - safe).decompose() if piece.area() > 1e-6]
        if not exposed:
            continue
        points = np.vstack([polygon for piece in exposed for polygon in piece.to_polygons()])
        away_mm = max(0.0, float(np.min([np.abs(points[:, side % 2] - block_mm[side]).min() for side in range(4)])))
        raise InputError(
            f"Crack mouth or floor comes within {away_mm:.2g} mm of the block side, where no open end is; at least "
            f"{CLEARANCE_MM} mm must stand. Mark an open end there, or give a larger face_mm or margin_mm."
        )


def _behind(plate: Dam, block_mm: Box) -> Box:
    """The strip of block that a dam covers, short of the corners: a dam covers one side only."""
    along, strip = 1 - plate.side % 2, list(plate.box_mm)
    strip[along] = max(strip[along], block_mm[along] + CLEARANCE_MM)
    strip[along + 2] = min(strip[along + 2], block_mm[along + 2] - CLEARANCE_MM)
    strip[plate.side % 2] -= CLEARANCE_MM
    strip[plate.side % 2 + 2] += CLEARANCE_MM
    return strip[0], strip[1], strip[2], strip[3]
