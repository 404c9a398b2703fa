"""Measure both walls of a crack in a straightened photo: follow them to a sample, then refine to sub-pixels."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import ndtr, ndtri

from digitise.walls.straightened import BLUR_PX, Strip
from sealtwin.core.records import Floats, Integers

# Constants of following and refining walls. "share" is the share of the contrast from crack to mortar.
#
# Chosen on drawn photos. On 200 wide cracks drawn afterwards the mean width is off by 2.5 % at most. A higher
# ``STAINED`` or ``STONE`` leaves out less of a stain; a lower one cuts off more of a lit inside.
HALF = 0.5  # Share at the middle of a blurred edge
STAINED = 0.35  # Share that leaves out a stain
ASIDE_PX = 4.0  # Least distance between the walls at both shares for a stain; blur makes 1.4 px
STONE = 0.2  # Share that leaves out stones in a stain
STONE_ASIDE = 0.2  # Least distance for stones, in crack widths
SELDOM = 0.33  # Largest part of a wall with stones; more of it is a lit inside, which is crack
RIM = 0.2  # Least widening of an edge by a lit rim, in sigmas of the blur; noise widens it by less
STEEPEST_WALL = 3.2  # Steepest slope of a wall to its line: 73 degrees
STIFFNESS = 0.5  # Cost, in px of misplaced mortar, of a step as far aside as along; a pore must cost more
RECENT = 0.25  # Crack widths before a wall's last step; their mean width continues the wall
USUAL = 8.0  # Crack widths before it; the median width there is averaged with that mean
TREND = 4  # Stations before it that give the wall's slope; fewer follow grain
STEEPEST_BRIDGE = 0.5  # Steepest slope of a continued wall; steeper ones are those of a pore or a grain
TURNING = 0.5  # Crack widths over which that slope dies out
CRACK = 0.25  # Crack widths from the line within which the crack's level is read
MORTAR = (0.8, 1.5)  # Crack widths from the line between which the mortar's level is read
REFINEMENTS = 2  # Rounds of refinement, the first from a sample near the wall, the second from the wall
CLEAR = 1.5  # Sigmas from the step beyond which levels are read: an edge is within a fifteenth of them
INSIDE = 0.8  # Further sigmas over which the crack's level is read; more would cross a lit rim
OUTSIDE = 3.0  # Further sigmas over which the mortar's level is read; more would reach a stain
SNAP_PX = 2.0  # Largest distance from a followed wall to its step
SHARPEST_PX = 0.8  # Least sigma: no edge is sharper than the softening
SOFTEST_PX = 3.5  # Largest sigma; a softer edge does not show its blur
OUTER = 0.84  # Share at which softness is measured: one sigma out from the middle of the edge
LEAST_STEP = 0.25  # Least height of a wall's step, as a share


Side = tuple[Floats, NDArray[np.bool_]]  # A wall's distance from the line, and the stations with a step, (stations,)


@dataclass(frozen=True)
class Walls:
    """Distance of each wall from the line at each station, positive outward."""

    left_mm: Floats
    right_mm: Floats
    left_found: NDArray[np.bool_]  # Stations at which the wall is in the photo, with a clear step from dark to bright
    right_found: NDArray[np.bool_]
    open_line: NDArray[np.bool_]  # Stations at which the line itself is dark
    dark: Floats  # Brightness of the crack, and of the mortar next to it
    bright: Floats
    blur_px: float  # Sigma of the photo's own blur, by the sharper wall

    @property
    def both_found(self) -> NDArray[np.bool_]:
        return self.left_found & self.right_found

    @property
    def width_mm(self) -> Floats:
        return self.left_mm + self.right_mm


def find_walls(strip: Strip, width_mm: float, wall_share: float = 0.5, both_reach_edge: bool = False) -> Walls:
    """Return both walls, each in the middle of its step from dark to bright. Stations without a step are filled in.

    The crack is about ``width_mm`` wide and extends to ``wall_share`` of the contrast to mortar. If that is over a
    half, a wall with a lit rim is midway from the rim's brightness to the mortar's.
    """
    across = width_mm / strip.mm_per_px / strip.station_px
    over = 2 * int(np.ceil(across)) + 1
    distance = np.abs(strip.offset_mm)
    dark = _level(strip, strip.valid & (distance < CRACK * width_mm), over)
    # A tip is narrower than the band, which would count mortar as its darkness.
    dark = np.minimum(dark, np.median(dark))
    beside = strip.valid & (distance > MORTAR[0] * width_mm) & (distance < MORTAR[1] * width_mm)
    usual = float(np.median(strip.light[beside])) if beside.any() else 0.0
    # In wide parts of the crack the band next to it includes crack.
    mortar = beside & (strip.light > (2 * dark[:, None] + usual) / 3)
    bright = np.stack([_level(strip, mortar & (sign * strip.offset_mm > 0), over) for sign in (1, -1)])
    light, valid = outward(strip, strip.light), outward(strip, strip.valid)
    contrast = np.maximum(bright - dark, 1e-6)
    share = np.clip((light - dark[:, None]) / contrast[..., None], 0, 1)

    def excess(fraction: float) -> Floats:
        # Samples of unknown brightness must not attract a wall.
        return np.where(valid, share - fraction, 0)

    fraction, lit = min(wall_share, HALF), np.zeros(2)
    levels = (HALF, STAINED, STONE) if wall_share == HALF else (fraction,)
    # Three walls followed together take as long as one and a half.
    followed_px = follow(np.concatenate([excess(level) for level in levels]), strip.sample_px, strip.station_px)
    place_px, *inside_px = np.split(followed_px, len(levels))
    if inside_px:
        inner_px, innermost_px = inside_px
        place_px = np.where(place_px - inner_px > ASIDE_PX, inner_px, place_px)
        # In a soft photo, as an enlarged one, blur alone moves the lower level in by the same distance all along.
        in_px = place_px - innermost_px
        farther_in_px = in_px - np.median(in_px, axis=1, keepdims=True)
        beside_stone = farther_in_px > max(ASIDE_PX, STONE_ASIDE * width_mm / strip.mm_per_px)
        beside_stone &= beside_stone.mean(axis=1, keepdims=True) < SELDOM
        place_px = np.where(beside_stone, innermost_px, place_px)
    edge_px = softness_px(share, place_px, strip.sample_px, fraction)
    sigma_px = float(np.clip(edge_px, SHARPEST_PX, SOFTEST_PX))
    if wall_share > HALF:
        lit = lit_share(share, place_px, sigma_px, strip.sample_px, wall_share)
        for side in np.flatnonzero(lit):
            midway = max(wall_share, (1 + lit[side]) / 2)
            place_px[side] = follow(excess(midway)[side : side + 1], strip.sample_px, strip.station_px)[0]
    rim = np.where(lit[:, None] > 0, dark + lit[:, None] * contrast, 0)
    has_step = np.zeros(place_px.shape, dtype=bool)
    for _ in range(REFINEMENTS):
        place_px, has_step = refined_to_subpixel(light, valid, place_px, sigma_px, strip.sample_px, over, contrast, rim)
    left, right = zip(place_px * strip.mm_per_px, has_step, strict=True)
    left_mm, right_mm = completed(left, right, across, strip.station_px * strip.mm_per_px, both_reach_edge)
    bright = bright.mean(axis=0)
    open_line = strip.light[:, strip.middle] < (dark + bright) / 2
    blur_px = max(edge_px**2 - BLUR_PX**2, 0.0) ** 0.5
    return Walls(left_mm, right_mm, has_step[0], has_step[1], open_line, dark, bright, blur_px)


def follow(excess: Floats, sample_px: float, station_px: float) -> Floats:
    """Return the distance of each side's wall from the line in px, (sides, stations), to the nearest sample.

    ``excess``, (sides, stations, samples), is negative in the crack. The wall is the line of least cost. Its cost is
    the sum of the excess inside it and of its steps sideways.
    """
    most = max(1, round(STEEPEST_WALL * station_px / sample_px))
    price = STIFFNESS / station_px * (np.arange(-most, most + 1) * sample_px) ** 2
    place = cheapest_way(np.cumsum(excess, axis=2) * sample_px, np.asarray(price, dtype=float))
    return np.asarray((place + 0.5) * sample_px, dtype=float)


def cheapest_way(cost: Floats, price: Floats) -> Integers:
    """Return the sample at each station of the cheapest way from the first station to the last.

    ``cost`` is (ways, stations, samples), the result (ways, stations). ``price``, (2k + 1,), is the cost of a step
    sideways by -k to k samples. The method is dynamic programming.
    """
    ways, stations, samples = cost.shape
    most = len(price) // 2
    reached = np.full((ways, samples + 2 * most), np.inf)
    best = cost[:, 0]
    came_by = np.zeros((stations, ways, samples), dtype=np.intp)
    for station in range(1, stations):
        reached[:, most:-most] = best
        options = np.lib.stride_tricks.sliding_window_view(reached, len(price), axis=1) + price
        came_by[station] = options.argmin(axis=2)
        best = np.take_along_axis(options, came_by[station][..., None], axis=2)[..., 0] + cost[:, station]
    place = np.empty((ways, stations), dtype=np.int64)
    place[:, -1] = best.argmin(axis=1)
    way = np.arange(ways)
    for station in range(stations - 1, 0, -1):
        place[:, station - 1] = place[:, station] + came_by[station, way, place[:, station]] - most
    return place


def lit_share(share: Floats, half_px: Floats, sigma_px: float, sample_px: float, wall_share: float) -> Floats:
    """Return the brightness of each wall's lit rim as a share of the contrast, (2,); 0 if there is no rim.

    A rim is between half of the contrast, which is at ``half_px``, (2, stations), and ``wall_share``. ``share`` of the
    contrast is (2, stations, samples), from the line outward.
    """
    lit = np.zeros(2)
    for number, (side, places_px) in enumerate(zip(share, half_px, strict=True)):
        rel_px = np.arange(0, max(float(np.median(places_px)), 3 * SOFTEST_PX), 0.5 * sample_px)
        profile = usual_profile(side, places_px, rel_px, sample_px)
        inner_px, outer_px = (reached(profile, rel_px, level) for level in (HALF, wall_share))
        if inner_px is None or outer_px is None:
            continue
        if outer_px - inner_px > sigma_px * (ndtri(wall_share) + RIM):
            lit[number] = np.interp(np.linspace(inner_px, outer_px), rel_px, profile).mean()
    return lit


def completed(left: Side, right: Side, across: float, station: float, both_reach_edge: bool) -> tuple[Floats, Floats]:
    """Return both walls at every station. ``across`` is the stations in one crack width, ``station`` their distance.

    If the edge of the face hides one wall before the other, it follows the other at the crack's width. With
    ``both_reach_edge``, for rays along that edge, it keeps its own slope instead.
    """
    number = np.arange(len(left[0]))
    walls = [
        np.interp(number, number[steps], wall[steps]) if steps.any() else wall.copy() for wall, steps in (left, right)
    ]
    if not (left[1].any() and right[1].any()):
        return walls[0], walls[1]
    for onward in (slice(None), slice(None, None, -1)):
        lasts = [int(np.flatnonzero(steps[onward])[-1]) for _, steps in (left, right)]
        near, far = (walls[side][onward] for side in np.argsort(lasts, kind="stable"))
        last, last_far = sorted(lasts)
        if both_reach_edge:
            _keep_turning(near, last, across, STEEPEST_BRIDGE * station)
            _keep_turning(far, last_far, across, STEEPEST_BRIDGE * station)
        else:
            far[last_far:] = far[last_far]
            near[last + 1 :] = np.maximum(_expected_width(near + far, last, across) - far[last + 1 :], 0)
    return walls[0], walls[1]


def _expected_width(width: Floats, last: int, across: float) -> float:
    reaches = (max(1, round(widths * across)) for widths in (RECENT, USUAL))
    recent, usual = (width[max(0, last + 1 - reach) : last + 1] for reach in reaches)
    return float(np.mean(recent) + np.median(usual)) / 2


def _keep_turning(wall: Floats, last: int, across: float, steepest: float) -> None:
    """Overwrite the wall past ``last`` by a continuation with a slope that dies out."""
    recent = np.arange(max(0, last + 1 - TREND), last + 1)
    past = np.arange(last + 1, len(wall))
    slope = float(np.polyfit(recent, wall[recent], 1)[0]) if len(recent) > 1 else 0.0
    slope, reach = np.clip(slope, -steepest, steepest), TURNING * across
    wall[past] = np.mean(wall[recent]) + slope * (last - np.mean(recent) + reach * (1 - np.exp(-(past - last) / reach)))


def softness_px(share: Floats, place_px: Floats, sample_px: float, wall_share: float) -> float:
    """Return the blur (sigma) of the sharper wall, from its outer half; light can spoil the inner half."""
    rel_px = np.arange(0, 3 * SOFTEST_PX, 0.5 * sample_px)
    sigmas_px = list[float]()
    for side, places_px in zip(share, place_px, strict=True):
        profile = usual_profile(side, places_px, rel_px, sample_px)
        inner, outer = (reached(profile, rel_px, level) for level in (wall_share, OUTER))
        if outer is not None:
            sigmas_px.append((outer - (inner or 0.0)) / (ndtri(OUTER) - ndtri(wall_share)))
    return min(sigmas_px, default=SOFTEST_PX)


def refined_to_subpixel(
    light: Floats,
    valid: NDArray[np.bool_],
    place_px: Floats,
    sigma_px: float,
    sample_px: float,
    over: int,
    contrast: Floats,
    rim: Floats,
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return each wall's sub-pixel distance from the line in px, (2, stations), and the stations with a clear step.

    A wall is where the light, linear between samples, crosses the level that the edge of a blurred slot has between the
    medians just inside and just outside. The search begins at ``place_px``. ``light`` and ``valid`` run from the line
    outward, (2, stations, samples); levels are medians over ``over`` stations. ``rim``, (2, stations), is the least
    level inside a lit rim, else 0.
    """
    width_px = np.maximum(median_filter(place_px.sum(axis=0), over, mode="nearest"), 1.0)[:, None]
    outer_px = np.arange(CLEAR * sigma_px, (CLEAR + OUTSIDE) * sigma_px, sample_px)
    inner_px = -np.arange(CLEAR * sigma_px, (CLEAR + INSIDE) * sigma_px, sample_px)
    # Past the middle of the crack the light of the other wall begins.
    inner_px = np.maximum(inner_px, -width_px / 2)
    shown = np.where(valid, light, np.nan)
    outer, inner = (
        steadied(_between(shown, (place_px[..., None] + rel_px) / sample_px), over) for rel_px in (outer_px, inner_px)
    )
    inner = np.maximum(inner, rim)

    def brightened(rel_px: Floats) -> Floats:
        """Return the share of mortar at a distance from one wall in the blurred picture of a slot."""
        return np.median(ndtr(rel_px / sigma_px) + ndtr(-(rel_px + width_px) / sigma_px), axis=1)

    low, middle, high = (brightened(rel_px) for rel_px in (inner_px, np.zeros(1), outer_px))
    threshold = inner + (outer - inner) * (middle - low) / (high - low)
    excess = light - threshold[..., None]
    rising = (excess[..., :-1] < 0) & (excess[..., 1:] >= 0) & valid[..., :-1] & valid[..., 1:]
    here, there = excess[..., :-1], excess[..., 1:]
    crossing_px = (np.arange(rising.shape[-1]) - here / np.where(rising, there - here, 1)) * sample_px
    away_px = np.where(rising, np.abs(crossing_px - place_px[..., None]), np.inf)
    nearest = away_px.argmin(axis=-1)[..., None]
    stepped = np.take_along_axis(away_px, nearest, -1)[..., 0] <= SNAP_PX
    step_px = np.take_along_axis(crossing_px, nearest, -1)[..., 0]
    return np.where(stepped, step_px, place_px), stepped & (outer - inner >= LEAST_STEP * contrast)


