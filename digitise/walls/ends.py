"""Classify the ends of a crack: open at the edge of the face, closed in a tip, or cut if the crack continues."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import maximum_filter1d

from digitise.crack_path.sample_mask import EDGE_PX
from digitise.geometry.polyline import at_arc_length, depth_inside, left_normals
from digitise.photo import Photo
from digitise.walls.straightened import Patch, straighten
from digitise.walls.wall_profile import Walls
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import EndKind

STEP_PX = 1.0  # Spacing of stations at a tip, which rounds off within a few pixels
BESIDE_PX = 3.0  # Reach of a blurred edge beyond a wall
PLAIN = 0.5  # Share of a crack's darkness above that of any grain
NARROWEST_PX, WIDEST_PX = 1.5, 10.0  # Widths used to locate a tip: less is lost in grain, more is not the tip
TIP_SHARE = 0.6  # Largest width of a tip over the crack's width near it
LOOK_AHEAD = 2.0  # Crack widths ahead of the end that are searched for the edge of the face
GOES_ON = 1.5  # Crack widths of dark around an end above which the end is cut: the crack, or a shadow, continues
BLUNT = 0.25  # Crack widths behind the farthest point that are the end's front; a sharp tip narrows in less


def find_tip(photo: Photo, patch: Patch, line_mm: Floats, walls: Walls, near_mm: float, outward: int) -> float:
    """Return the arc length of the tip near ``near_mm`` on a line that runs past it.

    ``outward`` is the direction out of the crack, 1 or -1 along the line. The width at each station is measured by the
    brightness that is missing across the line. At a round tip, the square of the width falls linearly to 0.
    """
    s_mm, px = arc_length(line_mm), photo.mm_per_px
    inner = np.flatnonzero(walls.both_found & (outward * (s_mm - near_mm) <= 0))
    if len(inner) == 0:
        return near_mm
    last = inner[-1] if outward > 0 else inner[0]
    reach_mm = max(float(np.median(walls.width_mm[inner])), 12 * px)
    inner_mm = outward * np.arange(-reach_mm, reach_mm / 2, STEP_PX * px)
    stations_mm = s_mm[last] + inner_mm
    stations_mm = stations_mm[(stations_mm > 0) & (stations_mm < s_mm[-1])]
    fine_mm = at_arc_length(line_mm, s_mm, stations_mm)
    before_last = outward * (stations_mm - s_mm[last]) <= 0
    left_mm, right_mm = (
        np.where(before_last, np.interp(stations_mm, s_mm, wall_mm), wall_mm[last])
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
    rows = np.flatnonzero(mortar.any(axis=1))
    if len(rows) == 0:
        return float(s_mm[last])
    levels = np.nanmedian(np.where(mortar[rows], strip.light[rows], np.nan), axis=1)
    bright = np.interp(np.arange(len(mortar)), rows, levels)[:, None]
    dark = np.interp(stations_mm, s_mm, walls.dark)
    missing = np.where(inside, 1 - (strip.light - dark[:, None]) / np.maximum(bright - dark[:, None], 1e-6), 0)
    # Before a blunt end, dark grain across the whole width would add up to a crack that continues.
    near = maximum_filter1d((missing > PLAIN).astype(np.uint8), 2 * round(BESIDE_PX / strip.sample_px) + 1, axis=1)
    sharp = left_mm + right_mm < WIDEST_PX * px
    width_px = np.where((near > 0) | sharp[:, None], missing, 0).sum(axis=1) * strip.sample_px
    return _vanishing_mm(stations_mm, width_px, float(s_mm[last]), outward, reach_mm)


def _vanishing_mm(stations_mm: Floats, width_px: Floats, last_mm: float, outward: int, reach_mm: float) -> float:
    """Return the arc length at which the square of the width, extrapolated outward from ``last_mm``, is 0."""
    last = int(np.argmin(np.abs(stations_mm - last_mm)))
    widest_px = min(WIDEST_PX, TIP_SHARE * float(np.median(width_px[: last + 1])))
    wide = np.flatnonzero(width_px[: last + 1] > widest_px)
    narrow = np.flatnonzero(width_px[last:] < NARROWEST_PX)
    begin = wide[-1] if len(wide) else 0
    end = last + (narrow[0] if len(narrow) else len(width_px) - last)
    if end - begin < 3:
        return last_mm
    s, square = stations_mm[begin:end], width_px[begin:end] ** 2
    # The error of a square is proportional to its root.
    slope, at_0 = np.polyfit(s - last_mm, square, 1, w=1 / np.maximum(width_px[begin:end], NARROWEST_PX))
    if slope * outward >= 0:
        return last_mm
    return last_mm + float(np.clip(-at_0 / slope, -reach_mm, reach_mm))


@dataclass(frozen=True)
class PathEnd:
    """One end of a crack."""

    kind: EndKind
    place_px: Floats  # The tip of a closed crack, or else the end of the path


def judge_end(photo: Photo, patch: Patch, end_px: Floats, ahead: Floats, width_px: float, threshold: float) -> PathEnd:
    """Classify the end at ``end_px``; ``ahead`` points out of the crack. An end at the photo's edge is cut."""
    reached_px = np.vstack([end_px, _dark_ahead_px(photo, patch, end_px, ahead, width_px, threshold)])
    if photo.face_mm is not None:
        # The mask ends before the edge.
        edge_px = np.abs(depth_inside(photo.to_mm(reached_px), photo.face_mm)) / photo.mm_per_px
        if edge_px.min() <= 2 * EDGE_PX:
            return PathEnd("open", end_px)
    away_px = np.linalg.norm(reached_px - end_px, axis=1)
    width, height = photo.size_px
    if away_px.max() > GOES_ON * width_px or depth_inside(reached_px, (0, 0, width - 1, height - 1)).min() <= 1:
        return PathEnd("cut", end_px)
    return PathEnd("closed", _tip_px(reached_px, end_px, ahead, width_px))


