"""Move walls by strokes that a user drew over places that are surely crack or surely ground.

A wall passes outside the crack strokes and inside the ground strokes. Near a stroke, the lightness under it also moves
the level at which crack ends and ground begins, so that a few strokes are enough.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.spatial import KDTree
from skimage.measure import points_in_poly

from digitise.crack_path.hints import listed, snap_px
from digitise.geometry.polyline import depth_inside, left_normals, resampled, smoothed
from digitise.image.raster import lightness, sampled
from digitise.photo import Photo
from digitise.settings import PhotoInput
from digitise.walls.straightened import Strip, patch_around, straighten
from digitise.walls.wall_profile import follow, outward, refined_to_subpixel, steadied
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers
from sealtwin.core.solid_figures import EndKind

Kind = Literal["crack", "ground"]
Stations = tuple[Floats, Floats, Floats]  # Centreline, left and right wall at the same stations, (n, 2) each


# Constants of strokes. "widths" are crack widths.
#
# Chosen on 44 drawn roads with strokes by a clumsy hand. A longer ``REACH`` needs fewer strokes, and moves more walls
# that were right. A larger ``SAME`` leaves those alone, and mends less.
MOST_POINTS = 5000  # Points in which a stroke is read: a pixel apart, or farther in a longer one
BRUSH_PX = 1.0  # Half the width of a stroke
LEAST_BEYOND_PX = 3.0  # From a ground stroke to a wall; if less is left, that wall is on its side
MOST_AWAY = 3.0  # Widths from the line, or twice ``snap_px``, within which a crack stroke must be
BEYOND = 0.5  # Widths, or ``BEYOND_PX``, past the crack's ends within which a stroke may be
BEYOND_PX = 6.0
CLEAR = 0.25  # Widths between the line and the nearest ground stroke
REACH = 3.0  # Widths along the crack over which a stroke acts fully; over as many again, less and less
REACH_PX = 30.0  # The least such reach
OUTER = 60.0  # Percentile of the lightness under a crack stroke that is crack; for ground, 100 less it
ALONG = 0.25  # Widths of the median along the crack
GROUND = 1.0  # Widths beside a wall, plus ``GROUND_PX``, that give the ground's lightness
GROUND_PX = 4.0
LEAST_CONTRAST = 6.0  # Of lightness, that must be left beside a wall for a new level there
LEAST_SHARE = 0.2  # The same as a share of the contrast without strokes
SAME = 0.1  # Widths, or ``SAME_PX``, by which a wall that agrees may be off; it moves from twice as much on
SAME_PX = 2.0
SHARP_PX = 1.2  # Sigma of an edge's blur
WALL_SMOOTHING_PX = 2.0  # Sigma of moved walls, as of followed ones
CENTRE_SMOOTHING = 0.25  # Sigma of the moved centreline in widths, and its corrections
RETURNS = 4
SURELY = 1e4  # Excess that no grain outweighs


@dataclass(frozen=True)
class Strokes:
    """Lines over places that are surely crack or surely ground, in pixels, (k, 2) each."""

    crack_px: tuple[Floats, ...] = ()
    ground_px: tuple[Floats, ...] = ()

    @classmethod
    def of(cls, settings: PhotoInput) -> Self:
        given = settings.crack_strokes_px, settings.ground_strokes_px
        crack_px, ground_px = (tuple(np.array(line, dtype=float) for line in lines or ()) for lines in given)
        return cls(crack_px, ground_px)

    def __bool__(self) -> bool:
        return bool(self.crack_px or self.ground_px)

    def crack_in(self, ring_px: Floats) -> bool:
        """Return True if a crack stroke has a point in a ring."""
        return any(points_in_poly(_points_px(line_px), ring_px).any() for line_px in self.crack_px)

    def beside(self, line_px: Floats, reach_px: float) -> NDArray[np.bool_]:
        """Return True for points of a line, (n,), within ``reach_px`` of a stroke."""
        if not self:
            return np.zeros(len(line_px), dtype=bool)
        places_px = np.concatenate([_points_px(each) for each in (*self.crack_px, *self.ground_px)])
        return np.asarray(KDTree(places_px).query(line_px)[0]) <= reach_px


NO_STROKES = Strokes()


class _Placed(NamedTuple):
    """A stroke beside the line along the crack. Its arrays have one value for each of its m places, (m,)."""

    kind: Kind
    name: str
    station: Integers
    offset_px: Floats  # To the left of the line
    place_px: Floats
    side: int = 0  # For ground: 0 if it is to the left of the crack, else 1


def by_strokes(
    photo: Photo, stations: Stations, strokes: Strokes, kinds: tuple[EndKind, EndKind]
) -> tuple[Stations, list[str]]:
    """Return the stations with their walls moved near strokes, and warnings.

    Raises InputError for strokes that contradict each other, that leave this crack, or that cross it as ground.
    """
    if not strokes:
        return stations, []
    line_mm, left_mm, right_mm = stations
    mm_per_px, steps_mm = photo.mm_per_px, arc_length(line_mm)[-1] / (len(line_mm) - 1)
    width_px = max(float(np.median(np.linalg.norm(left_mm - right_mm, axis=1))) / mm_per_px, 4.0)
    station_px = float(steps_mm) / mm_per_px
    ray = left_normals(smoothed(line_mm, width_px / station_px))
    walls_px = np.stack([((wall_mm - line_mm) * ray).sum(axis=1) for wall_mm in (left_mm, right_mm)]) / mm_per_px
    walls_px[1] *= -1
    placed, warnings = _placed(photo, line_mm, ray, strokes, width_px)
    if not placed:
        return stations, warnings
    reach = max(REACH * width_px, REACH_PX) / station_px
    placed = [stroke._replace(side=_side(photo, stroke, placed, line_mm, ray, walls_px, reach)) for stroke in placed]
    least_px, most_px = _bounds_px(photo, placed, walls_px)
    shift_px = _shift_px(photo, placed, (least_px, most_px), width_px, station_px)
    placed = [stroke._replace(offset_px=stroke.offset_px - shift_px[stroke.station]) for stroke in placed]
    both_px = np.stack([shift_px, -shift_px])
    walls_px, least_px, most_px = walls_px - both_px, least_px - both_px, np.maximum(most_px - both_px, 0)

    farthest_px = max(float(np.abs(stroke.offset_px).max()) for stroke in placed)
    reach_px = max(farthest_px, float(np.percentile(walls_px, 98))) + GROUND * width_px + GROUND_PX + 2
    patch = patch_around(photo, photo.to_px(line_mm), reach_px)
    shifted_mm = line_mm + (shift_px * mm_per_px)[:, None] * ray
    strip = straighten(photo, patch, shifted_mm, ray, mm_per_px, reach_px * mm_per_px)
    acts = np.stack([_acts(stroke, len(line_mm), reach) for stroke in placed])
    change_px = _followed_px(strip, placed, acts, walls_px, (least_px, most_px), width_px) - walls_px
    same_px = max(SAME_PX, SAME * width_px)
    change_px *= _eased(np.abs(change_px) / same_px - 1)
    change_px = np.clip(walls_px + change_px, np.maximum(least_px, 0), most_px) - walls_px

    share = acts.max(axis=0)
    tips = [tip for kind, tip in zip(kinds, (0, -1), strict=True) if kind == "closed"]
    share[tips] = 0
    left_by, right_by = share * change_px * mm_per_px
    aside_mm = smoothed((left_by - right_by) / 2, CENTRE_SMOOTHING * width_px / station_px, RETURNS)
    moved = (
        line_mm + ((share > 0) * aside_mm)[:, None] * ray,
        left_mm + left_by[:, None] * ray,
        right_mm - right_by[:, None] * ray,
    )
    warnings.append(f"{max(float((share > 0).mean()), 0.01):.0%} of the crack is beside strokes drawn by hand")
    return moved, warnings


def _points_px(line_px: Floats) -> Floats:
    length_px = float(arc_length(line_px)[-1]) if len(line_px) > 1 else 0.0
    return resampled(line_px, max(1.0, length_px / MOST_POINTS)) if length_px > 0 else line_px[:1]


def _placed(
    photo: Photo, line_mm: Floats, ray: Floats, strokes: Strokes, width_px: float
) -> tuple[list[_Placed], list[str]]:
    """Return the strokes beside the line, and warnings about others."""
    tree, along = KDTree(line_mm), np.column_stack([ray[:, 1], -ray[:, 0]])
    most_px = max(MOST_AWAY * width_px, 2 * snap_px(photo))
    width, height = photo.size_px
    placed, warnings = list[_Placed](), list[str]()
    both: tuple[tuple[Kind, tuple[Floats, ...]], ...] = (("crack", strokes.crack_px), ("ground", strokes.ground_px))
    for kind, lines in both:
        for number, line_px in enumerate(lines, start=1):
            name = f"photo.{kind}_strokes_px, stroke {number}"
            if depth_inside(line_px, (-0.5, -0.5, width - 0.5, height - 0.5)).min() < 0:
                raise InputError(f"{photo.file}: {name}, leaves the photo of {width} x {height} px; draw it inside.")
            place_px = _points_px(line_px)
            away_px = photo.to_mm(place_px)
            station = np.asarray(tree.query(away_px)[1])
            away_px = (away_px - line_mm[station]) / photo.mm_per_px
            offset_px = (away_px * ray[station]).sum(axis=1)
            at_end = (station == 0) | (station == len(line_mm) - 1)
            beyond_px = at_end * np.abs((away_px * along[station]).sum(axis=1))
            beside = beyond_px <= max(BEYOND * width_px, BEYOND_PX)
            beside &= np.abs(offset_px) <= most_px
            if kind == "crack" and not beside.all():
                farthest = int(np.argmax(np.where(beside, -1, np.hypot(offset_px, beyond_px))))
                raise InputError(
                    f"{photo.file}: {name}, is not on this crack at {listed(place_px[[farthest]])} px: draw it between "
                    f"the crack's ends, at most {most_px:.0f} px from its line; if the crack takes another way, give "
                    "via_px there."
                )
            if beside.any():
                placed.append(_Placed(kind, name, station[beside], offset_px[beside], place_px[beside]))
            else:
                warnings.append(f"{name}, is not beside this crack and changes nothing")
    return placed, warnings


def _side(
    photo: Photo, ground: _Placed, placed: list[_Placed], line_mm: Floats, ray: Floats, walls_px: Floats, reach: float
) -> int:
    """Return on which side of the crack a ground stroke is: that of no crack stroke, else the brighter one."""
    middle = float(np.median(ground.station))
    cracks = [stroke for stroke in placed if stroke.kind == "crack"]
    near = [stroke.offset_px[np.abs(stroke.station - middle) <= reach + np.ptp(ground.station)] for stroke in cracks]
    if (crack_px := np.concatenate([np.empty(0), *near])).size:
        return int(ground.offset_px.mean() < crack_px.mean())
    left_px, right_px = walls_px[:, ground.station]
    beyond_px = np.stack([left_px - ground.offset_px, right_px + ground.offset_px])
    if (thin := beyond_px.mean(axis=1) < LEAST_BEYOND_PX).any():
        return int(thin[1])
    halves_px = (ground.offset_px + left_px) / 2, (ground.offset_px - right_px) / 2
    at_mm, across = line_mm[ground.station], photo.mm_per_px * ray[ground.station]
    left, right = (
        np.median(sampled(photo.brightness, photo.to_px(at_mm + half_px[:, None] * across))) for half_px in halves_px
    )
    return int(right > left)


def _bounds_px(photo: Photo, placed: list[_Placed], walls_px: Floats) -> tuple[Floats, Floats]:
    """Return the least and the largest distance of both walls from the line, (2, stations), by the strokes."""
    least_px, most_px = np.full(walls_px.shape, -np.inf), np.full(walls_px.shape, np.inf)
    for stroke in placed:
        if stroke.kind == "crack":
            for side, offset_px in enumerate((stroke.offset_px, -stroke.offset_px)):
                np.maximum.at(least_px[side], stroke.station, offset_px + BRUSH_PX)
            continue
        beyond_px = np.stack([stroke.offset_px, -stroke.offset_px]) - walls_px[:, stroke.station]
        if (beyond_px.max(axis=1) > 0).all():
            place_px = stroke.place_px[[int(np.abs(stroke.offset_px).argmin())]]
            raise InputError(
                f"{photo.file}: {stroke.name}, crosses the crack at {listed(place_px)} px: draw it on one side; if the "
                "crack takes another way, give via_px there."
            )
        outward_px = (stroke.offset_px, -stroke.offset_px)[stroke.side]
        np.minimum.at(most_px[stroke.side], stroke.station, outward_px - BRUSH_PX)
    return least_px, most_px


def _shift_px(
    photo: Photo, placed: list[_Placed], bounds_px: tuple[Floats, Floats], width_px: float, station_px: float
) -> Floats:
    """Return how far to the left the line must be moved, (stations,), so that no ground stroke is on it."""
    least_px, most_px = bounds_px
    between_px = most_px.sum(axis=0)
    against = np.flatnonzero((least_px > most_px).any(axis=0) | (between_px <= 0))
    if len(against):
        there = [stroke for stroke in placed if against[0] in stroke.station]
        place_px = there[-1].place_px[there[-1].station == against[0]][:1]
        raise InputError(
            f"{photo.file}: {' and '.join(stroke.name for stroke in there)} contradict each other at "
            f"{listed(place_px)} px: no crack is inside the ground strokes and contains the crack strokes. Remove one."
        )
    margin_px = np.minimum(CLEAR * width_px, between_px / 2)
    low_px, high_px = margin_px - most_px[1], most_px[0] - margin_px
    shift_px = np.clip(np.zeros(len(margin_px)), low_px, high_px)
    return np.clip(smoothed(shift_px, width_px / station_px / 2, 0), low_px, high_px)


def _acts(stroke: _Placed, count: int, reach: float) -> Floats:
    """Return the share, 0 to 1, to which a stroke acts at each station; ``reach`` is in stations."""
    station = np.arange(count)
    beyond = np.maximum(np.maximum(stroke.station.min() - station, station - stroke.station.max()), 0)
    return _eased(2 - beyond / reach)


def _eased(share: Floats) -> Floats:
    """Return 0 below 0, 1 above 1, and a smooth step between."""
    share = np.clip(share, 0, 1)
    return share**2 * (3 - 2 * share)


def _followed_px(
    strip: Strip,
    placed: list[_Placed],
    acts: Floats,
    walls_px: Floats,
    bounds_px: tuple[Floats, Floats],
    width_px: float,
) -> Floats:
    """Return the distance of both walls from the line, (2, stations), by the strokes' levels and within the bounds."""
    light, valid = outward(strip, strip.light), outward(strip, strip.valid)
    over = int(max(3, ALONG * width_px / strip.station_px)) | 1
    even = median_filter(lightness(light), (1, over, 1), mode="nearest")
    away_px = np.arange(light.shape[2]) * strip.sample_px
    # Within the old walls, what is beyond a ground stroke is no crack.
    middle, contrast = _levels(even, valid, strip, placed, acts, np.minimum(walls_px, bounds_px[1]), width_px)
    excess = np.where(valid, np.clip((even - middle[..., None]) / contrast[..., None], -0.5, 0.5), 0)
    least_px, most_px = bounds_px
    excess[away_px <= least_px[..., None]] -= SURELY
    excess[away_px >= most_px[..., None]] += SURELY
    place_px = follow(excess, strip.sample_px, strip.station_px)
    steady = int(max(3, width_px / strip.station_px)) | 1
    none = np.zeros(place_px.shape)
    place_px, _ = refined_to_subpixel(light, valid, place_px, SHARP_PX, strip.sample_px, steady, none, none)
    return np.clip(smoothed(place_px.T, WALL_SMOOTHING_PX / strip.station_px).T, np.maximum(least_px, 0), most_px)


