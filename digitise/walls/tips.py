"""Where a closed crack ends: it narrows until nothing dark is left."""

import numpy as np

from digitise.geometry.polyline import at_arc_length, left_normals
from digitise.photo import Photo
from digitise.walls.patch import Patch
from digitise.walls.strip import straighten
from digitise.walls.walls import Walls
from sealtwin.records import Floats, arc_length

STEP_PX = 1.0
"""Between stations at a tip, which rounds off within a few pixels."""
BESIDE_PX = 3.0
"""A blurred edge spreads so far beyond a wall."""
NARROWEST_PX, WIDEST_PX = 1.5, 10.0
"""Widths from which the tip is extrapolated: narrower is lost in the grain, wider is no longer the tip."""
TIP_SHARE = 0.6
"""Of the width beside a tip, up to which it narrows as a tip does."""


def find_tip(photo: Photo, patch: Patch, line_mm: Floats, walls: Walls, near_mm: float, outward: int) -> float:
    """Arc length of the tip on a line that runs on beyond it, near ``near_mm``; ``outward`` is 1 or -1 along the line.

    What is missing from the brightness of plain mortar, summed across, is the width times the crack's own darkness,
    however blurred. Its square falls evenly towards a round tip, and reaches 0 there; a wedge ends where it is a pixel
    wide.
    """
    s_mm, px = arc_length(line_mm), photo.mm_per_px
    seen = np.flatnonzero(walls.both_seen & (outward * (s_mm - near_mm) <= 0))
    if len(seen) == 0:
        return near_mm
    last = seen[-1] if outward > 0 else seen[0]
    reach_mm = max(float(np.median(walls.width_mm[seen])), 12 * px)
    inner_mm = outward * np.arange(-reach_mm, reach_mm / 2, STEP_PX * px)
    stations_mm = s_mm[last] + inner_mm
    stations_mm = stations_mm[(stations_mm > 0) & (stations_mm < s_mm[-1])]
    fine_mm = at_arc_length(line_mm, s_mm, stations_mm)
    known = outward * (stations_mm - s_mm[last]) <= 0
    left_mm, right_mm = (
        np.where(known, np.interp(stations_mm, s_mm, wall_mm), wall_mm[last])
        for wall_mm in (walls.left_mm, walls.right_mm)
    )
    normal = left_normals(fine_mm) * outward
    strip = straighten(photo, patch, fine_mm, normal, 0.5 * px, np.max([left_mm, right_mm]) + 4 * BESIDE_PX * px)
    low_mm, high_mm = (-right_mm, left_mm) if outward > 0 else (-left_mm, right_mm)
    low_mm, high_mm = low_mm[:, None] - BESIDE_PX * px, high_mm[:, None] + BESIDE_PX * px
    inside = (strip.offset_mm >= low_mm) & (strip.offset_mm <= high_mm)
    around_mm = 2 * BESIDE_PX * px
    beside = ~inside & (strip.offset_mm >= low_mm - around_mm) & (strip.offset_mm <= high_mm + around_mm)
    mortar = beside & strip.valid
    known = np.flatnonzero(mortar.any(axis=1))
    if len(known) == 0:
        return float(s_mm[last])
    levels = np.nanmedian(np.where(mortar[known], strip.light[known], np.nan), axis=1)
    bright = np.interp(np.arange(len(mortar)), known, levels)[:, None]
    dark = np.interp(stations_mm, s_mm, walls.dark)
    missing = np.where(inside, 1 - (strip.light - dark[:, None]) / np.maximum(bright - dark[:, None], 1e-6), 0)
    width_px = missing.sum(axis=1) * strip.sample_px
    return _vanishing_mm(stations_mm, width_px, float(s_mm[last]), outward, reach_mm)


def _vanishing_mm(stations_mm: Floats, width_px: Floats, last_mm: float, outward: int, reach_mm: float) -> float:
    """Where the square of the width, extrapolated outward from about ``last_mm``, is 0."""
    last = int(np.argmin(np.abs(stations_mm - last_mm)))
    widest_px = min(WIDEST_PX, TIP_SHARE * float(np.median(width_px[: last + 1])))
    wide = np.flatnonzero(width_px[: last + 1] > widest_px)
    narrow = np.flatnonzero(width_px[last:] < NARROWEST_PX)
    begin = wide[-1] if len(wide) else 0
    end = last + (narrow[0] if len(narrow) else len(width_px) - last)
    if end - begin < 3:
        return last_mm
    s, square = stations_mm[begin:end], width_px[begin:end] ** 2
    # The error of a square grows with its root.
    slope, at_0 = np.polyfit(s - last_mm, square, 1, w=1 / np.maximum(width_px[begin:end], NARROWEST_PX))
    if slope * outward >= 0:
        return last_mm
    return last_mm + float(np.clip(-at_0 / slope, -reach_mm, reach_mm))
