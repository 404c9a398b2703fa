"""The rules by which a line traced on a real photo is right, on another branch, or wrong.

The branch of a photo is the longest skeleton path of its mask's three largest pieces. A traced line is

- right if 80 % of it is within max(5 px, half the mask's width there + 3 px) of the branch, and it covers 80 % of that;
- other if 80 % of it is within 5 px of the mask: another branch, or less of this one;
- wrong otherwise. A trace is silent if there is no caution about its path.

A line that is offered without clicks is a hit if 80 % of it is within 5 px of the mask and it has at least 30 % of the
branch's length.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree
from skimage.measure import label

from benchmarks.real_roads_photos import Mask
from digitise.crack_path.medial_axis import longest_line
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats

PIECES = 3
SHARE = 0.8
NEAR_PX, BESIDE_PX = 5.0, 3.0
MIN_OF_BRANCH = 0.3

Verdict = Literal["right", "other", "wrong", "refused"]


@dataclass(frozen=True)
class Branch:
    """The line that a trace between two clicks should follow."""

    line_px: Floats
    """Pixel centres, x then y."""
    width_px: Floats
    """Width of the mask at each point: twice the distance to its rim less one."""

    @classmethod
    def of(cls, mask: Mask) -> "Branch":
        pieces = np.asarray(label(mask, connectivity=2))
        largest = np.argsort(-np.bincount(pieces.ravel())[1:], kind="stable")[:PIECES] + 1
        lines = [longest_line(pieces == number) for number in largest]
        longest = max(lines, key=lambda cells: _length(cells.astype(float)), default=np.empty((0, 2), dtype=int))
        width_px = 2 * np.asarray(distance_transform_edt(np.pad(mask, 1)))[1:-1, 1:-1] - 1
        return cls(longest[:, ::-1].astype(float), width_px[tuple(longest.T)])

    @property
    def length_px(self) -> float:
        return _length(self.line_px)


def verdict(line_px: Floats, branch: Branch, mask: Mask) -> Verdict:
    dense = _dense(line_px)
    near_px = np.maximum(NEAR_PX, branch.width_px / 2 + BESIDE_PX)
    away_px, nearest = KDTree(branch.line_px).query(dense)
    back_px = KDTree(dense).query(branch.line_px)[0]
    if min(np.mean(away_px <= near_px[nearest]), np.mean(back_px <= near_px)) >= SHARE:
        return "right"
    return "other" if np.mean(_off_mask(dense, mask) <= NEAR_PX) >= SHARE else "wrong"


def is_hit(line_px: Floats, branch: Branch, mask: Mask) -> bool:
    dense = _dense(line_px)
    follows = np.mean(_off_mask(dense, mask) <= NEAR_PX) >= SHARE
    return bool(follows and _length(line_px) >= MIN_OF_BRANCH * branch.length_px)


def _off_mask(points_px: Floats, mask: Mask) -> Floats:
    return KDTree(np.argwhere(mask)[:, ::-1].astype(float)).query(points_px)[0]


def _length(line_px: Floats) -> float:
    return float(arc_length(line_px)[-1]) if len(line_px) > 1 else 0.0


def _dense(points_px: Floats) -> Floats:
    """Return a polyline with a point every half pixel, so that shares of points are shares of length."""
    s = arc_length(points_px)
    stations = np.linspace(0, s[-1], max(2, round(2 * s[-1])))
    return np.column_stack([np.interp(stations, s, column) for column in points_px.T])