def _levels(
    even: Floats,
    valid: NDArray[np.bool_],
    strip: Strip,
    placed: list[_Placed],
    acts: Floats,
    walls_px: Floats,
    width_px: float,
) -> tuple[Floats, Floats]:
    """Return the lightness midway between crack and ground beside each wall, (2, stations), and their contrast."""
    away_px = np.arange(even.shape[2]) * strip.sample_px
    over_px = away_px - walls_px[..., None]
    inside, outside = over_px < -0.15 * walls_px[..., None] - 0.5, over_px > 2
    outside &= over_px < GROUND * width_px + GROUND_PX
    steady = int(max(3, 2 * width_px / strip.station_px)) | 1
    dark = steadied(np.concatenate(list(np.where(inside & valid, even, np.nan)), axis=1)[None], steady)[0]
    bright = steadied(np.where(outside & valid, even, np.nan), steady)
    bright = np.maximum(bright, dark + 1)
    crack, ground = np.stack([dark, dark]), bright.copy()
    for stroke, act in zip(placed, acts, strict=True):
        column = np.minimum(np.rint(np.abs(stroke.offset_px) / strip.sample_px).astype(int), even.shape[2] - 1)
        own = even[(stroke.offset_px < 0).astype(int), stroke.station, column]
        if stroke.kind == "crack":
            level = float(np.percentile(own, OUTER))
            crack = np.maximum(crack, dark + act * (level - dark))
        else:
            level, side = float(np.percentile(own, 100 - OUTER)), stroke.side
            ground[side] = np.minimum(ground[side], bright[side] + act * (level - bright[side]))
    clear = ground - crack >= np.maximum(LEAST_CONTRAST, LEAST_SHARE * (bright - dark))
    crack, ground = np.where(clear, crack, dark), np.where(clear, ground, bright)
    return (crack + ground) / 2, np.maximum(ground - crack, LEAST_CONTRAST)
