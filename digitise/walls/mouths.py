"""Where side cracks open into a crack: its wall is drawn across, though there is none."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.spatial import KDTree
from skimage.measure import find_contours

from digitise.geometry.polyline import at_arc_length, resampled, smoothed, tangents
from digitise.photo import Photo
from digitise.walls.side_cracks import SideCrack, SideCracks, holding
from digitise.walls.traced import Traced
from sealtwin.records import Floats, arc_length

STARTS = 3.0
"""Half widths from the main crack's wall at which a side crack's own walls are taken up."""
AROUND_MOUTH = 3.0
"""Crack widths around a mouth in which the main crack's walls are looked at."""
ALONG, APPROACH, WIDE = 0.5, 0.3, 1.3
"""Over so many crack widths the main crack's walls come nearer to each other by less than this share of the way, short
of a tip; a side crack's wall, at 25 degrees, by 0.4. Walls farther apart than so many widths are not the main crack's.
"""
ASTRAY = 1.2
"""Crack widths by which a corner may lie off the place so found, where a side crack bends or the main one narrows."""
CLEAR = 0.6
"""Of the sharpest turn: a side crack may bend as much before it as at its corner, which is the last turn of its rim."""
BEYOND, BEYOND_PX = 0.1, 2.0
"""Crack widths, and pixels, beyond a corner, where the main crack's wall is not rounded by blur any more."""
SMOOTHING = 0.5
"""Of the opposite wall, in crack widths: its roughness is its own."""
ROUNDS = 2
"""The wall across a mouth runs straight until the walls around it are known."""
LIP_PX = 2
"""Around a lip, where a pixel may belong to either crack, neither is filled."""
SKIRT_PX = 3
"""Blur darkens the mortar so far around a crack, and brightens the crack around mortar."""


@dataclass(frozen=True)
class PastMouths:
    """The main crack, and what lies beyond its mouths."""

    traced: Traced
    side_rings_px: tuple[tuple[Floats, ...], ...]
    """Of each side crack, its rim and the rims of stones in it; a little into the main crack. None, where it cannot be
    told from the main crack."""


