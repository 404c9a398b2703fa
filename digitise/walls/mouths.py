"""Draw the main crack's wall across the mouths of its side cracks."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.spatial import KDTree
from skimage.measure import find_contours

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.medial_axis import distance_outside, holding
from digitise.geometry.polyline import at_arc_length, resampled, smoothed, tangents, unit
from digitise.image.raster import widened
from digitise.photo import Photo
from digitise.walls.centreline_and_walls import Traced, WallsMissingError, trace
from digitise.walls.dark_region import trace_dark_region
from digitise.walls.islands import SKIRT_PX, RetouchedPhoto
from digitise.walls.side_cracks import FoundSideCrack, SideCracks
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

SideRings = tuple[tuple[Floats, ...], ...]  # Rims of each side crack and its stones; empty without a clear mouth
STARTS = 3.0  # Half widths from the main crack's wall at which a side crack's own walls begin to be followed
AROUND_MOUTH = 3.0  # Crack widths around a mouth in which the main crack's walls are examined
ALONG, APPROACH = 0.5, 0.3  # Crack widths, and the share of them by which the main walls approach each other at most
WIDE = 1.3  # Most crack widths between the main crack's walls
ASTRAY = 1.2  # Most crack widths from the end of that approach to the corner: side cracks bend, main ones narrow
CLEAR = 0.6  # Least turn of a corner over the sharpest turn of the side crack's rim; the corner is the last
BEYOND, BEYOND_PX = 0.1, 2.0  # Crack widths, plus px, beyond a corner at which blur no longer rounds the main wall
SMOOTHING = 0.5  # Gaussian sigma in crack widths of the opposite wall, so that its roughness is not copied
SWELLING = 2.0  # Largest reach of a side crack sideways in its half widths; beyond is a pore or a stain
LIP_PX = 2  # Radius around a lip in which a pixel may belong to either crack, so that neither is filled


def trace_past_mouths(photo: RetouchedPhoto, path: CrackPath, sides: SideCracks) -> tuple[Traced, SideRings]:
    """Follow the main crack's walls as if mortar filled its side cracks; also return the rims of the side cracks."""
    if not sides.lines:
        return _trace_either_way(photo, path, sides.wall_share), ()
    share = np.where(widened(sides.crack, 1), sides.levels.share, 1)
    # The edge of the face is not a wall.
    share[~sides.levels.sample] = np.nan
    ways = [(line_px, it) for it in sides.lines for line_px in (it.line_px, it.line_px[::-1])[: 1 + it.comes_back]]
    pairs = (_lips(sides, share, line_px, side.half_px) for line_px, side in ways)
    lips_px = [lips for lips in pairs if lips is not None]
    if not lips_px:
        return _trace_either_way(photo, path, sides.wall_share), ((),) * len(sides.lines)
    traced, parted = _with_walls_across(photo, path, sides, lips_px)
    walls_px = [_across(photo, sides, traced, lips) for lips in lips_px]
    traced, parted = _with_walls_across(photo, path, sides, walls_px)
    return traced, tuple(_rings_px(sides, side, parted) for side in sides.lines)


def _trace_either_way(photo: Photo, path: CrackPath, wall_share: float) -> Traced:
    """Return the walls along ``path``, or on ground too coarse to follow them, the rims of the dark region.

    Raises InputError if neither way finds them, and TooThinError if blur would decide the crack's width.
    """
    try:
        return trace(photo, path, wall_share)
    except WallsMissingError as unclear:
        try:
            return trace_dark_region(photo, path, wall_share)
        except InputError as neither:
            why = str(neither).removeprefix(f"{photo.file}: ")
            raise WallsMissingError(f"{unclear} A second way was tried: {why}") from None


def _with_walls_across(
    photo: RetouchedPhoto, path: CrackPath, sides: SideCracks, walls_px: Sequence[Floats]
) -> tuple[Traced, NDArray[np.bool_]]:
    """Return the main crack with given walls across its mouths, and the pixels of side cracks beyond them."""
    open_to = (sides.crack & ~_drawn(sides.crack.shape, walls_px)).astype(np.uint8)
    for x, y in np.concatenate([wall_px[[0, -1]] for wall_px in walls_px]):
        cv2.circle(open_to, (round(x), round(y)), LIP_PX, 0, -1)
    parted = (open_to > 0) & ~holding(open_to > 0, sides.way_px)
    return _trace_either_way(_without_side_cracks(photo, sides, parted, walls_px), path, sides.wall_share), parted


