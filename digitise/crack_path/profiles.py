"""Read the light across a line: its mean along the line, the width of the dark band, and how the two sides differ."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from digitise.geometry.polyline import left_normals, places_beside, resampled, smoothed
from digitise.image.raster import Map, blurred, sampled
from digitise.photo import Photo
from sealtwin.core.arrays import runs
from sealtwin.core.records import Booleans, Floats, Integers

BLUR_PX = 0.8  # Sigma of a Gaussian blur that reduces noise and does not move an edge
MIN_WIDTH_PX = 2.0  # Minimum sigma for smoothing a line, because the steps of a path are whole pixels
# Minimum length of a stretch: this many px, so that it has many grains, or two widths of the crack if that is more
MIN_LENGTH_PX, WIDTHS_LONG = 16.0, 2.0
MAX_STATIONS = 4000  # Largest number of stations of a line. More would not improve the result

STATIONS = 400  # Largest number of stations at which a width is measured
STEP_PX = 0.5  # Spacing of samples across the line
# Widths read to either side, in two passes. The first is wide, since the rough width may be a third of the true width
REACHES = (4.0, 1.5)
MIN_REACH_PX = 8.0  # Minimum distance read to either side, for a path that is off a thin crack
MIN_FOUND = 0.3  # The rough width is returned if a smaller fraction of the stations shows both walls


@dataclass(frozen=True)
class Profiles:
    """Light on the normals at a line's stations. Stations are grouped in stretches."""

    line_px: Floats  # (stations, 2)
    offset_px: Floats  # Distances from the line to its left, (m,)
    place_px: Floats  # Position of each sample, (stations, m, 2)
    light: Floats  # Linear light, (stations, m). NaN outside the photo
    cuts: Integers  # First station of each stretch, and one past the last

    @property
    def away_px(self) -> Floats:
        """Distance of each sample from the line, (m,)."""
        return np.abs(self.offset_px)

    def mean(self, where: Booleans | None = None) -> Floats:
        """Mean light of each stretch at each distance, (stretches, m).

        If ``where`` is given: the mean of each stretch over the samples where it is True, (stretches,).
        """
        weight = np.isfinite(self.light) if where is None else np.isfinite(self.light) & where
        light = np.where(weight, self.light, 0)
        if where is not None:
            light, weight = light.sum(axis=1), weight.sum(axis=1)
        count = np.add.reduceat(weight.astype(float), self.cuts[:-1], axis=0)
        total = np.add.reduceat(light, self.cuts[:-1], axis=0)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def profiles_across(photo: Photo, line_px: Floats, width_px: float, reach_px: float) -> Profiles:
    """Read the light up to ``reach_px`` to either side of a line along a crack that is about ``width_px`` wide."""
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
    """Return the brightness on the path's normals, (stations, samples)."""
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


# Distance read to either side of a dark band: widths, plus px. Minimum by which the band is wider than the crack, px
BAND, BAND_PX = (6.0, 20.0), 6.0
BAND_RATIO = 2.0  # A dark band is too wide from this multiple of the fitted width on. Blur widens a band by less
SIDE_WIDTHS = (1.0, 1.5, 2.0)  # Distances from the line, in crack widths, at which its two sides are compared
# The sides differ if the ratio of their brightness is larger, as at a sample's edge. Grain causes smaller ratios
SIDE_RATIO = 1.8
STEADY = 17  # Number of samples (two crack widths) over which the median ratio is taken, against pores and grains
GROUND = 75  # Percentile of the light across a stretch that is taken for the ground's light


def unlike_length_px(photo: Photo, points_px: Floats, width_px: float) -> float:
    """Return the length of the longest stretch whose two sides differ in brightness by more than ``SIDE_RATIO``."""
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
    """Return the width in px of the dark band around a line, at half of the contrast between band and ground."""
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
