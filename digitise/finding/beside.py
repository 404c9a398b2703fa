"""Whether a line found in a photo has the same mortar on both sides, as a crack has, or is an edge of something."""

import cv2
import numpy as np
from scipy.ndimage import median_filter

from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.photo import Photo
from digitise.pictures.raster import blurred
from sealtwin.records import Floats

BESIDE = (1.0, 1.5, 2.0)
"""Crack widths from the line to where its two sides are compared."""
UNLIKE = 1.8
"""Brightness of one side over the other. Real cracks in grainy mortar stay below over a few widths; a sample and what
lies beside it do not: seen on a cropped photo whose path turned from the crack into the sample's black edge.
"""
STEADY_WIDTHS = 2.0
"""The sides are compared over this much of the line at once, so that no pore or grain decides."""


def unlike_length_px(photo: Photo, points_px: Floats, width_px: float) -> float:
    """Length of the longest stretch of a line whose two sides differ in brightness by more than ``UNLIKE``."""
    step_px = max(1.0, width_px / 8)
    line = smoothed(resampled(points_px, step_px), 8.0)
    soft = blurred(photo.brightness, width_px / 4)
    normal = left_normals(line)
    sides = []
    for sign in (1, -1):
        places = line[:, None] + sign * width_px * np.array(BESIDE)[:, None] * normal[:, None]
        x, y = places[..., 0].astype(np.float32), places[..., 1].astype(np.float32)
        light = cv2.remap(soft, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        sides.append(np.median(light, axis=1))
    ratio = median_filter(np.log(np.maximum(sides[0], 1e-4) / np.maximum(sides[1], 1e-4)), size=_odd(STEADY_WIDTHS * 8))
    return _longest_run(np.abs(ratio) > np.log(UNLIKE)) * step_px


def _longest_run(flags: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _odd(number: float) -> int:
    return 2 * round(number / 2) + 1
