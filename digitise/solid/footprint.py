"""Plan view of the crack and its block: one clean region, extended past its flat ends, and a floor of varying depth."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, Manifold, Mesh64, OpType
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay, KDTree

from digitise.geometry.mesh_topology import open_edges
from digitise.geometry.polyline import (
    Box,
    left_normals,
    nearest_side,
    rectangle,
    smoothed,
    to_left,
    unit,
)
from digitise.geometry.region import PIECE_MM2, box_region, cleaned, traced_region
from digitise.settings import CrackShape
from sealtwin.core.arc_length import arc_length, arc_length_at, at_arc_length
from sealtwin.core.arrays import lengths
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts
from sealtwin.core.records import Floats, Outline
from sealtwin.core.solid_figures import EndKind

ON_SIDE_MM = 0.01  # A point this close to the block's side is on it
# Length of straight walls beyond a flat end (run-out), in addition to the shift of the walls by the tilt
RUN_OUT_MM = 5.0
CLEAR_MM = 0.1  # Minimum thickness between a cut end's run-out and another part of the crack, and minimum run-out
HEADING_MM = 5.0  # Length of centreline that defines an end's direction: long against pixels, short against bends
NEAR_WIDTHS = 2.0  # The same length in widths, used instead if the crack turns by over 60 degrees near its end
TURNOVER_DEG = 60.0  # Angle from straight ahead beyond which a part of a blunt tip belongs to only one wall
STATION_MM = 1.0  # Spacing of the floor's corners along and across the crack: a third of the paper's width
SMOOTHED_STATIONS = 1.0  # Sigma of a Gaussian that smooths the centreline, so that noise does not turn its normals
ROOM_MM = 10.0  # Margin of the floor around the block. A dam is 4 mm thick


@dataclass(frozen=True)
class CrackEnd:
    """One end of the crack. It is closed (a tip) or flat. A flat end is open at the block's side, or cut by a wall."""

    number: int  # 0 for the end at s = 0, 1 for the far end
    kind: EndKind
    left_mm: Floats
    right_mm: Floats
    outward: Floats  # Unit vector along the crack, out of its end, (2,)

    @property
    def centre_mm(self) -> Floats:
        return (self.left_mm + self.right_mm) / 2

    @property
    def across(self) -> Floats:
        """Unit vector from the right wall of a flat end to the left wall, (2,)."""
        return unit(self.left_mm - self.right_mm)

    @property
    def facing(self) -> Floats:
        """Unit vector that points outward, square to a flat end, (2,)."""
        return to_left(self.across) * (-1 if self.number else 1)

    @property
    def run_out(self) -> Floats:
        """``outward`` scaled so that its component square to a flat end is 1, (2,)."""
        # The scale is limited for ends that are oblique by more than 80 degrees.
        return self.outward / max((self.facing @ self.outward), 0.17)

    @property
    def to_left(self) -> Floats:
        """Unit vector to the left of the direction in which s increases, (2,)."""
        return to_left(self.outward if self.number else -self.outward)


def crack_ends(outline: Outline) -> tuple[CrackEnd, CrackEnd]:
    """Return both ends of the crack. The end at s = 0 is first."""
    reaches_mm = np.minimum((HEADING_MM, NEAR_WIDTHS * outline.mean_width_mm), outline.length_mm)
    ends = []
    for number in (0, 1):
        line_mm = outline.centreline_mm[:: -1 if number else 1]
        outward, near = map(unit, line_mm[0] - at_arc_length(line_mm, arc_length(line_mm), reaches_mm))
        corners_mm = outline.left_wall_mm[-number], outline.right_wall_mm[-number]
        end = CrackEnd(number, outline.ends[number], *corners_mm, outward)
        near = end.facing if end.kind == "cut" else near
        # If the crack turns just before its end, the direction after the turn is used.
        ends.append(end if outward @ near > 0.5 else replace(end, outward=near))
    return ends[0], ends[1]


@dataclass(frozen=True)
class Sides:
    """Division of all walls, also of side cracks and islands, into left and right of the centreline."""

    walk_mm: Floats  # Centreline, extended straight past both ends, (n, 2)
    tips: tuple[CrackEnd, ...]  # Closed ends, at which the two walls join
    tip_reach_mm: float

    def left_share(self, place_mm: Floats, outward: Floats) -> Floats:
        """Return a weight for each point of the walls, (n,): 1 on the left wall and 0 on the right wall.

        Around a tip the weight changes gradually from 1 to 0. ``outward``, (n, 2), points out of the crack.
        """
        _, nearest = KDTree(self.walk_mm).query(place_mm)
        leftward = ((place_mm - self.walk_mm[nearest]) * left_normals(self.walk_mm)[nearest]).sum(axis=1)
        share = (leftward > 0).astype(float)
        for tip in self.tips:
            left_deg = np.degrees(np.arctan2(outward @ tip.to_left, outward @ tip.outward))
            around = lengths(place_mm - tip.centre_mm) < self.tip_reach_mm
            around &= np.abs(left_deg) < TURNOVER_DEG
            share[around] = 0.5 + left_deg[around] / (2 * TURNOVER_DEG)
        return share


