"""Width of a crack along a path, measured in the photo: the search map is too coarse for a few pixels."""

import numpy as np
from scipy.ndimage import median_filter

from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.image.raster import Map, blurred, sampled
from digitise.photo import Photo
from sealtwin.core.records import Floats

BESIDE = (1.0, 1.5, 2.0)  # Crack widths from the line at which its two sides are compared
UNLIKE = 1.8  # Ratio of brightness between both sides, more than grain makes over a few widths: a sample's edge
STEADY = 17  # Samples over which the sides are compared at once, two crack widths, so that no pore or grain decides
BLUR_PX = 0.8  # Gaussian sigma that quiets grain and noise and leaves a straight edge in its place
STATIONS = 400  # Most stations along the path
STEP_PX = 0.5  # Spacing of samples across
REACHES = (4.0, 1.5)  # Widths in view to either side: first far, as the rough one may be a third; then near the crack
LEAST_REACH_PX = 8.0  # Least reach, for a path beside a thin crack
LEAST_FOUND = 0.3  # Least share of the stations that show both walls; below it the rough width is returned


def unlike_length_px(photo: Photo, points_px: Floats, width_px: float) -> float:
    """Length of the longest stretch of a line whose two sides differ in brightness by more than ``UNLIKE``."""
    step_px = max(1.0, width_px / 8)
    line = smoothed(resampled(points_px, step_px), 8.0)
    soft = blurred(photo.brightness, width_px / 4)
    normal = left_normals(line)
    sides = []
    for sign in (1, -1):
        places = line[:, None] + sign * width_px * np.array(BESIDE)[:, None] * normal[:, None]
        sides.append(np.median(sampled(soft, places), axis=1))
    ratio = median_filter(np.log(np.maximum(sides[0], 1e-4) / np.maximum(sides[1], 1e-4)), size=STEADY)
    unlike = np.abs(ratio) > np.log(UNLIKE)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], unlike.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0)) * step_px


def width_along(photo: Photo, points_px: Floats, rough_px: float) -> float:
    """Median width in px at half contrast around the darkest place on the path's normals, else ``rough_px``."""
    width_px = rough_px
    for reach in REACHES:
        light = _across(photo, points_px, width_px, max(reach * width_px, LEAST_REACH_PX))
        widths_px = _between_crossings(light, max(width_px / 2, 1.0))
        if len(widths_px) < LEAST_FOUND * len(light):
            return rough_px
        width_px = float(np.median(widths_px))
    return width_px


def _across(photo: Photo, points_px: Floats, width_px: float, reach_px: float) -> Map:
    """Brightness on the path's normals, (stations, samples)."""
    spacing_px = max(1.0, width_px / 4)
    line_px = smoothed(resampled(points_px, spacing_px), width_px / spacing_px)
    every = 1 + len(line_px) // STATIONS
    line_px, normal = line_px[::every], left_normals(line_px)[::every]
    samples = round(reach_px / STEP_PX)
    offset_px = STEP_PX * np.arange(-samples, samples + 1)
    place_px = line_px[:, None] + offset_px[:, None] * normal[:, None]
    low = np.maximum(np.floor(place_px.min(axis=(0, 1))).astype(int) - 4, 0)
    high = np.ceil(place_px.max(axis=(0, 1))).astype(int) + 5
    soft = blurred(photo.brightness[low[1] : high[1], low[0] : high[0]], BLUR_PX)
    return sampled(soft, place_px - low)


def _between_crossings(light: Map, beside_px: float) -> Floats:
    """Widths in pixels at half contrast around the darkest place within ``beside_px``, of rows with both walls."""
    station, column = np.arange(len(light)), np.arange(light.shape[1])
    near = np.abs(column - len(column) // 2) * STEP_PX <= beside_px
    start = np.argmin(np.where(near, light, np.inf), axis=1)
    half = (light[station, start] + np.median(light, axis=1)) / 2
    bright, onward = light >= half[:, None], column - start[:, None]
    right = np.where(bright & (onward >= 0), column, len(column)).min(axis=1)
    left = np.where(bright & (onward <= 0), column, -1).max(axis=1)
    station = np.flatnonzero((right < len(column)) & (left >= 0) & (left < start))
    width = np.zeros(len(station))
    for end, inward in ((right[station], -1), (left[station], 1)):
        beyond = light[station, end] - half[station]
        width += np.abs(end - start[station]) - beyond / (light[station, end] - light[station, end + inward])
    return STEP_PX * width
