"""Check measured walls for bands beside them, a darker line between them, narrow stretches, and ends not reached."""

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.spatial import KDTree

from digitise.crack_path.hints import CrackPath, listed, snap_px
from digitise.geometry.polyline import left_normals, places_beside, resampled, smoothed
from digitise.image.raster import Mask, lightness, sampled
from digitise.photo import Photo
from digitise.walls.centreline_and_walls import MAX_MISSING, MIN_WIDTH_PX, TooThinError
from digitise.walls.wall_profile import (
    cheapest_wall,
    cheapest_way,
    median_along,
    outward,
    patch_around,
    steadied,
    straighten,
)
from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import runs
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import SIDES, Floats, Outline, WallStretch
from sealtwin.core.solid_figures import EndKind

# Constants of bands and of a darker line. "widths" are crack widths.
#
# Chosen on 86 drawn roads with seeds under 200. Roads with seeds from 51,000 (benchmarks.tracing_roads) and the sound
# trials (benchmarks.sound_trials), none of which has such a warning, checked them. A lower ``BAND_WIDTHS`` or
# ``WORTH_SAYING``, or levels farther apart, give more false warnings.
EVERY = 2  # Number of stations from one profile to the next
SAMPLE = 0.05  # Spacing of samples of a profile in widths, at least 1 px
REACH = 1.2  # The search extends this many widths beside a wall, plus ``REACH_PX``
REACH_PX = 6.0
MEDIAN_WIDTHS = 0.25  # Length in widths of the median along the crack
CORE = 0.15  # Pixels are surely crack from this fraction of the half width inside a wall, plus ``CORE_PX``
CORE_PX = 0.5
CORE_PERCENTILE = 30.0  # Percentile of the lightness between the walls that is taken for the crack's
GROUND = 0.35  # Pixels are surely ground from this many widths beside a wall, plus ``GROUND_PX``
GROUND_PX = 2.0
STEADY = 3.0  # Length in widths of the medians of the crack's and the ground's lightness
INNER = 0.3  # A band's lightness is between this fraction of the contrast and ``OUTER``
OUTER = 0.7
BAND_WIDTHS = 0.2  # A band is thicker than the crack's usual edge by this many widths, or by ``BAND_PX``
BAND_PX = 3.0
RUN = 0.75  # Minimum length of a band in widths
TIP = 1.0  # Length before an end, in widths, that is left out, because profiles past the end show only ground
MIN_PROFILES = 6  # Minimum number of profiles. A shorter crack has no usual edge
MIN_CONTRAST = 6.0  # Minimum contrast of lightness
WORTH_SAYING = 0.05  # A smaller relative difference between the mean widths with and without bands gives no warning
LISTED = 4  # Largest number of positions in a warning
WIDTH_ERROR = 0.05  # Fraction of the mean width by which the interval extends beyond both widths
# A line between the walls is reported if it is this much darker than the rest, relative to the ground. Cracks have 0.05
DARKER = 0.1
LINE_PX, LINE_ALONG_PX = 3, 15  # Width of the darkest line, and length over which its light is averaged
LINE_STEP = 0.02  # Cost of a step of that line to a side by one px, as a fraction of the ground's light
WIDTH_RATIO = 1.7  # Minimum width between the walls, divided by the width of the darkest line


# Constants of narrow stretches. Chosen on a lab's photo and drawn cracks, checked on the 117 later photos of
# benchmarks/real_roads, where a quarter less or a third more changes nothing (benchmarks.line_constants).
UNKNOWN = 0.75  # A stretch narrower than this times ``MIN_WIDTH_PX`` is a hairline. Blur widens 4 px to 5.4 px
STEADY, LONG = 3.0, 5.0  # Length of a median along the crack, and minimum length of a stretch, in ``MIN_WIDTH_PX``
FITTED = 1.25  # A crack with hairlines is fitted if its width's upper quartile is below this times ``MIN_WIDTH_PX``

BAND = (
    "beside a wall there is a band that is neither as dark as the crack nor as bright as the ground, for example "
    "debris, oil or shade near {} px, so two positions of the wall are plausible. On average the crack is {:.3g} {} "
    "wide without such bands and {:.3g} with them. Check the lines over the photo (overlay.png). Choose "
    "the wall by its number there, photo.wall = 1 or 2, or draw the true wall beside each band in walls_px"
)
BAND_WHY = "the band beside this wall is neither as dark as the crack nor as bright as the ground"


PLAUSIBLE = "walls.plausible"
"""First part of the key of doubts about walls that a wall drawn by hand may settle."""


def with_doubts(outline: Outline, *doubts: Fact, **fields: Any) -> Outline:
    """Return the outline with additional warnings and with new values for some of its fields."""
    return replace(outline, warnings=(*outline.warnings, *doubts), **fields)


