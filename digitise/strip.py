"""Straighten the photo along a line, and find the two walls of a crack in it."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from digitise.photo import Photo
from digitise.polyline import left_normals
from digitise.raster import Map
from sealtwin.records import Floats

OFFSET_PX = 0.5
"""Between samples across the crack, in pixels of the photo."""
BLUR_PX = 0.8
"""Of the brightness before it is sampled: quiets grain and noise; a straight edge stays in its place."""
STEEPEST = 16
"""Samples that a wall may move sideways between two stations."""
STIFFNESS = 0.1
"""Price of a step sideways, per sample squared, against a sample of misplaced mortar."""

SNAP = 4
"""Samples between the smoothest wall and the half-contrast crossing that is taken for it."""


@dataclass(frozen=True)
class Strip:
    """Brightness on the normals of a line, (stations, offsets)."""

    line_mm: Floats
    normal: Floats
    """Unit vectors to the left, (stations, 2)."""
    offset_mm: Floats
    """Increasing; positive to the left."""
    light: Floats
    valid: NDArray[np.bool_]
    """On the sample, and in the photo."""


@dataclass(frozen=True)
class Walls:
    """Distance of each wall from the line, station by station, positive outward."""

    left_mm: Floats
    right_mm: Floats
    left_seen: NDArray[np.bool_]
    """The wall is in the picture there, with a clear step from dark to bright."""
    right_seen: NDArray[np.bool_]
    open_line: NDArray[np.bool_]
    """The line itself runs in the dark."""
    threshold: Floats
    """Half contrast at each station."""


def straighten(photo: Photo, soft: Map, mask: NDArray[np.uint8], line_mm: Floats, reach_mm: float) -> Strip:
    """Sample ``soft``, the blurred brightness, up to ``reach_mm`` to either side of the line.

    ``mask`` is 255 on the sample.
    """
    count = int(np.ceil(reach_mm / (OFFSET_PX * photo.mm_per_px)))
    offset_mm = np.arange(-count, count + 1.0) * (OFFSET_PX * photo.mm_per_px)
    normal = left_normals(line_mm)
    place_mm = line_mm[:, None] + offset_mm[:, None] * normal[:, None]
    place_px = photo.to_px(place_mm.reshape(-1, 2)).reshape(place_mm.shape).astype(np.float32)
    x, y = place_px[..., 0], place_px[..., 1]
    light = cv2.remap(soft, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    valid = cv2.remap(mask, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0) >= 254
    return Strip(line_mm, normal, offset_mm, light.astype(float), valid)


def find_walls(strip: Strip, width_mm: float, spacing_mm: float) -> Walls:
    """Both walls at half contrast, as smooth as the picture allows.

    ``width_mm`` is the typical width of the crack, ``spacing_mm`` the distance of stations. Where a wall is lost for a
    while it is bridged. Where one alone reaches on, as at an oblique open end, the other is taken to go with it at the
    width of the stations before.
    """
    over = 2 * int(np.ceil(width_mm / spacing_mm)) + 1
    distance = np.abs(strip.offset_mm)
    dark = _level(strip, strip.valid & (distance < 0.25 * width_mm), over)
    # A tip is narrower than the band and would pass mortar for its darkness.
    dark = np.minimum(dark, np.median(dark))
    beside = strip.valid & (distance > 0.8 * width_mm) & (distance < 1.5 * width_mm)
    usual = float(np.median(strip.light[beside])) if beside.any() else 0.0
    # Where the crack is wide, the band beside it is crack as well; that is not what mortar looks like.
    mortar = beside & (strip.light > (2 * dark[:, None] + usual) / 3)
    sides = []
    for sign in (1, -1):
        bright = _level(strip, mortar & (sign * strip.offset_mm > 0), over)
        outward = np.flatnonzero(sign * strip.offset_mm >= 0)[::sign]
        contrast = np.maximum(bright - dark, 1e-6)[:, None]
        # -0.5 in the dark, 0.5 on mortar; 0 where nothing is known, which pulls a wall nowhere.
        excess = np.clip((strip.light[:, outward] - dark[:, None]) / contrast, 0, 1) - 0.5
        excess[~strip.valid[:, outward]] = 0
        place, seen = _follow(excess, strip.valid[:, outward])
        sides.append((place * float(strip.offset_mm[1] - strip.offset_mm[0]), seen, (dark + bright) / 2))
    (left_mm, left_seen, left_half), (right_mm, right_seen, right_half) = sides
    left_mm, right_mm = _completed(left_mm, right_mm, left_seen, right_seen, over)
    threshold = (left_half + right_half) / 2
    middle = strip.light[:, len(strip.offset_mm) // 2]
    return Walls(left_mm, right_mm, left_seen, right_seen, middle < threshold, threshold)


def _completed(
    left_mm: Floats, right_mm: Floats, left_seen: NDArray[np.bool_], right_seen: NDArray[np.bool_], over: int
) -> tuple[Floats, Floats]:
    """Both walls at every station: bridged where one is lost for a while, and at the ends at the width's distance."""
    both = left_seen & right_seen
    if not both.any():
        return left_mm, right_mm
    station = np.arange(len(left_mm))
    left_mm = np.interp(station, station[left_seen], left_mm[left_seen])
    right_mm = np.interp(station, station[right_seen], right_mm[right_seen])
    width_mm = median_filter((left_mm + right_mm)[both], size=over, mode="nearest")
    width_mm = np.interp(station, station[both], width_mm)
    past_left, past_right = _past_ends(left_seen), _past_ends(right_seen)
    return (
        np.where(past_left & ~past_right, np.maximum(width_mm - right_mm, 0), left_mm),
        np.where(past_right & ~past_left, np.maximum(width_mm - left_mm, 0), right_mm),
    )


