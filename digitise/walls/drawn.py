"""Move walls to where a user drew them: along a wall, over places that are surely crack, or over surely ground.

A wall is on a line along it, outside the crack strokes and inside the ground strokes. Near a stroke, the lightness
under it also moves the level at which crack ends and ground begins, so that a few strokes are enough.
"""

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from skimage.measure import points_in_poly

from digitise.crack_path.hints import listed, snap_px
from digitise.geometry.polyline import depth_inside, resampled, smoothed
from digitise.photo import Photo
from digitise.settings import PhotoInput
from digitise.walls.beside_walls import Along, Levels
from digitise.walls.wall_profile import follow
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers
from sealtwin.core.solid_figures import EndKind

Kind = Literal["crack", "ground", "wall"]
Stations = tuple[Floats, Floats, Floats]  # Centreline, left and right wall at the same stations, (n, 2) each
NAMES: dict[Kind, str] = {
    "crack": "crack_strokes_px, stroke",
    "ground": "ground_strokes_px, stroke",
    "wall": "walls_px, line",
}


# Constants of drawn lines. "widths" are crack widths.
#
# Chosen on 44 drawn roads with strokes by a clumsy hand. A longer ``REACH`` needs fewer strokes, and moves more walls
# that were right. A larger ``SAME`` leaves those alone, and mends less.
MOST_POINTS = 5000  # Points in which a line is read: a pixel apart, or farther in a longer one
BRUSH_PX = 1.0  # Half the width of a stroke
MOST_AWAY = 3.0  # Widths from the line, or twice ``snap_px``, within which a line must be, except over ground
BEYOND = 0.5  # Widths, or ``BEYOND_PX``, past the crack's ends within which a line may be
BEYOND_PX = 6.0
CLEAR = 0.25  # Widths between the line and the nearest ground stroke
NEAR, NEAR_PX = 1.0, 10.0  # Widths, or px, from its wall within which a line along it must begin and end
FAR = 1.5  # Widths from the wall that it replaces beyond which a line along a wall is doubted
REACH = 3.0  # Widths along the crack over which a stroke acts fully; over as many again, less and less
REACH_PX = 30.0  # The least such reach
OUTER = 60.0  # Percentile of the lightness under a crack stroke that is crack; for ground, 100 less it
AROUND_PX = 6.0  # Distance beyond walls and strokes, plus a width, in which light is read
LEAST_CONTRAST = 6.0  # Of lightness, between the levels of crack and ground
SAME = 0.1  # Widths, or ``SAME_PX``, by which a wall that agrees may be off; it moves from twice as much on
SAME_PX = 2.0
WALL_SMOOTHING_PX = 2.0  # Sigma of moved walls, as of followed ones
CENTRE_SMOOTHING = 0.25  # Sigma of the moved centreline in widths, and its corrections
RETURNS = 4
SURELY = 1e4  # Excess that no grain outweighs


@dataclass(frozen=True)
class Drawn:
    """Lines drawn by hand over crack, over ground and along walls, in pixels, (k, 2) each."""

    lines_px: tuple[tuple[Kind, Floats], ...] = ()

    @classmethod
    def of(cls, settings: PhotoInput) -> Self:
        kinds = (
            ("crack", settings.crack_strokes_px),
            ("ground", settings.ground_strokes_px),
            ("wall", settings.walls_px),
        )
        return cls(tuple((kind, np.array(line, dtype=float)) for kind, lines in kinds for line in lines or ()))

    @property
    def strokes_px(self) -> list[tuple[Kind, Floats]]:
        """Points of the strokes over crack and ground."""
        return [(kind, _points_px(line_px)) for kind, line_px in self.lines_px if kind != "wall"]

    def crack_in(self, ring_px: Floats) -> bool:
        """Return True if a crack stroke has a point in a ring."""
        return any(kind == "crack" and points_in_poly(each, ring_px).any() for kind, each in self.strokes_px)

    def beside(self, line_px: Floats, reach_px: float) -> NDArray[np.bool_]:
        """Return True for points of a line, (n,), within ``reach_px`` of a stroke."""
        if not self.strokes_px:
            return np.zeros(len(line_px), dtype=bool)
        places_px = np.concatenate([each_px for _, each_px in self.strokes_px])
        return np.asarray(KDTree(places_px).query(line_px)[0]) <= reach_px