def sides(outline: Outline, run_out_mm: float) -> Sides:
    """Divide the walls of a crack, which extend up to ``run_out_mm`` beyond the outline's ends, into left and right."""
    centre, (first, last) = outline.centreline_mm, crack_ends(outline)
    beyond = np.arange(1.0, run_out_mm + 1.0)[:, None]
    walk_mm = np.vstack([centre[0] + beyond[::-1] * first.outward, centre, centre[-1] + beyond * last.outward])
    tips = tuple(end for end in (first, last) if end.kind == "closed")
    return Sides(walk_mm, tips, outline.mean_width_mm)


@dataclass(frozen=True)
class Floor:
    """Floor of the cavity as triangles over the plane of the face, with a depth at each corner."""

    corners_mm: Floats  # (n, 2)
    depth_mm: Floats  # (n,)
    bottom_mm: float  # Height of the underside of the block, which is negative

    def depth_at_mm(self, place_mm: Floats) -> Floats:
        """Return the depth of the floor below points on the face, (n,)."""
        return LinearNDInterpolator(self._triangles, self.depth_mm)(place_mm)

    @cached_property
    def ground(self) -> Manifold:
        """Body of the material below the floor."""
        count = len(self.corners_mm)
        top = self._triangles.simplices.astype(np.int64)
        a, b = open_edges(top).T
        sides = np.vstack([np.column_stack([b, a, a + count]), np.column_stack([b, a + count, b + count])])
        levels_mm = (-self.depth_mm, np.full(count, self.bottom_mm))
        vertices = np.vstack([np.column_stack([self.corners_mm, z_mm]) for z_mm in levels_mm])
        faces = np.vstack([top, top[:, ::-1] + count, sides])
        return Manifold(Mesh64(vertices, faces.astype(np.uint64)))

    @cached_property
    def _triangles(self) -> Delaunay:
        return Delaunay(self.corners_mm)


@dataclass(frozen=True)
class Footprint:
    """Regions of the solid in plan view, at the level of the traced walls."""

    crack: CrossSection  # Crack, extended past flat ends. Each of its edges is a wall
    block_mm: Box
    stoppers: CrossSection  # Solid material beyond cut ends, inside the block
    ends: tuple[CrackEnd, ...]  # Flat ends
    lean: Floats  # Unit vector from the mouth to the floor, if the walls lean, (2,)
    sides: Sides
    floor: Floor | None  # None if the floor is a plane
    warnings: Facts

    @property
    def block(self) -> CrossSection:
        return box_region(self.block_mm)


def lay_out(outline: Outline, shape: CrackShape, spread_mm: float) -> Footprint:
    """Prepare the outline for its solid. The tilt may shift walls by up to ``spread_mm`` to either side.

    Raises InputError if the crack is not on the face, if an open end is not at the edge of the face, or if the crack
    touches its own cut end.
    """
    ring, width_mm = outline.outline_mm, outline.mean_width_mm
    traced, crossing_warnings = traced_region(ring, outline.islands_mm)
    ends = tuple(end for end in crack_ends(outline) if end.kind != "closed")
    lean = _lean(outline.centreline_mm, shape)
    block_mm = outline.face_mm or _grown_box(ring, ends, shape, lean, spread_mm)
    block = box_region(block_mm)
    ends = tuple(_on_side(end, ring, block_mm, width_mm) if end.kind == "open" else end for end in ends)
    reach_mm = spread_mm + RUN_OUT_MM + width_mm
    opens = shape.tilting.away > 0
    # The run-out of a funnel also narrows from its far end, and the run-out of leaning walls moves.
    least_reach_mm = CLEAR_MM + spread_mm * (not opens)
    # In a straight crack, the tilt moves no part into the stopper that is farther from the end than this plus a width.
    near_mm = max(spread_mm * (1 + opens), 5 * CLEAR_MM)
    grown_mm = spread_mm * opens + CLEAR_MM / 2
    steps_mm = np.arange(0.0, spread_mm * shape.tilting.lean + CLEAR_MM / 2, CLEAR_MM / 2)

    def swept(part: CrossSection) -> CrossSection:
        """Return the union of the regions that a part of the crack covers at all depths, with some clearance."""
        part = part.simplify(CLEAR_MM / 4)
        moved = [part.translate((x, y)) for x, y in steps_mm[:, None] * lean]
        return CrossSection.batch_boolean(moved, OpType.Add).offset(grown_mm, JoinType.Square)

    beyond_ends = [_beyond(end, traced, near_mm, (reach_mm, least_reach_mm), swept) for end in ends]
    crack, cleaning_warnings = cleaned(
        CrossSection.batch_boolean([traced, *(run_out for run_out, _ in beyond_ends)], OpType.Add)
    )
    beyond = CrossSection.batch_boolean([stopper for _, stopper in beyond_ends], OpType.Add) ^ block
    if ((traced ^ block) - beyond).area() < PIECE_MM2:
        limits = ", ".join(f"{value:g}" for value in block_mm)
        raise InputError(f"No part of the crack is on the face, ({limits}) mm. Check ends_px and face_mm.")
    breadth_mm = KDTree(outline.centreline_mm).query(np.vstack(traced.to_polygons()))[0].max()
    return Footprint(
        crack=crack,
        block_mm=block_mm,
        stoppers=beyond,
        ends=ends,
        lean=lean,
        sides=sides(outline, reach_mm),
        floor=lay_floor(outline.centreline_mm, shape, breadth_mm + spread_mm, block_mm),
        warnings=(*crossing_warnings, *cleaning_warnings),
    )