def _tip_px(reached_px: Floats, end_px: Floats, ahead: Floats, width_px: float) -> Floats:
    """Return the farthest dark place ahead, or the middle of a blunt end."""
    away_px = reached_px - end_px
    extent_px = away_px @ ahead
    aside = np.array([-ahead[1], ahead[0]])
    sideways_px = away_px[extent_px > extent_px.max() - BLUNT * width_px] @ aside
    return end_px + extent_px.max() * ahead + (sideways_px.min() + sideways_px.max()) / 2 * aside


def _dark_ahead_px(
    photo: Photo, patch: Patch, end_px: Floats, ahead: Floats, width_px: float, threshold: float
) -> Floats:
    """Return the pixels of crack around and ahead of the end that are connected to it, (n, 2)."""
    reach_px = LOOK_AHEAD * width_px
    left, top = np.maximum(np.floor(end_px - reach_px) - patch.offset_px, 0).astype(int)
    right, bottom = (np.ceil(end_px + reach_px) - patch.offset_px).astype(int) + 1
    window = np.s_[top:bottom, left:right]
    y, x = np.nonzero(patch.soft[window] < threshold)
    dark_px = np.column_stack([x + left, y + top]) + np.array(patch.offset_px, dtype=float)
    away_px = dark_px - end_px
    # A strip behind the end is included, so that a bright speck on the end does not separate it from the crack.
    near = (away_px @ ahead > -0.5 * width_px) & (np.linalg.norm(away_px, axis=1) <= reach_px)
    near[near] = patch.on_sample(dark_px[near], photo.to_mm(dark_px[near]))
    x, y, dark_px, away_px = x[near], y[near], dark_px[near], away_px[near]
    if len(dark_px) == 0:
        return dark_px
    picture = np.zeros(patch.soft[window].shape, dtype=np.uint8)
    picture[y, x] = 1
    label = cv2.connectedComponents(picture, connectivity=8)[1][y, x]
    nearest = int(np.argmin(np.linalg.norm(away_px, axis=1)))
    return dark_px[label == label[nearest]]