NOTHING = Drawn()


class _Placed(NamedTuple):
    """A drawn line beside the crack. Its arrays have one value for each of its m points, (m,)."""

    kind: Kind
    name: str
    station: Integers
    offset_px: Floats  # To the left of the line
    place_px: Floats
    side: int = 0  # 0 if it is to the left of the crack, else 1


def with_drawn(
    photo: Photo, stations: Stations, drawn: Drawn, kinds: tuple[EndKind, EndKind]
) -> tuple[Stations, Floats, list[str]]:
    """Return the stations moved by drawn lines, the share to which those decide each wall, (2, n), and warnings.

    Of lines along one stretch of a wall, the last counts.

    Raises InputError for lines that contradict each other, that leave this crack, or that cross it as ground.
    """
    count, warnings = len(stations[0]), list[str]()
    change_px, share = np.zeros((2, 2, count))
    by_line = np.zeros((2, count), dtype=bool)
    if not drawn.lines_px:
        return stations, share, warnings
    along = Along.of(photo, *stations)
    placed = _placed(along, drawn, warnings)
    strokes = [each for each in placed if each.kind != "wall"]
    if strokes:
        change_px, acts = _by_strokes(along, strokes)
        share[:] = acts
        warnings.append(f"{max(float((acts > 0).mean()), 0.01):.0%} of the crack is beside strokes drawn by hand")
    for line in (each for each in placed if each.kind == "wall"):
        side, stretch, moved_px = _along_wall(along, line, warnings)
        change_px[side, stretch], share[side, stretch] = moved_px, 1.0
        by_line[side, stretch] = True
    # Both walls end in a tip, which nothing moves.
    share[:, [tip for kind, tip in zip(kinds, (0, -1), strict=True) if kind == "closed"]] = 0
    left_by, right_by = share * change_px * photo.mm_per_px
    aside_mm = smoothed((left_by - right_by) / 2, CENTRE_SMOOTHING * along.width_px / along.station_px, RETURNS)
    aside_mm = np.where(share.any(axis=0), aside_mm, 0)
    moves_mm = aside_mm, left_by, -right_by
    line_mm, left_mm, right_mm = (
        each_mm + by_mm[:, None] * along.ray for each_mm, by_mm in zip(stations, moves_mm, strict=True)
    )
    if by_line.any():
        warnings.append(f"{max(float(by_line.mean()), 0.01):.0%} of the walls were drawn by hand, not measured")
    return (line_mm, left_mm, right_mm), share, warnings


def _points_px(line_px: Floats) -> Floats:
    length_px = float(arc_length(line_px)[-1]) if len(line_px) > 1 else 0.0
    return resampled(line_px, max(1.0, length_px / MOST_POINTS)) if length_px > 0 else line_px[:1]


def _placed(along: Along, drawn: Drawn, warnings: list[str]) -> list[_Placed]:
    """Return the lines beside the crack, and add warnings about ground strokes that are not."""
    photo, tree = along.photo, KDTree(along.line_mm)
    onward = np.column_stack([along.ray[:, 1], -along.ray[:, 0]])
    most_px, beyond_px = max(MOST_AWAY * along.width_px, 2 * snap_px(photo)), max(BEYOND * along.width_px, BEYOND_PX)
    width, height = photo.size_px
    placed, numbers = list[_Placed](), dict.fromkeys(NAMES, 0)
    for kind, line_px in drawn.lines_px:
        numbers[kind] += 1
        name = f"photo.{NAMES[kind]} {numbers[kind]}"
        if depth_inside(line_px, (-0.5, -0.5, width - 0.5, height - 0.5)).min() < 0:
            raise InputError(f"{photo.file}: {name}, leaves the photo of {width} x {height} px; draw it inside.")
        place_px = _points_px(line_px)
        place_mm = photo.to_mm(place_px)
        station = np.asarray(tree.query(place_mm)[1])
        away_px = (place_mm - along.line_mm[station]) / photo.mm_per_px
        offset_px, past_px = ((away_px * axis[station]).sum(axis=1) for axis in (along.ray, onward))
        at_end = (station == 0) | (station == len(along.line_mm) - 1)
        off_px = np.maximum(np.abs(offset_px) - most_px, at_end * np.abs(past_px) - beyond_px)
        if kind != "ground" and off_px.max() > 0:
            raise InputError(
                f"{photo.file}: {name}, is not on this crack at {listed(place_px[[off_px.argmax()]])} px: draw it "
                f"between the crack's ends, at most {most_px:.0f} px from its line; if the crack takes another way, "
                "give via_px there."
            )
        if (off_px <= 0).any():
            beside = off_px <= 0
            placed.append(_Placed(kind, name, station[beside], offset_px[beside], place_px[beside]))
        else:
            warnings.append(f"{name}, is not beside this crack and changes nothing")
    return placed