def _on_side(end: CrackEnd, ring_mm: Floats, block_mm: Box, width_mm: float) -> CrackEnd:
    """Return an open end with its corners at the points where the outline meets the block's side.

    Raises InputError if the end is far inside the face.
    """
    side = nearest_side(end.centre_mm, block_mm)
    away_mm = abs(end.centre_mm[side % 2] - block_mm[side])
    if away_mm > width_mm:
        raise InputError(
            f"End {end.number + 1} is open, but it is {away_mm:.1f} mm inside the face. Move it to the edge of the "
            "face, or make it closed or cut."
        )
    # The first stations of the walls are square to the centreline. If the crack is oblique, they are not on the side.
    at_side = ring_mm[np.abs(ring_mm[:, side % 2] - block_mm[side]) < ON_SIDE_MM]
    # An end at 10 degrees to the side opens over six crack widths of the side.
    at_side = at_side[lengths(at_side - end.centre_mm) < 6 * width_mm]
    if len(at_side) < 2:
        return end
    leftward = at_side @ end.to_left
    return replace(end, left_mm=at_side[leftward.argmax()], right_mm=at_side[leftward.argmin()])


def _beyond(
    end: CrackEnd,
    traced: CrossSection,
    near_mm: float,
    reaches_mm: tuple[float, float],
    swept: Callable[[CrossSection], CrossSection],
) -> tuple[CrossSection, CrossSection]:
    """Return the run-out of a flat end, and its stopper: the material beyond a cut, which fills the tilted run-out.

    Other parts of the crack are cut out of the stopper, at all positions to which the tilt moves them (``swept``). This
    includes parts farther than ``near_mm`` that only the tilt moves into the stopper. If other parts are just beyond
    the end, the shorter of the two reaches is used. Raises InputError if the crack touches its own end.
    """
    (x, y), touching_mm2, width_mm = end.centre_mm, 0.0, np.linalg.norm(end.left_mm - end.right_mm)
    for reach_mm in reaches_mm:
        run_out = _strip(end.right_mm, end.left_mm, reach_mm * end.run_out)
        if end.kind == "open":
            return run_out, CrossSection()
        oblique = np.linalg.norm(end.run_out)
        # The run-out of an oblique cut moves sideways.
        side = reach_mm * (1 + oblique) * end.across
        stopper = _strip(end.right_mm - side, end.left_mm + side, (reaches_mm[0] + reach_mm) * end.facing)
        around = CrossSection.circle(float(oblique * (near_mm + width_mm))).translate((x, y))
        behind = _strip(end.right_mm, end.left_mm, -CLEAR_MM * end.facing)
        near = [part for part in (traced ^ around).decompose() if not (part ^ behind).is_empty()]
        rest = CrossSection.batch_boolean([traced, stopper, *near], OpType.Subtract)
        filled = swept(run_out) ^ stopper
        parts = [(part, swept(part)) for part in (*(traced ^ stopper).decompose(), rest)]
        apart = [room for _, room in parts if (room ^ filled).is_empty()]
        if sum(part.area() for part, room in parts if room not in apart) <= width_mm**2:
            return run_out, CrossSection.batch_boolean([stopper, *apart], OpType.Subtract)
        touching_mm2 = sum((room ^ filled).area() for _, room in parts)
    raise InputError(
        f"The crack is cut at ({x:.1f}, {y:.1f}) mm, but it bends back there: with their tilt, its other parts cover "
        f"{touching_mm2:.1f} mm² of the wall that closes this end. Move the end away from the crack's other parts, "
        "in ends_px or with 'sealtwin trace'."
    )


