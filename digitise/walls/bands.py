"""Find bands along a crack's walls that are neither as dark as it nor as bright as the ground: debris, stains, shade.

Where there is one, two walls are plausible: one at each side of the band. A photo alone does not decide between them.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from digitise.crack_path.hints import listed
from digitise.geometry.polyline import left_normals, smoothed
from digitise.image.raster import lightness
from digitise.photo import Photo
from digitise.walls.side_cracks import SideCracks
from digitise.walls.straightened import patch_around, straighten
from digitise.walls.strokes import Strokes
from digitise.walls.wall_profile import follow, outward, steadied
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline
from sealtwin.core.solid_figures import Span

# Constants of bands. "widths" are crack widths.
#
# Chosen on 86 drawn roads: a lower ``LEAST`` or ``WORTH_SAYING``, or levels farther apart, warns of more plain roads.
SPACING_PX = 5.0  # From one profile to the next, or ``SPACING`` widths if that is more
SPACING = 0.2
SAMPLE = 0.05  # Widths from one sample of a profile to the next, at least 1 px
REACH = 1.2  # Widths beside a wall, plus ``REACH_PX``, that are searched
REACH_PX = 6.0
GROUND = 0.35  # Widths beside a wall, plus ``GROUND_PX``, from which on is ground
GROUND_PX = 2.0
CORE_PERCENTILE = 30.0  # Of the lightness between the walls: the crack's own
STEADY = 3.0  # Widths along which both levels are medians
ALONG = 0.25  # Widths of the median along the crack
INNER = 0.3  # Shares of the contrast in lightness that both sides of a band have
OUTER = 0.7
LEAST = 0.2  # Widths, or ``LEAST_PX``, by which a band is thicker than the crack's usual edge
LEAST_PX = 3.0
RUN = 0.75  # Least length of a band in widths
TIP = 1.0  # Widths before an end that are left out: past it profiles show ground all across
LEAST_PROFILES = 6  # A shorter crack has no usual edge
LEAST_CONTRAST = 6.0  # Of lightness
WORTH_SAYING = 0.05  # Difference between both mean widths, over the width, from which on a warning says so
SURE = 0.05  # Half of the interval of the mean width over it, beyond both widths
LISTED = 4  # Places in a warning; the rest is counted


class Bands(NamedTuple):
    """Bands along a crack."""

    rings_mm: tuple[Floats, ...]
    width_95_mm: Span
    """Interval of the mean width that covers both, without and with the bands."""
    warning: str


class _Band(NamedTuple):
    ring_mm: Floats
    begin_mm: float
    end_mm: float
    narrow_mm: float
    wide_mm: float


def find_bands(photo: Photo, outline: Outline, strokes: Strokes, sides: SideCracks) -> Bands | None:
    """Return the bands along an outline's walls; None if they matter little. A stroke decides those beside it.

    The mouth of a side crack is no band.
    """
    mm_per_px, width_px = photo.mm_per_px, max(outline.mean_width_mm / photo.mm_per_px, 4.0)
    own_px = outline.length_mm / mm_per_px / (len(outline.centreline_mm) - 1)
    thin = slice(None, None, max(1, round(max(SPACING_PX, SPACING * width_px) / own_px)))
    line_mm, left_mm, right_mm = (
        each[thin] for each in (outline.centreline_mm, outline.left_wall_mm, outline.right_wall_mm)
    )
    s_mm = arc_length(line_mm)
    if len(line_mm) < LEAST_PROFILES:
        return None
    station_px = float(s_mm[-1]) / (len(s_mm) - 1) / mm_per_px
    run = int(max(3, RUN * width_px / station_px)) | 1
    ray = left_normals(smoothed(line_mm, width_px / station_px))
    walls_px = np.stack([((left_mm - line_mm) * ray).sum(axis=1), ((line_mm - right_mm) * ray).sum(axis=1)]) / mm_per_px
    inner_px, outer_px = _sides_px(photo, line_mm, ray, walls_px, width_px, station_px)
    thick_px = outer_px - inner_px
    thick_px -= np.median(thick_px, axis=1, keepdims=True)
    thick_px = median_filter(thick_px, (1, run), mode="nearest")
    doubtful = thick_px > max(LEAST_PX, LEAST * width_px)
    tip = max(1, round(TIP * width_px / station_px))
    doubtful[:, :tip] = doubtful[:, -tip:] = False
    doubtful &= ~strokes.beside(photo.to_px(line_mm), 2 * width_px) & ~sides.opens_beside(photo.to_px(line_mm))
    low_px = float(np.where(doubtful, np.minimum(inner_px - walls_px, 0), 0).sum(axis=0).mean())
    high_px = float(np.where(doubtful, np.maximum(outer_px - walls_px, 0), 0).sum(axis=0).mean())
    if high_px - low_px < WORTH_SAYING * width_px:
        return None
    bands = list[_Band]()
    for side, sign in enumerate((1, -1)):
        bounds = np.flatnonzero(np.diff(np.concatenate([[0], doubtful[side].astype(int), [0]]))).reshape(-1, 2)
        for begin, end in bounds:
            along, other_px = slice(begin, end), walls_px[1 - side, begin:end]
            near_mm, far_mm = (
                line_mm[along] + (sign * mm_per_px * each[side, along])[:, None] * ray[along]
                for each in (inner_px, outer_px)
            )
            narrow_mm, wide_mm = (
                float(np.mean(each[side, along] + other_px)) * mm_per_px for each in (inner_px, outer_px)
            )
            ring_mm = np.concatenate([near_mm, far_mm[::-1]])
            bands.append(_Band(ring_mm, float(s_mm[begin]), float(s_mm[end - 1]), narrow_mm, wide_mm))
    bands.sort(key=lambda band: band.begin_mm)
    both_mm = outline.mean_width_mm + low_px * mm_per_px, outline.mean_width_mm + high_px * mm_per_px
    return Bands(
        tuple(band.ring_mm for band in bands), _interval_mm(outline, both_mm), _sentence(photo, bands, both_mm)
    )


def _sides_px(
    photo: Photo, line_mm: Floats, ray: Floats, walls_px: Floats, width_px: float, station_px: float
) -> tuple[Floats, Floats]:
    """Return the distances from the line at which crack ends and at which ground begins, (2, stations) each."""
    mm_per_px = photo.mm_per_px
    reach_px = float(np.percentile(walls_px, 98)) + REACH * width_px + REACH_PX
    patch = patch_around(photo, photo.to_px(line_mm), reach_px)
    step_mm = max(1.0, SAMPLE * width_px) * mm_per_px
    strip = straighten(photo, patch, line_mm, ray, step_mm, reach_px * mm_per_px)
    light, valid = outward(strip, strip.light), outward(strip, strip.valid)
    even = median_filter(lightness(light), (1, int(max(3, ALONG * width_px / station_px)) | 1, 1), mode="nearest")
    over_px = np.arange(light.shape[2]) * strip.sample_px - walls_px[..., None]
    inside, outside = valid & (over_px < -0.5 - 0.15 * walls_px[..., None]), valid.copy()
    outside &= over_px > GROUND * width_px + GROUND_PX
    steady = int(max(3, STEADY * width_px / station_px)) | 1
    core, half = (partial(np.nanpercentile, q=share) for share in (CORE_PERCENTILE, 50))
    dark = steadied(np.concatenate(list(np.where(inside, even, np.nan)), axis=1)[None], steady, core)[0]
    bright = steadied(np.where(outside, even, np.nan), steady, half)
    share = (even - dark[:, None]) / np.maximum(bright - dark, LEAST_CONTRAST)[..., None]
    excess = [np.where(valid, np.clip(share - level, -0.5, 0.5), 0) for level in (INNER, OUTER)]
    inner_px, outer_px = np.split(follow(np.concatenate(excess), strip.sample_px, station_px), 2)
    return inner_px, np.maximum(inner_px, outer_px)


def _interval_mm(outline: Outline, both_mm: Span) -> Span:
    """Return the interval that covers both mean widths and the outline's own."""
    own_mm = outline.width_95_mm or (outline.mean_width_mm, outline.mean_width_mm)
    sure_mm = SURE * outline.mean_width_mm
    return min(own_mm[0], both_mm[0] - sure_mm), max(own_mm[1], both_mm[1] + sure_mm)


def _sentence(photo: Photo, bands: list[_Band], both_mm: Span) -> str:
    """Return the warning, with both widths at each place."""
    thickest = sorted(bands, key=lambda band: band.narrow_mm - band.wide_mm)[:LISTED]
    middles_px = [photo.to_px(band.ring_mm.mean(axis=0)[None]) for band in thickest]
    places = [
        f"at s = {band.begin_mm:.0f} to {band.end_mm:.0f} mm, near {listed(middle_px)} px, {band.narrow_mm:.3g} mm "
        f"wide without it and {band.wide_mm:.3g} mm with it"
        for band, middle_px in zip(thickest, middles_px, strict=True)
    ]
    if len(bands) > len(places):
        places.append(f"{len(bands) - len(places)} more")
    return (
        "beside a wall a band is neither as dark as the crack nor as bright as the ground, as of debris, oil or shade, "
        f"so that two walls are plausible: the crack is {'; '.join(places)}. On the whole it is {both_mm[0]:.3g} to "
        f"{both_mm[1]:.3g} mm wide. Look at overlay.png; if a band is crack, draw over it in crack_strokes_px, and if "
        "it is ground, in ground_strokes_px"
    )
