"""Straighten the photo along a line, and measure both walls of a crack in the strip, to a fraction of a pixel."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import ndtri

from digitise.geometry.polyline import Box, depth_inside, left_normals, nearest_side, places_beside, tangents
from digitise.image.raster import Map, Mask, blurred, median_of, sampled, window_around
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Booleans, Floats, Integers

SPREAD = 0.6  # Rays do not meet within this many crack widths to each side of the line
MAX_OBLIQUE = 8.0  # Largest cotangent of the angle (7 degrees) between line and edge at which rays follow the edge
BLUR_PX = 0.8  # Sigma of a Gaussian blur before sampling, which reduces grain and does not move a straight edge
RIM_PX = 8  # Margin of a patch. The blur extends over four sigmas
EDGE_PX = 1.5  # Distance from the edge of the face within which the brightness includes the surroundings
# Limits of the spacing of samples across a crack, in px of the photo. A blurred edge is 3 px wide
FINEST_PX, COARSEST_PX = 0.5, 1.5
MIN_SEARCH_WIDTH_PX = 6.0  # Minimum width of a crack at the beginning of the search
SAMPLES = 48  # Number of samples across a crack width. More cost time and do not improve the result


@dataclass(frozen=True)
class Crossing:
    """Point where a line meets the edge of the face."""

    s_mm: float
    inward: Floats  # Unit normal of that edge, pointing onto the face


# Crossings at the first and the last end. None if an end is not open
Crossings = tuple[Crossing | None, Crossing | None]


def edge_crossings(line_mm: Floats, face_mm: Box) -> Crossings:
    """Return the crossings of a line with the face's edge before and after the line's middle, the nearest on each side.

    A crossing is None if there is none on that side.
    """
    s_mm, depth_mm, crossings = arc_length(line_mm), depth_inside(line_mm, face_mm), list[Crossing | None]()
    outside, middle = np.flatnonzero(depth_mm < 0), len(line_mm) // 2
    for beyond, step in ((outside[outside < middle][::-1], 1), (outside[outside > middle], -1)):
        if len(beyond) == 0 or depth_mm[middle] < 0:
            crossings.append(None)
            continue
        inner, out = beyond[0] + step, beyond[0]
        fraction = depth_mm[inner] / (depth_mm[inner] - depth_mm[out])
        place_mm = line_mm[inner] + fraction * (line_mm[out] - line_mm[inner])
        inward = np.array([[1, 0], [0, 1], [-1, 0], [0, -1.0]])[nearest_side(place_mm, face_mm)]
        crossings.append(Crossing(float(s_mm[inner] + fraction * (s_mm[out] - s_mm[inner])), inward))
    return crossings[0], crossings[1]


def rays_across(line_mm: Floats, width_mm: float, crossings: Crossings) -> Floats:
    """Return vectors, (n, 2), that point to the left of a line. Their component perpendicular to the line is 1 mm.

    Near open ends they are parallel to the edge of the face.
    """
    s_mm, along, normal = arc_length(line_mm), tangents(line_mm), left_normals(line_mm)
    shear, turned = np.zeros((2, len(line_mm)))
    for crossing in crossings:
        if crossing is None:
            continue
        sine = along @ crossing.inward
        sine = np.copysign(np.maximum(np.abs(sine), 1e-6), sine)
        to_edge = np.clip(-(normal @ crossing.inward) / sine, -MAX_OBLIQUE, MAX_OBLIQUE)
        oblique = abs(np.interp(crossing.s_mm, s_mm, to_edge))
        # Within half a width times the cotangent, the edge cuts off a wall on the normals. Beyond, the rays turn back
        # to the normals over a longer distance, so that they do not meet within the crack.
        reaches = np.abs(s_mm - crossing.s_mm) / max(SPREAD * width_mm * oblique, 1e-9)
        share = np.clip(2 - reaches, 0, 1)
        shear, turned = shear + share * to_edge, turned + share
    return normal + (shear / np.maximum(turned, 1))[:, None] * along


@dataclass(frozen=True)
class Patch:
    """A window of the photo, with the brightness in it. Arrays of positions are (..., 2)."""

    offset_px: tuple[int, int]  # x and y of the window's first pixel in the photo
    soft: Map  # Brightness, blurred by ``BLUR_PX``
    clear: Mask  # 255 on pixels of the sample, 0 on markers and hidden pixels
    face_mm: Box | None
    mm_per_px: float

    def light(self, places_px: Floats) -> Floats:
        """Return the brightness at each position. Beyond the patch, the brightness of its border is used."""
        return sampled(self.soft, places_px - self.offset_px, cv2.INTER_CUBIC).astype(float)

    def on_sample(self, places_px: Floats, places_mm: Floats) -> Booleans:
        """Return True for positions that show only the sample. Positions are given in px and in mm, (..., 2) each."""
        shown = sampled(self.clear, places_px - self.offset_px, beyond=cv2.BORDER_CONSTANT) >= 254
        if self.face_mm is None:
            return shown
        return shown & (depth_inside(places_mm, self.face_mm) >= EDGE_PX * self.mm_per_px)


def patch_around(photo: Photo, points_px: Floats, reach_px: float, hidden: Mask | None = None) -> Patch:
    """Return the part of the photo around some points. It extends ``reach_px`` beyond them on every side.

    Markers and ``hidden`` pixels do not count as sample.
    """
    low, window = window_around(points_px, reach_px + RIM_PX, photo.size_px)
    soft, offset_px = blurred(photo.brightness[window], BLUR_PX), (int(low[0]), int(low[1]))
    clear = np.full(soft.shape, 255, np.uint8) if hidden is None else 255 - hidden[window]
    photo.blank_markers(clear, offset_px)
    return Patch(offset_px, soft, clear, photo.face_mm, photo.mm_per_px)


@dataclass(frozen=True)
class Strip:
    """Brightness on both sides of a line, (stations, offsets)."""

    line_mm: Floats
    ray: Floats  # Vectors to the left, (stations, 2), with a component of 1 mm perpendicular to the line
    offset_mm: Floats  # Evenly spaced distances square to the line, positive to the left, 0 in the middle
    light: Floats
    valid: Booleans  # True for samples on the face and in the photo
    mm_per_px: float

    @property
    def sample_px(self) -> float:
        """Spacing of samples across the line, in px."""
        return (self.offset_mm[1] - self.offset_mm[0]) / self.mm_per_px

    @property
    def station_px(self) -> float:
        """Spacing of stations along the line, in px."""
        return arc_length(self.line_mm)[-1] / (len(self.line_mm) - 1) / self.mm_per_px

    @property
    def middle(self) -> int:
        """Index of the column on the line."""
        return len(self.offset_mm) // 2

    def places_mm(self, offset_mm: Floats) -> Floats:
        """Return the position on each ray at the distance ``offset_mm``, (n,), from the line, (n, 2)."""
        return self.line_mm + offset_mm[:, None] * self.ray


def straighten(photo: Photo, patch: Patch, line_mm: Floats, ray: Floats, step_mm: float, reach_mm: float) -> Strip:
    """Sample the photo every ``step_mm``, up to ``reach_mm`` to either side of the line."""
    count = int(np.ceil(reach_mm / step_mm))
    offset_mm = np.arange(-count, count + 1.0) * step_mm
    place_mm = places_beside(line_mm, offset_mm, ray)
    place_px = photo.to_px(place_mm)
    return Strip(line_mm, ray, offset_mm, patch.light(place_px), patch.on_sample(place_px, place_mm), photo.mm_per_px)


def sample_step_mm(width_mm: float, mm_per_px: float) -> float:
    """Return the spacing of samples across a crack about ``width_mm`` wide."""
    return np.clip(width_mm / SAMPLES, FINEST_PX * mm_per_px, COARSEST_PX * mm_per_px)


# Constants for following and refining walls. "share" is lightness as a fraction: 0 for the crack, 1 for mortar.
#
# Chosen on drawn photos. On 200 wide cracks drawn afterwards, the mean width is off by at most 2.5 %. A higher
# ``STAINED`` leaves out less of a stain, and a lower ``STAINED`` cuts off more of a lit inside.
HALF = 0.5  # Share at the middle of a blurred edge
STAINED = 0.35  # Share at a wall that leaves out a stain
ASIDE_PX = 4.0  # Minimum distance between the walls at ``HALF`` and ``STAINED`` for a stain. Blur alone causes 1.4 px
STEEPEST_WALL = 3.2  # Largest slope of a wall to its line: 73 degrees
STIFFNESS = 0.5  # Cost of a step at 45 degrees, in px of misplaced mortar. The cost of including a pore must be higher
# Length before a wall's last step, in crack widths, whose median width is used beyond that step
MEDIAN_WIDTHS = 4.0
CRACK = 0.25  # The crack's level is read within this many crack widths of the line
MORTAR = (0.8, 1.5)  # The mortar's level is read between these distances from the line, in crack widths
REFINEMENTS = 2  # Rounds of refinement. The first starts from a sample near the wall, the second from the wall
# Levels of crack and mortar are read from this many sigmas of the blur on. There, blur changes them by under 1/15
STEP_SIGMAS = 1.5
INSIDE = 0.8  # The crack's level is read over this many sigmas. A longer range would cross a lit rim
OUTSIDE = 3.0  # The mortar's level is read over this many sigmas. A longer range would reach a stain
SNAP_PX = 2.0  # Largest distance from a followed wall to its step
SHARPEST_PX = 0.8  # Minimum sigma. No edge is sharper than the blur
SOFTEST_PX = 3.5  # Largest sigma. On a softer edge, the blur cannot be measured
RIM = 0.2  # Minimum additional width of an edge with a lit rim, in sigmas of the blur
OUTER = 0.84  # Share at which softness is measured: one sigma outside the middle of the edge
# Fraction of the step between both levels at the middle of an edge. Blur raises the inner level more than the outer
MIDDLE = 0.475
MIN_STEP = 0.25  # Minimum height of a wall's step, as a share


@dataclass(frozen=True)
class Walls:
    """Distances of the left and the right wall from the line at each station, (2, stations). Positive outward."""

    away_mm: Floats
    clear_step: Booleans  # True if the wall is in the photo, with a clear step from dark to bright
    covered: Booleans  # True if the wall is drawn straight across a stone or a side crack
    open_line: Booleans  # True for stations at which the line itself is dark
    rim: Floats  # Brightness above which a sample is not crack, (stations,)
    blur_px: float  # Sigma of the photo's own blur, from the sharper wall

    @property
    def both_clear(self) -> Booleans:
        return self.clear_step[0] & self.clear_step[1]

    @property
    def usual_width_mm(self) -> float:
        return float(np.median(self.away_mm.sum(axis=0)[self.both_clear]))


def find_walls(strip: Strip, width_mm: float, wall_share: float, along_edge: bool = False) -> Walls:
    """Return both walls, each in the middle of its step from dark to bright. Stations without a step are interpolated.

    The crack is about ``width_mm`` wide and extends to ``wall_share`` of the contrast to mortar. If the edge of the
    face hides one wall before the other, the hidden wall continues parallel to the other wall, unless ``along_edge``
    is True, for rays that follow the edge.
    """
    across = width_mm / strip.mm_per_px / strip.station_px
    over, sample_px = 2 * int(np.ceil(across)) + 1, strip.sample_px
    light, valid = outward(strip, strip.light), outward(strip, strip.valid)
    dark, bright = _levels(strip, width_mm, over)
    contrast = np.maximum(bright - dark, 1e-6)
    share = np.clip((light - dark[:, None]) / contrast[..., None], 0, 1)

    levels = (HALF, STAINED) if wall_share == HALF else (wall_share,)
    # Samples of unknown brightness must not attract a wall.
    excess = np.concatenate([np.where(valid, share - level, 0) for level in levels])
    place_px, *stained_px = np.split(cheapest_wall(excess, sample_px, strip.station_px), len(levels))
    for inner_px in stained_px:
        place_px = np.where(place_px - inner_px > ASIDE_PX, inner_px, place_px)

    edge_px = softness_px(share, place_px, sample_px, wall_share)
    sigma_px, clear_step = np.clip(edge_px, SHARPEST_PX, SOFTEST_PX), np.zeros(place_px.shape, bool)
    rim = dark + contrast * lit_rims(share, place_px, sigma_px, sample_px, wall_share)[:, None]

    shown = np.where(valid, light, np.nan)
    for _ in range(REFINEMENTS):
        place_px, clear_step = refined_to_subpixel(shown, place_px, sigma_px, sample_px, over, contrast, rim)
    rim = dark + max(wall_share, HALF) * (bright.mean(axis=0) - dark)
    return Walls(
        fill_gaps(place_px * strip.mm_per_px, clear_step, max(1, round(MEDIAN_WIDTHS * across)), along_edge),
        clear_step,
        np.zeros_like(clear_step),
        strip.light[:, strip.middle] < rim,
        rim,
        max(edge_px**2 - BLUR_PX**2, 0.0) ** 0.5,
    )


def _levels(strip: Strip, width_mm: float, over: int) -> tuple[Floats, Floats]:
    """Return the light of the crack, (stations,), and of the mortar on both sides, (2, stations)."""
    distance = np.abs(strip.offset_mm)
    dark = steadied(np.where(strip.valid & (distance < CRACK * width_mm), strip.light, np.nan)[None], over)[0]
    # A tip is narrower than the band, so that the band includes mortar there.
    dark = np.minimum(dark, np.median(dark))
    beside = strip.valid & (distance > MORTAR[0] * width_mm) & (distance < MORTAR[1] * width_mm)
    usual = median_of(strip.light[beside])
    # In wide parts of the crack, the band beside it includes crack.
    mortar = beside & (strip.light > (2 * dark[:, None] + usual) / 3)
    return dark, steadied(outward(strip, np.where(mortar, strip.light, np.nan)), over)


def cheapest_wall(excess: Floats, sample_px: float, station_px: float) -> Floats:
    """Return the distance of the wall on each side from the line in px, (sides, stations), to the nearest sample.

    ``excess``, (sides, stations, samples), is negative in the crack. The wall is the line with the lowest cost. The
    cost is the sum of the excess inside the line, plus the cost of the line's steps to a side.
    """
    most = max(1, round(STEEPEST_WALL * station_px / sample_px))
    price = STIFFNESS / station_px * (np.arange(-most, most + 1) * sample_px) ** 2
    sample = cheapest_way(np.cumsum(excess, axis=2) * sample_px, np.asarray(price, float))
    return np.asarray((sample + 0.5) * sample_px, float)


def cheapest_way(cost: Floats, price: Floats) -> Integers:
    """Return the sample at each station of the cheapest path from the first station to the last.

    ``cost`` is (paths, stations, samples), and the result is (paths, stations). ``price``, (2k + 1,), is the cost of a
    step to a side by -k to k samples. The method is dynamic programming.
    """
    ways, stations, samples = cost.shape
    most = len(price) // 2
    # Costs of reaching the samples of each station. The cost of samples outside the picture is infinite.
    reached = np.full((stations, ways, samples + 2 * most), np.inf)
    options = np.lib.stride_tricks.sliding_window_view(reached, samples, axis=2)
    reached[0, :, most:-most] = cost[:, 0]
    for station in range(1, stations):
        least = (options[station - 1] + price[:, None]).min(axis=1)
        reached[station, :, most:-most] = least + cost[:, station]
    route = np.empty((ways, stations), np.int64)
    route[:, -1] = reached[-1, :, most:-most].argmin(axis=1)
    for station in range(stations - 1, 0, -1):
        for way, sample in enumerate(route[:, station]):
            came_by = reached[station - 1, way, sample : sample + len(price)] + price
            route[way, station - 1] = sample + came_by.argmin() - most
    return route


def fill_gaps(walls: Floats, clear_step: Booleans, usual: int, along_edge: bool) -> Floats:
    """Return both walls, (2, stations), interpolated linearly between stations with a clear step.

    Past the last step of a wall, its distance from the other wall is the median width of ``usual`` stations, unless
    ``along_edge`` is True.
    """
    if not clear_step.any(axis=1).all():
        return walls
    station = np.arange(walls.shape[1])
    walls = np.stack(
        [np.interp(station, station[step], wall[step]) for wall, step in zip(walls, clear_step, strict=True)]
    )
    for onward in () if along_edge else (slice(None), slice(None, None, -1)):
        ends = [int(np.flatnonzero(step[onward])[-1]) for step in clear_step]
        near, far = np.argsort(ends, kind="stable")
        width, last = walls.sum(axis=0)[onward], ends[near]
        usual_width = np.median(width[max(0, last + 1 - usual) : last + 1])
        walls[near, onward][last + 1 :] = np.maximum(usual_width - walls[far, onward][last + 1 :], 0)
    return walls


def softness_px(share: Floats, place_px: Floats, sample_px: float, wall_share: float) -> float:
    """Return the sigma of the blur of the sharper wall, in px, from the outer half. The inner half may be lit."""
    rel_px = np.arange(0, 3 * SOFTEST_PX, 0.5 * sample_px)
    profiles = _usual_profiles(share, place_px, rel_px, sample_px)
    reaches_px = [np.interp([wall_share, OUTER], profile, rel_px) for profile in profiles]
    return np.ptp(reaches_px, axis=1).min() / (ndtri(OUTER) - ndtri(wall_share))


def lit_rims(share: Floats, place_px: Floats, sigma_px: float, sample_px: float, wall_share: float) -> Floats:
    """Return the share of a lit rim just inside each wall, (2,). 0 if there is no lit rim."""
    rel_px, rims = np.arange(-3 * SOFTEST_PX, SOFTEST_PX, 0.5 * sample_px), np.zeros(2)
    for side, profile in enumerate(_usual_profiles(share, place_px, rel_px, sample_px)):
        inner_px, outer_px = np.interp([HALF, wall_share], profile, rel_px)
        if outer_px - inner_px > sigma_px * (ndtri(wall_share) + RIM):
            rims[side] = np.interp(np.linspace(inner_px, outer_px), rel_px, profile).mean()
    return rims


def _usual_profiles(share: Floats, place_px: Floats, rel_px: Floats, sample_px: float) -> Floats:
    """Return the median share at distances from each wall, (2, distances), made to increase outward."""
    columns = np.clip((place_px[..., None] + rel_px) / sample_px, 0, share.shape[2] - 1)
    return np.maximum.accumulate(np.median(between(share, columns), axis=1), axis=1)


def refined_to_subpixel(
    light: Floats, place_px: Floats, sigma_px: float, sample_px: float, over: int, contrast: Floats, rim: Floats
) -> tuple[Floats, Booleans]:
    """Return each wall's sub-pixel distance from the line in px, (2, stations), and a mask of clear steps.

    A wall is the position at which the light, linear between samples, crosses the middle between the levels just inside
    and just outside. The search begins at ``place_px``. ``light`` is ordered from the line outward, (2, stations,
    samples), and is NaN off the sample. Levels are medians over ``over`` stations, and the inner level is at least
    ``rim``, (2, stations).
    """
    width_px = np.maximum(median_filter(place_px.sum(axis=0), over, mode="nearest"), 1.0)[:, None]
    outer_px = np.arange(STEP_SIGMAS * sigma_px, (STEP_SIGMAS + OUTSIDE) * sigma_px, sample_px)
    # Beyond the middle of the crack, the other wall would be included.
    inner_px = np.maximum(
        -np.arange(STEP_SIGMAS * sigma_px, (STEP_SIGMAS + INSIDE) * sigma_px, sample_px), -width_px / 2
    )
    outer, inner = (
        steadied(between(light, (place_px[..., None] + rel_px) / sample_px), over) for rel_px in (outer_px, inner_px)
    )

    inner = np.maximum(inner, rim)
    excess = light - (inner + MIDDLE * (outer - inner))[..., None]
    before, after = excess[..., :-1], excess[..., 1:]
    rising = (before < 0) & (after >= 0)
    crossing_px = (np.arange(rising.shape[-1]) - before / np.where(rising, after - before, 1)) * sample_px
    away_px = np.where(rising, np.abs(crossing_px - place_px[..., None]), np.inf)
    nearest = away_px.argmin(axis=-1)[..., None]
    stepped = np.take_along_axis(away_px, nearest, -1)[..., 0] <= SNAP_PX
    step_px = np.take_along_axis(crossing_px, nearest, -1)[..., 0]
    return np.where(stepped, step_px, place_px), stepped & (outer - inner >= MIN_STEP * contrast)


def outward(strip: Strip, values: NDArray) -> NDArray:
    """Return the left and the right half of a strip, both ordered from the line outward, (2, stations, samples)."""
    return np.stack([values[:, strip.middle :], values[:, strip.middle :: -1]])


def steadied(values: Floats, over: int, percent: float = 50.0) -> Floats:
    """Return a percentile across the line at each station, (sides, stations), median-filtered along the line.

    Stations without values, which are NaN, are interpolated.
    """
    station = np.arange(values.shape[1])
    levels = np.zeros(values.shape[:2])
    for side, level in zip(values, levels, strict=True):
        count = np.isfinite(side).sum(axis=1)
        shown = count > 0
        if shown.any():
            # NaN is sorted to the end. NumPy's percentiles of rows with NaN take a hundred times as long.
            ordered, last = np.nan_to_num(np.sort(side[shown], axis=1)), count[shown, None] - 1
            level[:] = np.interp(station, station[shown], between(ordered, percent / 100 * last)[:, 0])
    return median_along(levels, over, axis=1)


def median_along(values: NDArray[Any], over: int, axis: int) -> NDArray[Any]:
    """Return the running median of ``over`` values, an odd number, along an axis. Beyond its ends, values repeat."""
    rows = np.moveaxis(values, axis, -1)
    padded = np.pad(rows, [*[(0, 0)] * (rows.ndim - 1), (over // 2, over // 2)], mode="edge")
    # SciPy's filter is up to ten times as fast in one dimension as in several.
    even = median_filter(padded.ravel(), over, mode="nearest").reshape(padded.shape)
    return np.moveaxis(even[..., over // 2 : over // 2 + rows.shape[-1]], -1, axis)


def between(values: Floats, column: Floats) -> Floats:
    """Interpolate each row of ``values`` at fractional columns, (..., n). The result is NaN outside the row."""
    last = values.shape[-1] - 1
    left = np.clip(column.astype(int), 0, last - 1)
    first, second = (np.take_along_axis(values, left + step, axis=-1) for step in (0, 1))
    return np.where((column >= 0) & (column <= last), first + (column - left) * (second - first), np.nan)