def usual_profile(side: Floats, places_px: Floats, rel_px: Floats, sample_px: float) -> Floats:
    """Return the median over a wall's stations of the share of contrast, at ``rel_px`` from ``places_px`` outward."""
    sample = np.minimum((places_px[:, None] + rel_px) / sample_px, side.shape[1] - 1)
    return np.median(_between(side, sample), axis=0)


def reached(profile: Floats, at: Floats, level: float) -> float | None:
    """Return the place at which a profile first reaches a level; None if it does not."""
    first = int(np.argmax(profile >= level))
    if profile[first] < level:
        return None
    if first == 0:
        return float(at[0])
    return float(np.interp(level, profile[first - 1 : first + 1], at[first - 1 : first + 1]))


def outward(strip: Strip, values: NDArray) -> NDArray:
    """Return the left and right half of a strip, both from the line outward, (2, stations, samples)."""
    return np.stack([values[:, strip.middle :], values[:, strip.middle :: -1]])


def _level(strip: Strip, where: NDArray[np.bool_], over: int) -> Floats:
    """Return the median brightness of the samples ``where`` at each station, median-filtered along the line.

    Stations with under three such samples are interpolated from their neighbours.
    """
    enough = where & (where.sum(axis=1, keepdims=True) >= 3)
    return steadied(np.where(enough, strip.light, np.nan)[None], over)[0]


def steadied(values: Floats, over: int, middle: Callable[..., Floats] = np.nanmedian) -> Floats:
    """Return the middle values across the line, (sides, stations), median-filtered along it.

    Stations without values are interpolated.
    """
    station = np.arange(values.shape[1])
    levels = np.zeros(values.shape[:2])
    for side, level in zip(values, levels, strict=True):
        finite = np.isfinite(side).any(axis=1)
        if finite.any():
            level[:] = np.interp(station, station[finite], middle(side[finite], axis=1))
    return median_filter(levels, (1, over), mode="nearest")


def _between(values: Floats, column: Floats) -> Floats:
    """Interpolate each row of values at fractional columns, (..., n); NaN outside the row."""
    last = values.shape[-1] - 1
    left = np.clip(column.astype(int), 0, last - 1)
    here, there = (np.take_along_axis(values, left + step, axis=-1) for step in (0, 1))
    return np.where((column >= 0) & (column <= last), here + (column - left) * (there - here), np.nan)