def _along_wall(along: Along, line: _Placed, warnings: list[str]) -> tuple[int, slice, Floats]:
    """Return the side of a line along a wall, its stations, and the distance outward of each from the wall.

    Raises InputError for a line that does not begin and end at one wall.
    """
    apart_px = np.stack([line.offset_px, -line.offset_px]) - along.walls_px[:, line.station]
    side = int(np.abs(apart_px[:, [0, -1]]).max(axis=1).argmin())
    ends_px, near_px = np.abs(apart_px[side, [0, -1]]), max(NEAR * along.width_px, NEAR_PX)
    photo = along.photo
    if ends_px.max() > near_px or line.station[0] == line.station[-1]:
        raise InputError(
            f"{photo.file}: {line.name}, begins or ends {ends_px.max() * photo.mm_per_px:.1f} mm from the wall (at "
            f"most {near_px * photo.mm_per_px:.1f} mm), or both at one place of it; draw from a place on a wall to another "
            "place on the same wall."
        )
    if (far_px := np.abs(apart_px[side])).max() > FAR * along.width_px:
        warnings.append(
            f"{line.name}, is up to {far_px.max() * photo.mm_per_px:.1f} mm from the wall that the photo shows, at "
            f"{listed(line.place_px[[far_px.argmax()]])} px: check that it follows this crack"
        )
    count, total = (np.bincount(line.station, weights) for weights in (None, apart_px[side]))
    passed, stretch = np.flatnonzero(count), slice(line.station.min(), line.station.max() + 1)
    stations = np.arange(stretch.start, stretch.stop)
    return side, stretch, np.interp(stations, passed, total[passed] / count[passed])


