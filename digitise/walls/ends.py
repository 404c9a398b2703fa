"""What a crack does where its path ends: it meets the edge of the face, it ends in a tip, or it goes on."""

from dataclasses import dataclass

import cv2
import numpy as np

from digitise.finding.darkness import EDGE_PX
from digitise.geometry.polyline import depth_inside
from digitise.photo import Photo
from digitise.walls.patch import Patch
from sealtwin.records import EndKind, Floats

LOOK_AHEAD = 2.0
"""Crack widths ahead of the end that are searched: no one clicks an edge of the face exactly."""
GOES_ON = 1.5
"""Crack widths of dark around the end beyond which it is cut from something longer: from a longer crack, where the dark
lies ahead, or from the shadow along the sample's edge, where it lies across.
"""

BLUNT = 0.25
"""Crack widths behind its farthest point within which an end counts as reaching as far: a sharp tip narrows in less."""


@dataclass(frozen=True)
class PathEnd:
    """One end of a crack."""

    kind: EndKind
    place_px: Floats
    """The tip of a closed crack; else where the path ends."""


def judge_end(photo: Photo, patch: Patch, end_px: Floats, ahead: Floats, width_px: float, threshold: float) -> PathEnd:
    """``ahead`` is the unit direction out of the crack in the photo; what is darker than ``threshold`` is crack.

    The edge of the photo cuts a crack like a user does.
    """
    reached_px = np.vstack([end_px, _dark_ahead_px(photo, patch, end_px, ahead, width_px, threshold)])
    if photo.face_mm is not None:
        # The mask stops short of the edge.
        edge_px = np.abs(depth_inside(photo.to_mm(reached_px), photo.face_mm)) / photo.mm_per_px
        if edge_px.min() <= 2 * EDGE_PX:
            return PathEnd("open", end_px)
    away_px = np.linalg.norm(reached_px - end_px, axis=1)
    width, height = photo.size_px
    if away_px.max() > GOES_ON * width_px or depth_inside(reached_px, (0, 0, width - 1, height - 1)).min() <= 1:
        return PathEnd("cut", end_px)
    return PathEnd("closed", _tip_px(reached_px, end_px, ahead, width_px))


def _tip_px(reached_px: Floats, end_px: Floats, ahead: Floats, width_px: float) -> Floats:
    """As far ahead as the dark reaches; sideways in the middle of what reaches as far, or a blunt end's corner wins."""
    away_px = reached_px - end_px
    extent_px = away_px @ ahead
    aside = np.array([-ahead[1], ahead[0]])
    sideways_px = away_px[extent_px > extent_px.max() - BLUNT * width_px] @ aside
    return end_px + extent_px.max() * ahead + (sideways_px.min() + sideways_px.max()) / 2 * aside


def _dark_ahead_px(
    photo: Photo, patch: Patch, end_px: Floats, ahead: Floats, width_px: float, threshold: float
) -> Floats:
    """Pixels of crack around and ahead of the end that hang together with it, (n, 2)."""
    reach_px = LOOK_AHEAD * width_px
    left, top = np.maximum(np.floor(end_px - reach_px) - patch.offset_px, 0).astype(int)
    right, bottom = (np.ceil(end_px + reach_px) - patch.offset_px).astype(int) + 1
    window = np.s_[top:bottom, left:right]
    y, x = np.nonzero(patch.soft[window] < threshold)
    dark_px = np.column_stack([x + left, y + top]) + np.array(patch.offset_px, dtype=float)
    away_px = dark_px - end_px
    # From a little behind the end, so that a bright speck on it does not part the crack from its end.
    kept = (away_px @ ahead > -0.5 * width_px) & (np.linalg.norm(away_px, axis=1) <= reach_px)
    if not kept.any():
        return dark_px[kept]
    kept[kept] = patch.on_sample(dark_px[kept], photo.to_mm(dark_px[kept]))
    x, y, dark_px, away_px = x[kept], y[kept], dark_px[kept], away_px[kept]
    if len(dark_px) == 0:
        return dark_px
    picture = np.zeros(patch.soft[window].shape, dtype=np.uint8)
    picture[y, x] = 1
    label = cv2.connectedComponents(picture, connectivity=8)[1][y, x]
    nearest = int(np.argmin(np.linalg.norm(away_px, axis=1)))
    return dark_px[label == label[nearest]]
