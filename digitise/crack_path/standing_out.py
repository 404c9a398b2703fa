"""Compare the light on both sides of a line, and the width of the dark band along it."""

import numpy as np
from scipy.ndimage import median_filter

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.profiles import finite_median, profiles_across, row_medians
from digitise.geometry.polyline import left_normals, resampled, runs, smoothed
from digitise.image.raster import blurred, sampled
from digitise.photo import Photo
from sealtwin.core.records import Floats

NEAR_PX, FAR = 3.0, (3.0, 24.0)  # Px beyond half a width that belong to the path; reach: widths, plus px
FAR_DARKER = 0.5  # The same ratio, below which a path between unlike sides is a crack: at one wall of a gap it is 1
BAND, BAND_PX = (6.0, 20.0), 6.0  # Reach of the view of a dark band: widths, plus px; least px by which it is wider
TWICE = 2.0  # Least width of such a band over the fitted one; blur widens a band by less
BESIDE = (1.0, 1.5, 2.0)  # Distances from the line in crack widths at which its two sides are compared
UNLIKE = 1.8  # Ratio of brightness of both sides that shows a sample's edge; grain makes less over a few widths
STEADY = 17  # Samples, two crack widths, over which the ratio is a median, so that no pore or grain decides
GROUND = 75  # Percentile of the light across a stretch taken for the ground's


def is_darker_than_both_sides(photo: Photo, path: CrackPath) -> bool:
    """Return True if a path is far darker than its darker side, as a crack between unlike materials is."""
    profiles = profiles_across(photo, path.points_px, path.width_px, FAR[0] * path.width_px + FAR[1])
    light, away_px = profiles.mean(), np.abs(profiles.offset_px)
    dark = light[:, away_px <= path.width_px / 2 + NEAR_PX].min(axis=1)
    beside = away_px > path.width_px / 2 + NEAR_PX + 1
    left, right = (row_medians(light[:, beside & (side * profiles.offset_px > 0)]) for side in (1, -1))
    return finite_median(dark / np.fmax(np.fmin(left, right), 1e-6)) < FAR_DARKER


def unlike_length_px(photo: Photo, points_px: Floats, width_px: float) -> float:
    """Length of the longest stretch of a line on which both sides differ in brightness by more than ``UNLIKE``."""
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
    return int(np.ptp(runs(unlike), axis=1).max(initial=0)) * step_px


def band_px(photo: Photo, line_px: Floats, width_px: float) -> float:
    """Width in px of the dark band around a line, at half of its contrast to the ground far from it."""
    profiles = profiles_across(photo, line_px, width_px, BAND[0] * width_px + BAND[1])
    light = np.nan_to_num(profiles.mean(), nan=np.nanmedian(profiles.light))
    profile = np.median(light / np.maximum(np.percentile(light, GROUND, axis=1, keepdims=True), 1e-6), axis=0)
    near = np.flatnonzero(np.abs(profiles.offset_px) <= max(width_px / 2, 2.0))
    middle = int(near[np.argmin(profile[near])])
    bright = np.flatnonzero(profile >= (1 + profile[middle]) / 2)
    return float(bright[bright > middle].min(initial=len(profile)) - bright[bright < middle].max(initial=-1) - 1)


def is_wider(dark_px: float, width_px: float) -> bool:
    """Return True if a dark band is so much wider than the crack's width that it cannot be the crack itself."""
    return dark_px > TWICE * width_px and dark_px - width_px > BAND_PX
