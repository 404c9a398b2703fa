"""Read the light across a line: its mean along the line, the width of the dark band, and how the two sides differ."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import left_normals, places_beside, resampled, runs, smoothed
from digitise.image.raster import Map, blurred, sampled
from digitise.photo import Photo
from sealtwin.core.records import Booleans, Floats, Integers

BLUR_PX = 0.8  # Sigma of a Gaussian blur that reduces noise and does not move an edge
MIN_WIDTH_PX = 2.0  # Least sigma for smoothing a line, because the steps of a path are whole pixels
# Least length of a stretch: this many px, for many grains, and two widths of the crack
MIN_LENGTH_PX, WIDTHS_LONG = 16.0, 2.0
MAX_STATIONS = 4000  # Largest number of stations of a line; more add nothing

STATIONS = 400  # Largest number of stations at which a width is measured
STEP_PX = 0.5  # Spacing of samples across the line
# Widths in view to either side: far in the first pass, since the rough width may be a third; then near
REACHES = (4.0, 1.5)
MIN_REACH_PX = 8.0  # Least reach, for a path that is off a thin crack
MIN_FOUND = 0.3  # The rough width is returned if a smaller share of stations shows both walls


@dataclass(frozen=True)
class Profiles:
    """Light on the normals at a line's stations. Stations are grouped in stretches."""

    line_px: Floats  # (stations, 2)
    offset_px: Floats  # Distances from the line to its left, (m,)
    place_px: Floats  # (stations, m, 2)
    light: Floats  # Linear light, (stations, m). NaN outside the photo
    cuts: Integers  # First station of each stretch, and one past the last

    def mean(self, where: Booleans | None = None) -> Floats:
        """Mean light of each stretch at each distance, (stretches, m).

        With ``where``, the mean of each stretch over these samples, (stretches,).
        """
        weight = np.isfinite(self.light) if where is None else np.isfinite(self.light) & where
        light = np.where(weight, self.light, 0)
        if where is not None:
            light, weight = light.sum(axis=1), weight.sum(axis=1)
        count = np.add.reduceat(weight.astype(float), self.cuts[:-1], axis=0)
        total = np.add.reduceat(light, self.cuts[:-1], axis=0)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def profiles_across(photo: Photo, line_px: Floats, width_px: float, reach_px: float) -> Profiles:
    """Read the light up to ``reach_px`` to either side of a line that follows a crack about ``width_px`` wide."""
    width_px = max(width_px, MIN_WIDTH_PX)
    line_px = smoothed(resampled(line_px, 1.0), width_px)
    normal = left_normals(line_px)
    every = 1 + len(line_px) // MAX_STATIONS
    line_px, normal = line_px[::every], normal[::every]
    stretch = max(WIDTHS_LONG * width_px, MIN_LENGTH_PX) / every
    cuts = np.linspace(0, len(line_px), max(1, round(len(line_px) / stretch)) + 1).astype(int)
    offset_px = np.arange(-np.ceil(reach_px), np.ceil(reach_px) + 1)
    place_px = places_beside(line_px, offset_px, normal)
    shown = np.all((place_px >= 0) & (place_px <= np.array(photo.size_px) - 1), axis=2)
    light = np.where(shown, _softly(photo, place_px).astype(float), np.nan)
    return Profiles(line_px, offset_px, place_px, light, cuts)


def _softly(photo: Photo, place_px: Floats) -> Map:
    """Return the brightness at points, (n, m, 2), after a blur by ``BLUR_PX``."""
    low = np.maximum(np.floor(place_px.min(axis=(0, 1))).astype(int) - 4, 0)
    high = np.maximum(np.ceil(place_px.max(axis=(0, 1))).astype(int) + 5, low + 1)
    soft = blurred(photo.brightness[low[1] : high[1], low[0] : high[0]], BLUR_PX)
    return sampled(soft, place_px - low)


