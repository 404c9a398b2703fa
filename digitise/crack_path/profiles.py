"""Light across a line, in stretches along it: what shows a line to be a crack, and how wide its darkness is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.image.raster import blurred, sampled
from digitise.photo import Photo
from sealtwin.core.records import Floats

BLUR_PX = 0.8  # Gaussian sigma that quiets noise and leaves an edge in its place
LEAST_WIDTH_PX = 2.0  # Least width by which a line is smoothed: a path's steps are whole pixels
LEAST_LENGTH_PX, WIDTHS_LONG = 16.0, 2.0  # Length of a stretch: many grains, and at least so many widths
MOST_STATIONS = 4000  # More show no more of a long line


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
    low = np.maximum(np.floor(place_px.min(axis=(0, 1))).astype(int) - 4, 0)
    high = np.maximum(np.ceil(place_px.max(axis=(0, 1))).astype(int) + 5, low + 1)
    soft = blurred(photo.brightness[low[1] : high[1], low[0] : high[0]], BLUR_PX)
    shown = np.all((place_px >= 0) & (place_px <= np.array(photo.size_px) - 1), axis=2)
    light = np.where(shown, sampled(soft, place_px - low).astype(float), np.nan)
    return Profiles(line_px, offset_px, place_px, light, cuts)


def median_known(values: Floats) -> float:
    """Median of the values that are known, NaN if none is."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def row_medians(values: Floats) -> Floats:
    """Median of what is known in each row, (n,); NaN if nothing is."""
    return np.array([median_known(row) for row in values])