def with_bands(photo: Photo, outline: Outline, hidden: Mask) -> Outline:
    """Return the outline with the bands along its walls, a warning, and an interval that covers both plausible widths.

    If the two widths differ little, the outline is returned unchanged. ``hidden`` pixels, such as the mouth of a side
    crack, are not a band.
    """
    px, thin = photo.mm_per_px, slice(None, None, EVERY)
    width_px, s_mm = max(outline.mean_width_mm / px, 4.0), outline.s_mm[thin]
    line_mm, walls_mm = outline.centreline_mm[thin], (outline.left_wall_mm[thin], outline.right_wall_mm[thin])
    if len(line_mm) < MIN_PROFILES:
        return outline
    station_px = s_mm[-1] / (len(s_mm) - 1) / px

    def odd(widths: float) -> int:
        return int(max(3, widths * width_px / station_px)) | 1

    ray = left_normals(smoothed(line_mm, width_px / station_px))
    both_px = ((np.stack(walls_mm) - line_mm) * ray).sum(axis=2) * [[1], [-1]] / px
    reach_px, step_px = float(np.percentile(both_px, 98)) + REACH * width_px + REACH_PX, max(1.0, SAMPLE * width_px)
    patch = patch_around(photo, photo.to_px(line_mm), reach_px)
    strip = straighten(photo, patch, line_mm, ray, step_px * px, reach_px * px)
    even = median_along(lightness(outward(strip, strip.light)), odd(MEDIAN_WIDTHS), axis=1)
    valid, walls_px = outward(strip, strip.valid), both_px[..., None]
    over_px = np.arange(even.shape[2]) * strip.sample_px - walls_px
    core = np.where(valid & (over_px < -CORE_PX - CORE * walls_px), even, np.nan)
    ground = np.where(valid & (over_px > GROUND * width_px + GROUND_PX), even, np.nan)
    dark = steadied(np.hstack(list(core))[None], odd(STEADY), CORE_PERCENTILE)
    contrast = np.maximum(steadied(ground, odd(STEADY)) - dark, MIN_CONTRAST)[..., None]
    share = (even - dark[..., None]) / contrast
    excess = [np.where(valid, np.clip(share - level, -0.5, 0.5), 0) for level in (INNER, OUTER)]
    # Inner and outer edge of the band on each side, (2, sides, stations).
    edges_px = cheapest_wall(np.concatenate(excess), strip.sample_px, station_px).reshape(2, 2, -1)
    edges_px = np.maximum.accumulate(edges_px)
    thick_px = edges_px[1] - edges_px[0]
    # The cleaner side shows the crack's usual edge. A band may be as long as the crack.
    thick_px -= np.median(thick_px, axis=1).min()
    doubtful = median_filter(thick_px, (1, odd(RUN)), mode="nearest") > max(BAND_PX, BAND_WIDTHS * width_px)
    tip = max(1, round(TIP * width_px / station_px))
    doubtful[:, :tip] = doubtful[:, -tip:] = False
    covered = np.array([sampled(hidden, photo.to_px(wall_mm)) > 0 for wall_mm in walls_mm])
    doubtful &= maximum_filter1d(covered.astype(np.uint8), odd(2), axis=1) == 0
    low_mm, high_mm = (
        outline.mean_width_mm + px * float(np.where(doubtful, change_px, 0).sum(axis=0).mean())
        for change_px in (np.minimum(edges_px[0] - both_px, 0), np.maximum(edges_px[1] - both_px, 0))
    )
    if high_mm - low_mm < WORTH_SAYING * width_px * px:
        return outline
    rings_mm, stretches = [], []
    for side, sign, where, edge_px in zip(SIDES, (1, -1), doubtful, edges_px.swapaxes(0, 1), strict=True):
        near_mm, far_mm = line_mm + sign * px * edge_px[..., None] * ray
        for begin, end in runs(where):
            rings_mm.append(np.concatenate([near_mm[begin:end], far_mm[begin:end][::-1]]))
            first_mm, last_mm = np.round(s_mm[[begin, end - 1]], 3).tolist()
            least_mm, most_mm = (px * edge_px[:, begin:end].mean(axis=1)).tolist()
            stretches.append(WallStretch(first_mm, last_mm, side, "edge", (least_mm, most_mm), BAND_WHY))
    least_wide_mm, most_wide_mm = outline.width_95_mm or (outline.mean_width_mm, outline.mean_width_mm)
    sure_mm = WIDTH_ERROR * outline.mean_width_mm
    middle_px = photo.to_px(np.stack([ring_mm.mean(axis=0) for ring_mm in rings_mm[:LISTED]]))
    return with_doubts(
        outline,
        doubt(f"{PLAUSIBLE}.band", BAND.format(listed(middle_px), low_mm, photo.unit, high_mm)),
        bands_mm=tuple(rings_mm),
        width_95_mm=(min(least_wide_mm, low_mm - sure_mm), max(most_wide_mm, high_mm + sure_mm)),
        walls=(*outline.walls, *stretches),
    )


def plausible_walls(outline: Outline) -> tuple[list[Floats], list[Floats]]:
    """Return the walls that leave the bands out of the crack, and the walls that include them, as lines in mm."""
    halves_mm = [np.split(ring_mm, 2) for ring_mm in outline.bands_mm]
    return [near_mm for near_mm, _ in halves_mm], [far_mm for _, far_mm in halves_mm]