def trace_past_mouths(photo: Photo, sides: SideCracks, trace: Callable[[Photo], Traced]) -> PastMouths:
    """Follow the walls as if mortar filled the side cracks."""
    if not sides.found:
        return PastMouths(trace(photo), ())
    share = np.where(cv2.dilate(sides.crack.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0, sides.levels.share, 1)
    # No wall runs along the edge of the face.
    share[~sides.levels.sample] = np.nan
    lips_px = []
    for side in sides.found:
        for line_px in (side.line_px, side.line_px[::-1])[: 1 + side.comes_back]:
            lips = _lips(sides, share, line_px, side.half_px)
            if lips is not None:
                lips_px.append(lips)
    if not lips_px:
        return PastMouths(trace(photo), ((),) * len(sides.found))
    walls_px: Sequence[Floats] = lips_px
    parted = _parted(sides, walls_px)
    traced = trace(_filled(photo, sides, parted, walls_px))
    for _ in range(ROUNDS - 1):
        walls_px = [_across(photo, sides, traced, lips) for lips in lips_px]
        parted = _parted(sides, walls_px)
        traced = trace(_filled(photo, sides, parted, walls_px))
    return PastMouths(traced, tuple(_rings_px(sides, side, parted) for side in sides.found))


def _lips(sides: SideCracks, share: NDArray[np.floating], line_px: Floats, half_px: float) -> Floats | None:
    """Both places where a side crack's rim has become the main crack's wall, (2, 2); None where that is not clear."""
    width_px, inward_px = sides.width_px, line_px[::-1]
    back = round(min(STARTS * half_px + ALONG * width_px, 0.6 * len(inward_px)))
    start_px = inward_px[-1 - back]
    inward = _unit(inward_px[min(len(inward_px) - back + round(half_px), len(inward_px) - 1)] - start_px)
    reach_px = AROUND_MOUTH * width_px + 2 * STARTS * half_px
    low = np.maximum(np.floor(line_px[0] - reach_px), 0).astype(int)
    high = np.ceil(line_px[0] + reach_px).astype(int) + 1
    window = share[low[1] : high[1], low[0] : high[0]]
    contours = [contour[:, ::-1] + low for contour in find_contours(window, sides.edge_fraction)]
    places = np.concatenate([np.empty((0, 2)), *contours])
    ours = _left_of(sides, places) == _left_of(sides, start_px[None])
    if ours.all() or not ours.any():
        return None
    opposite = KDTree(places[~ours])
    usual_px = float(np.median(opposite.query(places[ours])[0]))
    lips: list[Floats] = []
    for turns in (1, -1):
        beside = start_px + turns * half_px * np.array([-inward[1], inward[0]])
        away = [np.linalg.norm(contour - beside, axis=1) for contour in contours]
        nearest = int(np.argmin([distance.min() for distance in away]))
        rim = _walk(contours[nearest], int(np.argmin(away[nearest])), inward, half_px)
        lip = _lip(rim, np.asarray(opposite.query(rim)[0]), usual_px, turns)
        if lip is None:
            return None
        lips.append(lip)
    return np.stack(lips)


def _left_of(sides: SideCracks, places: Floats) -> NDArray[np.bool_]:
    way_px = smoothed(resampled(sides.way_px, 1.0), sides.width_px / 2)
    nearest = np.asarray(KDTree(way_px).query(places)[1])
    ahead, away = tangents(way_px)[nearest], places - way_px[nearest]
    return ahead[:, 0] * away[:, 1] - ahead[:, 1] * away[:, 0] > 0


def _walk(ring: Floats, at: int, inward: Floats, half_px: float) -> Floats:
    """Along a contour from one of its points, the way that begins inward."""
    if np.array_equal(ring[0], ring[-1]):
        ring = np.roll(ring[:-1], -at, axis=0)
        ways = ring, np.concatenate([ring[:1], ring[:0:-1]])
    else:
        ways = ring[at:], ring[at::-1]
    some = 1 + round(2 * half_px)
    return max(ways, key=lambda points: float((points[min(some, len(points) - 1)] - points[0]) @ inward))


def _lip(rim: Floats, from_opposite: Floats, width_px: float, turns: int) -> Floats | None:
    """Just beyond the corner of a side crack's rim with the main crack's wall, where it turns to that side."""
    if len(rim) < 2:
        return None
    s, window = arc_length(rim), ALONG * width_px
    here = np.flatnonzero(s >= window)
    before = np.interp(s[here] - window, s, from_opposite)
    near = from_opposite < WIDE * width_px
    arrived = here[(before - from_opposite[here] < APPROACH * window) & near[here]]
    arrived_px = float(s[arrived[0]] if len(arrived) else s[-1])
    first, last = max(arrived_px - ASTRAY * width_px, window / 2), min(arrived_px + ASTRAY * width_px, float(s[-1]) - 1)
    at = np.arange(first, max(last, first + 1), 1.0)
    ahead, behind = _heading(rim, at, at + window), _heading(rim, np.maximum(at - window, 0), at)
    turn = turns * ((ahead - behind + np.pi) % (2 * np.pi) - np.pi)
    turn = np.where(np.interp(at, s, near) > 0.5, turn, -np.pi)
    if turn.max() <= 0:
        return None
    peak = (turn >= maximum_filter1d(turn, 2 * round(window) + 1)) & (turn >= CLEAR * turn.max())
    corner_px = at[np.flatnonzero(peak)[-1]]
    return at_arc_length(rim, s, np.array([corner_px + BEYOND * width_px + BEYOND_PX]))[0]


def _heading(line: Floats, first: Floats, last: Floats) -> Floats:
    """Direction, in radians, from one arc length on a line to another."""
    s = arc_length(line)
    step = at_arc_length(line, s, last) - at_arc_length(line, s, first)
    return np.arctan2(step[:, 1], step[:, 0])


def _across(photo: Photo, sides: SideCracks, traced: Traced, lips_px: Floats) -> Floats:
    """The main crack's wall from lip to lip: halfway between a straight one and the opposite one's run.

    A crack of even width wanders with both walls, but its width changes as well: over mouths in drawn cracks either
    guess alone was off by 0.15 to 0.19 mm in the mean, halfway 0.14.
    """
    offset = sides.levels.patch.offset_px
    lips_mm = photo.to_mm(lips_px + offset)
    walls_mm = traced.left_mm, traced.right_mm
    own = int(np.argmin([KDTree(wall).query(lips_mm)[0].sum() for wall in walls_mm]))
    first, last = (int(station) for station in np.asarray(KDTree(walls_mm[own]).query(lips_mm)[1]))
    if first > last:
        first, last, lips_mm = last, first, lips_mm[::-1]
    station_mm = float(np.median(np.diff(arc_length(traced.line_mm))))
    sigma = SMOOTHING * traced.width_px * photo.mm_per_px / station_mm
    opposite_mm = smoothed(walls_mm[1 - own], sigma)[first : last + 1]
    along = np.linspace(0, 1, len(opposite_mm))[:, None]
    straight_mm = (1 - along) * lips_mm[0] + along * lips_mm[1]
    wander_mm = opposite_mm - ((1 - along) * opposite_mm[0] + along * opposite_mm[-1])
    return photo.to_px(straight_mm + wander_mm / 2) - offset


def _parted(sides: SideCracks, walls_px: Sequence[Floats]) -> NDArray[np.bool_]:
    """What of the crack lies beyond the walls across its mouths."""
    open_to = (sides.crack & ~_drawn(sides, walls_px)).astype(np.uint8)
    for x, y in np.concatenate([wall_px[[0, -1]] for wall_px in walls_px]):
        cv2.circle(open_to, (round(x), round(y)), LIP_PX, 0, -1)
    return (open_to > 0) & ~holding(open_to > 0, np.rint(sides.way_px[:, ::-1]).astype(np.int64))


def _drawn(sides: SideCracks, walls_px: Sequence[Floats]) -> NDArray[np.bool_]:
    """The pixels of some walls."""
    picture = np.zeros(sides.crack.shape, dtype=np.uint8)
    for wall_px in walls_px:
        cv2.polylines(picture, [np.rint(wall_px * 16).astype(np.int32)], False, 1, 1, cv2.LINE_8, 4)
    return picture > 0


def _filled(photo: Photo, sides: SideCracks, parted: NDArray[np.bool_], walls_px: Sequence[Floats]) -> Photo:
    """The photo with mortar in place of its side cracks."""
    dark, bright, (left, top) = sides.levels.dark, sides.levels.bright, sides.levels.patch.offset_px
    light = photo.brightness.copy()
    window = light[top : top + dark.shape[0], left : left + dark.shape[1]]
    mortar = _with_skirt(parted) & (parted | ~sides.crack)
    window[mortar] = np.maximum(window, bright)[mortar]
    # A pixel on the wall itself is half of either.
    wall = _drawn(sides, walls_px) & sides.crack
    window[wall] = ((dark + bright) / 2)[wall]
    return replace(photo, brightness=light)


def _with_skirt(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * SKIRT_PX + 1,) * 2, np.uint8)) > 0


def _rings_px(sides: SideCracks, side: SideCrack, parted: NDArray[np.bool_]) -> tuple[Floats, ...]:
    """In the photo, counter-clockwise in mm; stones in it clockwise."""
    own = holding(parted, np.rint(side.line_px[:, ::-1]).astype(np.int64))
    if not own.any():
        return ()
    share = np.where(_with_skirt(own), sides.levels.share, 1)
    left, top, width, height = cv2.boundingRect(own.astype(np.uint8))
    left, top = max(0, left - 2 * SKIRT_PX), max(0, top - 2 * SKIRT_PX)
    window = share[top : top + height + 4 * SKIRT_PX, left : left + width + 4 * SKIRT_PX]
    closed = np.pad(window, 1, constant_values=1)
    offset = np.add(sides.levels.patch.offset_px, (left - 1, top - 1))
    return tuple(ring[:-1, ::-1] + offset for ring in find_contours(closed, sides.edge_fraction))


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)