def _past_ends(seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Stations before the first and after the last that was seen."""
    known = np.flatnonzero(seen)
    station = np.arange(len(seen))
    return (station < known[0]) | (station > known[-1])


def _level(strip: Strip, where: NDArray[np.bool_], over: int) -> Floats:
    """Median brightness of some pixels of each station, steadied along the strip.

    Stations that have too few of them take their neighbours' value.
    """
    known = where.sum(axis=1) >= 3
    if not known.any():
        return np.zeros(len(strip.light))
    values = np.where(where[known], strip.light[known], np.nan)
    stations = np.arange(len(strip.light))
    level = np.interp(stations, stations[known], np.nanmedian(values, axis=1))
    return median_filter(level, size=over, mode="nearest")


def _follow(excess: Floats, valid: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
    """The wall in samples from the line, (stations,), and where it is seen.

    ``excess`` is negative in the crack and positive on the mortar. The wall that splits them best has the least sum of
    excess inside it; dynamic programming weighs that against steps sideways, so that a pore or a thin branch is passed.
    """
    inside = np.cumsum(excess, axis=1)
    stations, samples = inside.shape
    steps = np.arange(-STEEPEST, STEEPEST + 1)
    price = STIFFNESS * steps[:, None] ** 2
    best = inside[0].copy()
    came_by = np.zeros((stations, samples), dtype=int)
    for station in range(1, stations):
        padded = np.pad(best, STEEPEST, constant_values=np.inf)
        options = np.lib.stride_tricks.sliding_window_view(padded, samples)[::-1] + price
        came_by[station] = np.argmin(options, axis=0)
        best = options[came_by[station], np.arange(samples)] + inside[station]
    place = np.empty(stations, dtype=int)
    place[-1] = int(np.argmin(best))
    for station in range(stations - 1, 0, -1):
        place[station - 1] = place[station] - steps[came_by[station, place[station]]]
    return _between_samples(excess, place, valid)


def _between_samples(
    excess: Floats, place: NDArray[np.int_], valid: NDArray[np.bool_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Where excess crosses zero nearest to each place; the wall is seen where such a crossing lies on the sample."""
    rising = (excess[:, :-1] < 0) & (excess[:, 1:] >= 0) & valid[:, :-1] & valid[:, 1:]
    sample = np.arange(rising.shape[1])
    away = np.where(rising, np.abs(sample - place[:, None]), rising.shape[1])
    nearest = np.argmin(away, axis=1)
    station = np.arange(len(place))
    seen = away[station, nearest] <= SNAP
    here, there = excess[station, nearest], excess[station, nearest + 1]
    crossing = nearest - here / np.where(seen, there - here, 1)
    return np.where(seen, crossing, place), seen