def numbered_walls(outline: Outline) -> list[Floats]:
    """Return the longest wall of both kinds in mm. Its number stands at a third of it.

    The two lines run in opposite directions, so that the numbers do not cover each other.
    """
    return [max(walls_mm, key=len) for walls_mm in plausible_walls(outline) if walls_mm]


def darker_line(photo: Photo, path: CrackPath, outline: Outline) -> CrackPath | None:
    """Return the path along a line between the walls that is far darker than the rest, such as a crack in a joint.

    Returns None if there is no such line.
    """
    half_px = outline.mean_width_mm / photo.mm_per_px / 2 - LINE_PX
    if half_px < WIDTH_RATIO * LINE_PX / 2:
        return None
    line_px, reach_px = resampled(outline.centreline_px, 1.0), 2 * half_px + 2 * LINE_PX
    offset_px, normal = np.arange(-reach_px, reach_px + 1), left_normals(smoothed(line_px, 2 * half_px))
    light, inner = sampled(photo.brightness, places_beside(line_px, offset_px, normal)), np.abs(offset_px) < half_px
    soft = np.asarray(cv2.blur(light, (LINE_PX, LINE_ALONG_PX)), float)[:, inner]
    inside = np.median(light[:, inner])
    ground = float(np.median(light[:, np.abs(offset_px) > half_px + 2 * LINE_PX]))
    column = cheapest_way(soft[None] / ground, LINE_STEP * np.arange(-2.0, 3.0) ** 2)[0]
    line = float(np.median(np.take_along_axis(soft, column[:, None], axis=1)))
    width_px = max(float(np.median((soft < (line + inside) / 2).sum(axis=1))), float(LINE_PX))
    if inside - line <= DARKER * (ground - line) or 2 * half_px < WIDTH_RATIO * width_px:
        return None
    return replace(path, points_px=line_px + offset_px[inner][column][:, None] * normal, width_px=width_px)


def judge_stretches(photo: Photo, centreline_mm: Floats, width_mm: Floats) -> list[Fact]:
    """Return a warning about stretches that are too narrow to measure.

    If much of the crack is a hairline, raises TooThinError if the rest is thin enough for a fit, and otherwise
    InputError. A stretch must be ``LONG`` times as long as ``MIN_WIDTH_PX``, so that a tapering tip does not count.
    """
    s_mm, width_px = arc_length(centreline_mm), width_mm / photo.mm_per_px
    least_mm, per_station_mm = MIN_WIDTH_PX * photo.mm_per_px, s_mm[-1] / (len(s_mm) - 1)
    steady_px = median_filter(width_px, size=1 + 2 * int(STEADY * least_mm / per_station_mm / 2), mode="nearest")
    for limit_px, most in ((UNKNOWN * MIN_WIDTH_PX, MAX_MISSING), (MIN_WIDTH_PX, WORTH_SAYING)):
        bounds = runs(steady_px < limit_px) - (0, 1)
        bounds = bounds[np.diff(s_mm[bounds], axis=1)[:, 0] > LONG * least_mm]
        share = float(np.diff(s_mm[bounds], axis=1).sum() / s_mm[-1])
        places = "; ".join(
            f"{s_mm[first]:.0f} to {s_mm[last]:.0f} {photo.unit} along the crack, from "
            f"{listed(photo.to_px(centreline_mm[[first, last]]))} px, about "
            f"{np.median(width_px[first : last + 1]):.1f} px wide"
            for first, last in bounds
        )
        fault = (
            f"{share:.0%} of the crack is under {limit_px:g} px wide, so its width and volume are uncertain: {places}"
        )
        if share > most == MAX_MISSING:
            refusal = TooThinError if np.percentile(width_px, 75) < FITTED * MIN_WIDTH_PX else InputError
            raise refusal(f"{photo.file}: {fault}. Give ends_px of only the wide part, or move the camera closer.")
        if share > most:
            return [doubt("walls.narrow-stretches", f"{fault}. Take a closer photo to measure it", share)]
    return []


def judge_reach(photo: Photo, path_px: Floats, centreline_px: Floats, kinds: tuple[EndKind, EndKind]) -> list[Fact]:
    """Return a warning for each end of the path before which the crack closes.

    Raises InputError if much of the path is lost.
    """
    s_px, warnings = arc_length(path_px), []
    first, last = np.asarray(KDTree(path_px).query(centreline_px[[0, -1]])[1])
    for end, lost_px in ((0, float(s_px[first])), (-1, float(s_px[-1] - s_px[last]))):
        if kinds[end] != "closed" or lost_px <= snap_px(photo):
            continue
        fault = (
            f"the end {listed(path_px[[end]])} px is not reached: the walls end {photo.length(lost_px)} before it, at "
            f"{listed(centreline_px[[end]])} px"
        )
        if lost_px > MAX_MISSING * s_px[-1]:
            raise InputError(
                f"{photo.file}: {fault}. This is {lost_px / s_px[-1]:.0%} of the path (at most {MAX_MISSING:.0%} is "
                "allowed). Give the point where the walls end as the end, or a photo that shows the crack more clearly."
            )
        warnings.append(doubt("walls.end-not-reached", f"{fault}. That part of the path is left out", lost_px, "px"))
    return warnings