def _strip(right_mm: Floats, left_mm: Floats, step_mm: Floats) -> CrossSection:
    """Return the region that the line between two points covers when the line moves by ``step_mm``."""
    return CrossSection([np.array([right_mm, right_mm + step_mm, left_mm + step_mm, left_mm])], FillRule.NonZero)


def _lean(centreline_mm: Floats, shape: CrackShape) -> Floats:
    """Return the unit vector from mouth to floor, (2,). It is square to the line between the crack's ends.

    Raises InputError if leaning walls are chosen and the crack ends where it began.
    """
    chord_mm = centreline_mm[-1] - centreline_mm[0]
    length_mm = np.linalg.norm(chord_mm)
    if shape.tilting.lean and length_mm < 0.05 * arc_length(centreline_mm)[-1]:
        raise InputError('The crack ends where it began, so the walls have no side to lean to. Choose tilt = "flare".')
    return to_left(chord_mm) / max(length_mm, 1e-9) * (1.0 if shape.lean_to == "left" else -1.0)


def _grown_box(ring_mm: Floats, ends: tuple[CrackEnd, ...], shape: CrackShape, lean: Floats, spread_mm: float) -> Box:
    """Return the bounding box of mouth and floor with a margin. Sides with open ends have no margin."""
    box = np.concatenate([ring_mm.min(axis=0), ring_mm.max(axis=0)])
    reached_mm = np.vstack([ring_mm, ring_mm + spread_mm * shape.tilting.lean * lean])
    around_mm = shape.margin_mm + spread_mm * (shape.tilting.away > 0)
    grown = np.concatenate([reached_mm.min(axis=0) - around_mm, reached_mm.max(axis=0) + around_mm])
    sides = [nearest_side(end.centre_mm, tuple(box)) for end in ends if end.kind == "open"]
    grown[sides] = box[sides]
    x_min, y_min, x_max, y_max = grown.tolist()
    return x_min, y_min, x_max, y_max


def lay_floor(centreline_mm: Floats, shape: CrackShape, reach_mm: float, box_mm: Box) -> Floor | None:
    """Return the floor for a table of depths. None if the depth is constant.

    Each point has the depth at the nearest point of the centreline. The cavity extends up to ``reach_mm`` from that
    line.
    """
    s_mm, line_mm = _stations(centreline_mm, shape)
    if np.ptp(shape.depth_at_mm(s_mm)) == 0:
        return None
    own_mm = arc_length(line_mm)
    across_mm = np.arange(-np.ceil(reach_mm / STATION_MM), np.ceil(reach_mm / STATION_MM) + 1) * STATION_MM
    # At its ends, the line continues with the same curvature.
    along = np.gradient(line_mm, own_mm, axis=0, edge_order=2 if len(line_mm) > 2 else 1)
    square = to_left(along) / lengths(along)[:, None]
    places_mm = (line_mm[:, None] + across_mm[:, None] * square[:, None]).reshape(-1, 2)
    straying_mm = np.abs(arc_length_at(places_mm, line_mm) - np.repeat(own_mm, len(across_mm)))
    # The corners of dams need a depth too.
    low = np.minimum(places_mm.min(axis=0), box_mm[:2]) - ROOM_MM
    high = np.maximum(places_mm.max(axis=0), box_mm[2:]) + ROOM_MM
    around_mm = rectangle((low[0], low[1], high[0], high[1]))
    corners_mm = np.vstack([places_mm[straying_mm < STATION_MM / 4], around_mm])
    nearest_s_mm = np.interp(arc_length_at(corners_mm, line_mm), own_mm, s_mm)
    return Floor(corners_mm, shape.depth_at_mm(nearest_s_mm), -shape.deepest_mm - shape.floor_thickness_mm)


def _stations(centreline_mm: Floats, shape: CrackShape) -> tuple[Floats, Floats]:
    """Return stations, (n,), including the depth table's stations, and the smoothed centreline at them, (n, 2)."""
    s_mm = arc_length(centreline_mm)
    even_mm = np.linspace(0.0, s_mm[-1], max(2, 1 + round(s_mm[-1] / STATION_MM)))
    smooth_mm = smoothed(at_arc_length(centreline_mm, s_mm, even_mm), SMOOTHED_STATIONS)
    table_mm = shape.depth_stations_mm
    table_mm = table_mm[(table_mm > 0) & (table_mm < s_mm[-1])]
    # Stations of the table replace the even stations next to them.
    clear = (np.abs(even_mm[:, None] - table_mm) > STATION_MM / 4).all(axis=1)
    clear[[0, -1]] = True
    stations_mm = np.union1d(even_mm[clear], table_mm)
    return stations_mm, at_arc_length(smooth_mm, even_mm, stations_mm)