def _by_strokes(along: Along, strokes: list[_Placed]) -> tuple[Floats, Floats]:
    """Return the distance outward by which strokes move each wall, (2, stations), and the share to which they do."""
    reach = max(REACH * along.width_px, REACH_PX) / along.station_px
    cracks = [stroke for stroke in strokes if stroke.kind == "crack"]
    for number, stroke in enumerate(strokes):
        # Ground is beside the crack strokes near it, or else beside the line.
        near = np.median(stroke.station) + (reach + np.ptp(stroke.station)) * np.array([-1, 1])
        crack_px = [each.offset_px[(each.station >= near[0]) & (each.station <= near[1])] for each in cracks]
        middle_px = np.concatenate([[0.0] * (not crack_px), *crack_px])
        side = int(stroke.offset_px.mean() < (middle_px.mean() if middle_px.size else 0))
        strokes[number] = stroke._replace(side=side)
    least_px, most_px, shift_px = _bounds_px(along, strokes)
    both_px = np.stack([shift_px, -shift_px])
    along = replace(along, line_mm=along.places_mm(shift_px), walls_px=along.walls_px - both_px)
    strokes = [stroke._replace(offset_px=stroke.offset_px - shift_px[stroke.station]) for stroke in strokes]
    least_px, most_px = np.maximum(least_px - both_px, 0), most_px - both_px
    farthest_px = max(*(float(np.abs(stroke.offset_px).max()) for stroke in strokes), np.percentile(along.walls_px, 98))
    # Within the walls, what is beyond a ground stroke is no crack.
    levels = Levels.of(
        replace(along, walls_px=np.minimum(along.walls_px, most_px)), farthest_px + along.width_px + AROUND_PX
    )
    station, even, strip = np.arange(len(along.line_mm)), levels.even, levels.strip
    crack, ground = levels.dark + np.zeros(levels.bright.shape), np.maximum(levels.bright, levels.dark + 1)
    acts, away_px = np.zeros(len(station)), np.arange(even.shape[2]) * strip.sample_px
    for stroke in strokes:
        beyond = np.maximum(np.maximum(stroke.station.min() - station, station - stroke.station.max()), 0)
        act = _eased(2 - beyond / reach)
        acts = np.maximum(acts, act)
        column = np.rint(np.abs(stroke.offset_px) / strip.sample_px).astype(int)
        under = even[(stroke.offset_px < 0).astype(int), stroke.station, np.minimum(column, even.shape[2] - 1)]
        if stroke.kind == "crack":
            crack = np.maximum(crack, levels.dark + act * (np.percentile(under, OUTER) - levels.dark))
        else:
            side, cut_px = stroke.side, np.abs(stroke.offset_px)[:, None]
            change = act * (np.percentile(under, 100 - OUTER) - levels.bright[side])
            ground[side] = np.minimum(ground[side], levels.bright[side] + change)
            walls_px = along.walls_px[:, stroke.station][..., None]
            beyond, rest = (even[each, stroke.station] for each in (side, 1 - side))
            cut, kept = (away_px > cut_px) & (away_px < walls_px[side]), away_px < walls_px[1 - side]
            if cut.any() and np.median(beyond[cut]) < np.median(rest[kept]) - LEAST_CONTRAST:
                raise InputError(
                    f"{along.photo.file}: {stroke.name}, cuts off the darker part of the crack at "
                    f"{listed(stroke.place_px[:1])} px: give via_px in that part, or paint the crack in photo.mask."
                )
    middle, contrast = ((crack + ground) / 2)[..., None], np.maximum(ground - crack, LEAST_CONTRAST)[..., None]
    excess = np.where(levels.valid, np.clip((even - middle) / contrast, -0.5, 0.5), 0)
    excess[away_px <= least_px[..., None]] -= SURELY
    excess[away_px >= most_px[..., None]] += SURELY
    place_px = smoothed(follow(excess, strip.sample_px, strip.station_px).T, WALL_SMOOTHING_PX / strip.station_px).T
    change_px = place_px - along.walls_px
    change_px *= _eased(np.abs(change_px) / max(SAME_PX, SAME * along.width_px) - 1)
    return np.clip(along.walls_px + change_px, least_px, most_px) - along.walls_px, acts


def _bounds_px(along: Along, strokes: list[_Placed]) -> tuple[Floats, Floats, Floats]:
    """Return the least and the largest distance of both walls from the line, (2, stations), by the strokes.

    The third result is how far to the left the line must be moved, (stations,), so that no ground stroke is on it.
    Raises InputError if no crack is outside the ground strokes and contains the crack strokes.
    """
    least_px, most_px = np.full(along.walls_px.shape, -np.inf), np.full(along.walls_px.shape, np.inf)
    for stroke in strokes:
        for side, outward_px in enumerate((stroke.offset_px, -stroke.offset_px)):
            if stroke.kind == "crack":
                np.maximum.at(least_px[side], stroke.station, outward_px + BRUSH_PX)
            elif side == stroke.side:
                np.minimum.at(most_px[side], stroke.station, outward_px - BRUSH_PX)
    between_px = most_px.sum(axis=0)
    beyond_px = (most_px < -along.walls_px[::-1]).any(axis=0)
    if len(against := np.flatnonzero((least_px > most_px).any(axis=0) | (between_px <= 0) | beyond_px)):
        there = [stroke for stroke in strokes if against[0] in stroke.station]
        place_px = there[-1].place_px[there[-1].station == against[0]][:1]
        raise InputError(
            f"{along.photo.file}: {' and '.join(stroke.name for stroke in there)}: no crack along the traced line "
            f"is inside the ground strokes and contains the crack strokes at {listed(place_px)} px. Remove one; if the "
            "crack takes another way, give via_px there, or paint it in photo.mask."
        )
    margin_px = np.minimum(CLEAR * along.width_px, between_px / 2)
    low_px, high_px = margin_px - most_px[1], most_px[0] - margin_px
    shift_px = smoothed(np.clip(0.0, low_px, high_px), along.width_px / along.station_px / 2, 0)
    return least_px, most_px, np.clip(shift_px, low_px, high_px)


def _eased(share: Floats) -> Floats:
    """Return 0 below 0, 1 above 1, and a smooth step between."""
    share = np.clip(share, 0, 1)
    return share**2 * (3 - 2 * share)