def finite_median(values: Floats) -> float:
    """Median of the finite values. NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")


def row_medians(values: Floats) -> Floats:
    """Median of the finite values in each row, (n,). NaN for a row without any."""
    return np.array([finite_median(row) for row in values])


def width_along(photo: Photo, points_px: Floats, rough_px: float) -> float:
    """Return the median width in px of the dark band along a path, at half contrast.

    Returns ``rough_px`` if too few stations show both walls.
    """
    width_px = rough_px
    for reach in REACHES:
        light = _across(photo, points_px, width_px, max(reach * width_px, MIN_REACH_PX))
        widths_px = _between_crossings(light, max(width_px / 2, 1.0))
        if len(widths_px) < MIN_FOUND * len(light):
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
    offset_px = STEP_PX * np.arange(-samples, samples + 1.0)
    place_px = places_beside(line_px, offset_px, normal)
    return _softly(photo, place_px)


def _between_crossings(light: Map, beside_px: float) -> Floats:
    """Return the widths in px at half contrast, for the rows of ``light`` that show both walls.

    A width is measured around the darkest sample within ``beside_px`` of the path.
    """
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


NEAR_PX, FAR = 3.0, (3.0, 24.0)  # Px beyond half a width that belong to the path; reach of the view: widths, plus px
# A path between unlike sides is a crack if its light over its darker side's is below this; at one wall of a gap it is 1
FAR_DARKER = 0.5
# Reach of the view of a dark band: widths, plus px; the band must be wider than the crack by at least these px
BAND, BAND_PX = (6.0, 20.0), 6.0
BAND_RATIO = 2.0  # A dark band is too wide from this multiple of the fitted width on; blur widens a band by less
SIDE_WIDTHS = (1.0, 1.5, 2.0)  # Distances from the line, in crack widths, at which its two sides are compared
# A larger brightness ratio of the two sides shows a sample's edge; over a few widths, grain makes less
SIDE_RATIO = 1.8
STEADY = 17  # The ratio is a median over this many samples, two crack widths, so that no pore or grain decides
GROUND = 75  # Percentile of the light across a stretch that is taken for the ground's light


def is_darker_than_both_sides(photo: Photo, path: CrackPath) -> bool:
    """Return True if a path is far darker than its darker side, as a crack between two materials is."""
    profiles = profiles_across(photo, path.points_px, path.width_px, FAR[0] * path.width_px + FAR[1])
    light, away_px = profiles.mean(), np.abs(profiles.offset_px)
    dark = light[:, away_px <= path.width_px / 2 + NEAR_PX].min(axis=1)
    beside = away_px > path.width_px / 2 + NEAR_PX + 1
    left, right = (row_medians(light[:, beside & (side * profiles.offset_px > 0)]) for side in (1, -1))
    return finite_median(dark / np.fmax(np.fmin(left, right), 1e-6)) < FAR_DARKER


def unlike_length_px(photo: Photo, points_px: Floats, width_px: float) -> float:
    """Return the length of a line's longest stretch whose sides differ in brightness by over ``SIDE_RATIO``."""
    step_px = max(1.0, width_px / 8)
    line = smoothed(resampled(points_px, step_px), 8.0)
    soft = blurred(photo.brightness, width_px / 4)
    left, right = (
        np.maximum(np.median(sampled(soft, places_beside(line, sign * width_px * np.array(SIDE_WIDTHS))), axis=1), 1e-4)
        for sign in (1, -1)
    )
    unlike = np.abs(median_filter(np.log(left / right), size=STEADY)) > np.log(SIDE_RATIO)
    return int(np.ptp(runs(unlike), axis=1).max(initial=0)) * step_px


def band_px(photo: Photo, line_px: Floats, width_px: float) -> float:
    """Return the width in px of the dark band around a line, at half of its contrast to the ground far from it."""
    profiles = profiles_across(photo, line_px, width_px, BAND[0] * width_px + BAND[1])
    light = np.nan_to_num(profiles.mean(), nan=np.nanmedian(profiles.light))
    profile = np.median(light / np.maximum(np.percentile(light, GROUND, axis=1, keepdims=True), 1e-6), axis=0)
    return dark_width_px(profile, profiles.offset_px, max(width_px / 2, 2.0), 1.0)


def dark_width_px(profile: Floats, offset_px: Floats, near_px: float, ground: float) -> float:
    """Return the width of the dark band around the darkest sample within ``near_px``, at half contrast to ``ground``.

    ``profile`` is the light at the offsets. Both arrays are (n,), and offsets are 1 px apart.
    """
    middle = int(np.argmin(np.where(np.abs(offset_px) <= near_px, profile, np.inf)))
    bright = np.flatnonzero(profile >= (profile[middle] + ground) / 2)
    return float(bright[bright > middle].min(initial=len(profile)) - bright[bright < middle].max(initial=-1) - 1)


def is_wider(dark_px: float, width_px: float) -> bool:
    """Return True if a dark band is so much wider than the crack's width that it cannot be the crack itself."""
    return dark_px > BAND_RATIO * width_px and dark_px - width_px > BAND_PX
