"""How wide a crack is along a path, in the photo itself: the search map is too coarse for a few pixels."""

import cv2
import numpy as np

from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.photo import Photo
from digitise.pictures.raster import Map, blurred
from sealtwin.records import Floats

BLUR_PX = 0.8
"""Of the brightness: quiets grain and noise; a straight edge stays in its place."""
STATIONS = 400
"""Along the path at most: half of them could miss the crack, and the median would stand."""
STEP_PX = 0.5
"""Between samples across."""
REACHES = (4.0, 1.5)
"""In widths, to either side: first as far as a crack needs that looks a third as wide as it is, which must leave more
mortar than crack in view; then near, where the light is the crack's own.
"""
LEAST_REACH_PX = 8.0
"""For a path beside a thin crack."""
LEAST_SEEN = 0.3
"""Share of the stations at which both walls are seen; below it the width is what it looked like."""


def width_along(photo: Photo, points_px: Floats, rough_px: float) -> float:
    """Median distance in pixels of both half-contrast crossings around the darkest place on each normal of the path.

    ``rough_px`` is what the width looks like on a coarser map, and what is answered where the walls are not seen.
    """
    width_px = rough_px
    for reach in REACHES:
        light = _across(photo, points_px, width_px, max(reach * width_px, LEAST_REACH_PX))
        widths_px = _between_crossings(light, max(width_px / 2, 1.0))
        if len(widths_px) < LEAST_SEEN * len(light):
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
    x, y = np.moveaxis((place_px - low).astype(np.float32), -1, 0)
    return np.asarray(cv2.remap(soft, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.float32)


def _between_crossings(light: Map, beside_px: float) -> Floats:
    """Widths at half contrast, in pixels, of those rows that show both walls.

    The crack's darkest place is looked for up to ``beside_px`` from the middle.
    """
    middle = light.shape[1] // 2
    near = np.abs(np.arange(light.shape[1]) - middle) * STEP_PX <= beside_px
    start = np.argmin(np.where(near, light, np.inf), axis=1)
    darkest = light[np.arange(len(light)), start]
    half = (darkest + np.median(light, axis=1)) / 2
    widths_px = []
    for row, at, level in zip(light, start, half, strict=True):
        right, left = _steps_to(row[at:], level), _steps_to(row[at::-1], level)
        if right is not None and left is not None:
            widths_px.append(STEP_PX * (right + left))
    return np.array(widths_px)


def _steps_to(row: Map, level: float) -> float | None:
    """Samples from the first to where the row has risen to a level, to a fraction; None where it does not."""
    above = np.flatnonzero(row >= level)
    if len(above) == 0 or above[0] == 0:
        return None
    end = int(above[0])
    return end - float((row[end] - level) / (row[end] - row[end - 1]))
