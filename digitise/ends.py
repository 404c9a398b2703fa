"""What a crack does where its path ends: it meets the edge of the face, it ends in a tip, or it goes on."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.photo import Photo
from sealtwin.records import EndKind, Floats

NEAR_EDGE = 2.0
"""Crack widths ahead of the end within which an edge of the face makes it open: no one clicks an edge exactly."""
GOES_ON = 1.5
"""Crack widths of dark ahead of the end beyond which it is cut from a longer crack."""


@dataclass(frozen=True)
class PathEnd:
    """One end of a crack."""

    kind: EndKind
    place_px: Floats
    """The tip of a closed crack; else where the path ends."""


def judge_end(
    photo: Photo,
    blurred: NDArray[np.float32],
    mask: NDArray[np.uint8],
    end_px: Floats,
    ahead: Floats,
    width_px: float,
    threshold: float,
) -> PathEnd:
    """``ahead`` is the unit direction out of the crack in the photo; darker than ``threshold`` is crack.

    ``mask`` is 255 on the sample. The edge of the photo cuts a crack like a user does.
    """
    reach_px = int(np.ceil(NEAR_EDGE * width_px)) + 2
    left, top = np.floor(end_px).astype(int) - reach_px
    window = np.s_[max(top, 0) : top + 2 * reach_px + 1, max(left, 0) : left + 2 * reach_px + 1]
    y, x = np.mgrid[
        window[0].start : window[0].start + blurred[window].shape[0],
        window[1].start : window[1].start + blurred[window].shape[1],
    ]
    away = np.stack([x, y], axis=-1) - end_px
    distance = np.linalg.norm(away, axis=-1)
    # A little behind the end as well, so that one dark speck more or less does not cut the crack's own end off.
    forward = (away @ ahead > -0.5 * width_px) & (distance <= NEAR_EDGE * width_px)
    dark = (blurred[window] < threshold) & (mask[window] == 255) & forward
    _, label = cv2.connectedComponents(dark.astype(np.uint8), connectivity=8)
    near = np.where(label > 0, distance, np.inf)
    nearest = np.unravel_index(int(np.argmin(near)), near.shape)
    if not np.isfinite(near[nearest]) or near[nearest] > width_px:
        return PathEnd("open" if _at_edge(photo, end_px, width_px) else "closed", end_px)
    crack = label == label[nearest]
    if photo.face_px is not None:
        edge = _edge_distance_px(photo, np.column_stack([x[crack], y[crack]]).astype(float))
        if edge.min() <= 6.0:
            return PathEnd("open", end_px)
    extent = np.where(crack, away @ ahead, -np.inf)
    farthest = np.unravel_index(int(np.argmax(extent)), extent.shape)
    width, height = photo.size_px
    at_border = np.any(crack & ((x <= 1) | (y <= 1) | (x >= width - 2) | (y >= height - 2)))
    if at_border or extent[farthest] > GOES_ON * width_px:
        return PathEnd("cut", end_px)
    tip = np.array([x[farthest], y[farthest]], dtype=float)
    return PathEnd("closed", tip if extent[farthest] > 0 else end_px)


def _at_edge(photo: Photo, end_px: Floats, width_px: float) -> bool:
    return photo.face_px is not None and bool(_edge_distance_px(photo, end_px[None])[0] <= width_px)


def _edge_distance_px(photo: Photo, points_px: Floats) -> Floats:
    """Distance of each point from the nearest edge of the face."""
    assert photo.face_px is not None
    ring = photo.face_px.astype(np.float32)
    return np.array([abs(cv2.pointPolygonTest(ring, (float(x), float(y)), True)) for x, y in points_px])
