"""Light across a line, in stretches along it: what shows a line to be a crack, and how wide its darkness is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.image.raster import Map, blurred, sampled
from digitise.photo import Photo
from sealtwin.core.records import Floats

BLUR_PX = 0.8  # Gaussian sigma that quiets noise and leaves an edge in its place
LEAST_WIDTH_PX = 2.0  # Least width by which a line is smoothed: a path's steps are whole pixels
LEAST_LENGTH_PX, WIDTHS_LONG = 16.0, 2.0  # Length of a stretch: many grains, and at least so many widths
MOST_STATIONS = 4000  # More show no more of a long line

# Of a width at half contrast.
STATIONS = 400  # Most stations along the path
STEP_PX = 0.5  # Spacing of samples across
REACHES = (4.0, 1.5)  # Widths in view to either side: first far, as the rough one may be a third; then near the crack
LEAST_REACH_PX = 8.0  # Least reach, for a path beside a thin crack
LEAST_FOUND = 0.3  # Least share of the stations that show both walls; below it the rough width is returned


@dataclass(frozen=True)
class Profiles:
    """Light on the normals of a line's stations, and the stretches that these are grouped in."""

    line_px: Floats  # (stations, 2)
    offset_px: Floats  # Distances square to the line, (m,), along its left normals
    place_px: Floats  # (stations, m, 2)
    light: Floats  # (stations, m); NaN outside the photo
    cuts: NDArray[np.int_]  # First station of each stretch, and one past the last

    def mean(self, where: NDArray[np.bool_] | None = None) -> Floats:
        """Mean light of each stretch at each distance, (stretches, m), or of all samples ``where``, (stretches,)."""
        known = np.isfinite(self.light) if where is None else np.isfinite(self.light) & where
        light = np.where(known, self.light, 0)
        if where is not None:
            light, known = light.sum(axis=1), known.sum(axis=1)
        count = np.add.reduceat(known.astype(float), self.cuts[:-1], axis=0)
        total = np.add.reduceat(light, self.cuts[:-1], axis=0)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def profiles_across(photo: Photo, line_px: Floats, width_px: float, reach_px: float) -> Profiles:
    """Read the light up to ``reach_px`` to either side of a line along a crack about ``width_px`` wide."""
    width_px = max(width_px, LEAST_WIDTH_PX)
    line_px = smoothed(resampled(line_px, 1.0), width_px)
    normal = left_normals(line_px)
    every = 1 + len(line_px) // MOST_STATIONS
    line_px, normal = line_px[::every], normal[::every]
    stretch = max(WIDTHS_LONG * width_px, LEAST_LENGTH_PX) / every
    cuts = np.linspace(0, len(line_px), max(1, round(len(line_px) / stretch)) + 1).astype(int)
    offset_px = np.arange(-np.ceil(reach_px), np.ceil(reach_px) + 1)
    place_px = line_px[:, None] + offset_px[:, None] * normal[:, None]
    shown = np.all((place_px >= 0) & (place_px <= np.array(photo.size_px) - 1), axis=2)
    light = np.where(shown, _softly(photo, place_px).astype(float), np.nan)
    return Profiles(line_px, offset_px, place_px, light, cuts)


def _softly(photo: Photo, place_px: Floats) -> Map:
    """Brightness at places, (n, m, 2), blurred by ``BLUR_PX``."""
    low = np.maximum(np.floor(place_px.min(axis=(0, 1))).astype(int) - 4, 0)
    high = np.maximum(np.ceil(place_px.max(axis=(0, 1))).astype(int) + 5, low + 1)
    soft = blurred(photo.brightness[low[1] : high[1], low[0] : high[0]], BLUR_PX)
    return sampled(soft, place_px - low)


def median_known(values: Floats) -> float:
    """Median of the values that are known, NaN if none is."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def row_medians(values: Floats) -> Floats:
    """Median of what is known in each row, (n,); NaN if nothing is."""
    return np.array([median_known(row) for row in values])


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
    return _softly(photo, place_px)


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
