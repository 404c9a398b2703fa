"""Refuse or doubt a path if the photo does not show a dark line between two equally bright sides along it.

Each check compares the light on a path with the light around it. The limits were set on 48 drawn photos and 63 real
ones with masks: no path on a crack comes near them.
"""

import numpy as np
from scipy.ndimage import median_filter

from digitise.crack_path.hints import IN_ITS_MIDDLE, CrackPath
from digitise.crack_path.profiles import finite_median, profiles_across, row_medians
from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.image.raster import blurred, sampled
from digitise.photo import Photo
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

NEAR_PX, FAR = 3.0, (3.0, 24.0)  # Px beyond half a width that belong to the path; reach: widths, plus px
NOT_DARK = 0.93  # Light of a path over its darker side, above which it is not dark; hairlines have 0.88
FAR_DARKER = 0.5  # The same ratio, below which a path between unlike sides is a crack: at one wall of a gap it is 1
BRIGHT = 1.25  # Least light of a bright line along a path over the ground's
SIDES, SIDES_PX = (0.9, 2.2), (2.0, 5.0)  # Widths, plus px, between which the sides of a found line are compared
MOST_UNLIKE = 0.4  # Largest difference of both sides over the smaller step to the line: up to 0.33 on real cracks
BAND, BAND_PX = (6.0, 20.0), 6.0  # Reach of the view of a dark band: widths, plus px; least px by which it is wider
TWICE = 2.0  # Least width of such a band over the fitted one; blur widens a band by less
BESIDE = (1.0, 1.5, 2.0)  # Distances from the line in crack widths at which its two sides are compared
UNLIKE = 1.8  # Ratio of brightness of both sides that shows a sample's edge; grain makes less over a few widths
STEADY = 17  # Samples, two crack widths, over which the ratio is a median, so that no pore or grain decides
GROUND = 75  # Percentile of the light across a stretch taken for the ground's


def require_dark(photo: Photo, path: CrackPath) -> None:
    """Raise InputError if a path is not darker than its darker side, and something far brighter runs along it."""
    light, own, left, right = _own_and_sides(photo, path, *_right_beside(path.width_px))
    ratio = _over_darker(own, left, right)
    brightest = finite_median(np.nan_to_num(light).max(axis=1) / np.fmax(row_medians(light), 1e-6))
    if ratio > NOT_DARK and brightest > BRIGHT:
        raise InputError(
            f"{photo.file}: no dark crack between the ends: the path is as bright as the ground on one side, and a "
            f"line {brightest:.1f} times as bright runs along it. If the crack is brighter than the ground, for "
            "example because of a filling or a light crust, paint it in photo.mask, and give ends_px on the paint. "
            f"If it is dark, {IN_ITS_MIDDLE}."
        )


def is_darker_than_both_sides(photo: Photo, path: CrackPath) -> bool:
    """Return True if a path is far darker than its darker side, as a crack between unlike materials is."""
    _, *lights = _own_and_sides(photo, path, *_right_beside(path.width_px))
    return _over_darker(*lights) < FAR_DARKER


def _over_darker(own: Floats, left: Floats, right: Floats) -> float:
    """Return the light of a path over that of its darker side, as a median along it; NaN if no side is in view."""
    return finite_median(own / np.fmax(np.fmin(left, right), 1e-6))


def _right_beside(width_px: float) -> tuple[float, float]:
    """Return the distances from a path at which the ground beside it begins and ends."""
    return width_px / 2 + NEAR_PX + 1, FAR[0] * width_px + FAR[1]


def _own_and_sides(photo: Photo, path: CrackPath, beside_px: float, reach_px: float) -> tuple[Floats, ...]:
    """Return for each stretch the light at each distance, its minimum on the path, and its median to left and right.

    The sides begin ``beside_px`` from the path. A side of which less than half a width is in the photo is NaN: it may
    show the crack alone.
    """
    profiles = profiles_across(photo, path.points_px, path.width_px, reach_px)
    light, away_px = profiles.mean(), np.abs(profiles.offset_px)
    own = light[:, away_px <= path.width_px / 2 + NEAR_PX].min(axis=1)
    sides = (light[:, (away_px > beside_px) & (sign * profiles.offset_px > 0)] for sign in (1, -1))
    least = max(path.width_px / 2, NEAR_PX)
    in_view = ((side, np.isfinite(side).sum(axis=1) >= least) for side in sides)
    return light, own, *(np.where(seen, row_medians(side), np.nan) for side, seen in in_view)


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
    edges = np.flatnonzero(np.diff(np.concatenate([[0], unlike.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0)) * step_px


def unlike_sides(photo: Photo, path: CrackPath) -> list[str]:
    """Return a warning if the two sides' difference in brightness is large compared with the darkness of the line."""
    beside_px, reach_px = (widths * path.width_px + more_px for widths, more_px in zip(SIDES, SIDES_PX, strict=True))
    _, own, left, right = _own_and_sides(photo, path, beside_px, reach_px)
    step = finite_median(np.fmin(left, right) - own)
    difference = abs(finite_median(left - right))
    if not difference > MOST_UNLIKE * max(step, 0.0):
        return []
    return [
        f"the two sides of the found line differ in brightness by {difference / max(step, 1e-3):.0%} of its darkness, "
        "as at the edge of a marking, a patch or a joint: look at overlay.png, and give ends_px if the "
        "crack is elsewhere"
    ]


def band_px(photo: Photo, line_px: Floats, width_px: float, level: float = 0.5) -> float:
    """Width in px of the dark band around a line, at a share ``level`` of its contrast to the ground far from it."""
    profiles = profiles_across(photo, line_px, width_px, BAND[0] * width_px + BAND[1])
    light = np.nan_to_num(profiles.mean(), nan=np.nanmedian(profiles.light))
    profile = np.median(light / np.maximum(np.percentile(light, GROUND, axis=1, keepdims=True), 1e-6), axis=0)
    near = np.flatnonzero(np.abs(profiles.offset_px) <= max(width_px / 2, 2.0))
    middle = int(near[np.argmin(profile[near])])
    bright = np.flatnonzero(profile >= profile[middle] + level * (1 - profile[middle]))
    return float(bright[bright > middle].min(initial=len(profile)) - bright[bright < middle].max(initial=-1) - 1)


def is_wider(dark_px: float, width_px: float) -> bool:
    """Return True if a dark band is so much wider than the crack's width that it cannot be the crack itself."""
    return dark_px > TWICE * width_px and dark_px - width_px > BAND_PX