def _lips(sides: SideCracks, share: NDArray[np.floating], line_px: Floats, half_px: float) -> Floats | None:
    """Return both places at which a side crack's rim becomes the main crack's wall, (2, 2); None if unclear."""
    width_px, inward_px = sides.width_px, line_px[::-1]
    back = round(min(STARTS * half_px + ALONG * width_px, 0.6 * len(inward_px)))
    start_px = inward_px[-1 - back]
    inward = unit(inward_px[min(len(inward_px) - back + round(half_px), len(inward_px) - 1)] - start_px)
    reach_px = AROUND_MOUTH * width_px + 2 * STARTS * half_px
    low = np.maximum(np.floor(line_px[0] - reach_px), 0).astype(int)
    high = np.ceil(line_px[0] + reach_px).astype(int) + 1
    window = share[low[1] : high[1], low[0] : high[0]]
    contours = [contour[:, ::-1] + low for contour in find_contours(window, sides.wall_share)]
    places = np.concatenate([np.empty((0, 2)), *contours])
    same_side = _left_of(sides, places) == _left_of(sides, start_px[None])
    if same_side.all() or not same_side.any():
        return None
    opposite = KDTree(places[~same_side])
    usual_px = float(np.median(opposite.query(places[same_side])[0]))
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
    """Return the contour from its point number ``at``, in the direction that begins inward."""
    if np.array_equal(ring[0], ring[-1]):
        ring = np.roll(ring[:-1], -at, axis=0)
        ways = ring, np.concatenate([ring[:1], ring[:0:-1]])
    else:
        ways = ring[at:], ring[at::-1]
    some = 1 + round(2 * half_px)
    return max(ways, key=lambda points: float((points[min(some, len(points) - 1)] - points[0]) @ inward))


def _lip(rim: Floats, from_opposite: Floats, width_px: float, turns: int) -> Floats | None:
    """Return the place just beyond the corner between a side crack's rim and the main wall; None without one."""
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
    """Return the direction in radians from one arc length on a line to another."""
    s = arc_length(line)
    step = at_arc_length(line, s, last) - at_arc_length(line, s, first)
    return np.arctan2(step[:, 1], step[:, 0])


def _across(photo: Photo, sides: SideCracks, traced: Traced, lips_px: Floats) -> Floats:
    """Return the main crack's wall from lip to lip: midway between a straight line and the course of the other wall."""
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


def _drawn(shape: tuple[int, ...], walls_px: Sequence[Floats]) -> NDArray[np.bool_]:
    """Return a mask of some lines."""
    picture = np.zeros(shape, dtype=np.uint8)
    for wall_px in walls_px:
        cv2.polylines(picture, [np.rint(wall_px * 16).astype(np.int32)], False, 1, 1, cv2.LINE_8, 4)
    return picture > 0


def _without_side_cracks(
    photo: Photo, sides: SideCracks, parted: NDArray[np.bool_], walls_px: Sequence[Floats]
) -> RetouchedPhoto:
    """Return the photo with mortar in place of its side cracks."""
    dark, bright, (left, top) = sides.levels.dark, sides.levels.bright, sides.levels.patch.offset_px
    light = photo.brightness.copy()
    window = light[top : top + dark.shape[0], left : left + dark.shape[1]]
    mortar = widened(parted, SKIRT_PX) & (parted | ~sides.crack)
    window[mortar] = np.maximum(window, bright)[mortar]
    # A pixel on the wall itself is half crack, half mortar.
    wall = _drawn(sides.crack.shape, walls_px) & sides.crack
    window[wall] = ((dark + bright) / 2)[wall]
    return RetouchedPhoto(replace(photo, brightness=light))


def _rings_px(sides: SideCracks, side: FoundSideCrack, parted: NDArray[np.bool_]) -> tuple[Floats, ...]:
    """Return the outline of a side crack and of the stones in it, in px.

    In mm (y up), the crack's ring runs counter-clockwise and those of stones run clockwise.
    """
    own = holding(
        parted & (distance_outside(_drawn(parted.shape, [side.line_px])) < SWELLING * side.half_px), side.line_px
    )
    if not own.any():
        return ()
    share = np.where(widened(own, SKIRT_PX) & (own | ~parted), sides.levels.share, 1)
    left, top, width, height = cv2.boundingRect(own.astype(np.uint8))
    left, top = max(0, left - 2 * SKIRT_PX), max(0, top - 2 * SKIRT_PX)
    window = share[top : top + height + 4 * SKIRT_PX, left : left + width + 4 * SKIRT_PX]
    closed = np.pad(window, 1, constant_values=1)
    offset = np.add(sides.levels.patch.offset_px, (left - 1, top - 1))
    return tuple(ring[:-1, ::-1] + offset for ring in find_contours(closed, sides.wall_share))
