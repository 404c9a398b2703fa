"""Doubt lines that are as straight as a joint, and find a path that avoids joints.

A joint is straight over much of the photo, as no crack is.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree
from skimage.morphology import skeletonize

from digitise.crack_path.crack_map import SHORT_JOINT, beside_straight, likely_cells, straight_lines
from digitise.crack_path.darkness import DarkMap, inner
from digitise.crack_path.hints import listed
from digitise.image.raster import Map
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats

CORNER_DEG, BEYOND_CELLS = 25.0, 12.0  # Least turn into a joint, measured that far from it: a crack goes on ahead
STRAIGHT_CELLS = 1.5  # Largest distance of a straight stretch from its chord
LEAST_CELLS, LEAST_SHARE = 24.0, 0.15  # Least length of a straight stretch: cells, and share of the path
ON_JOINT_CELLS = 4.0  # Distance from the middle of a joint within which a path runs along it: joints have width


@dataclass(frozen=True)
class AlongJoint:
    """The longest stretch of a path along a joint, and all joints of its map."""

    stretch_px: Floats
    """First and last point, (2, 2)."""
    length_px: float
    joints: tuple[Floats, ...]
    """Ends of each joint on the map, (2, 2)."""

    @property
    def doubt(self) -> str:
        return (
            f"{self.length_px:.0f} px of the path, from {listed(self.stretch_px)} px, run along a line as straight as "
            "a joint. If the crack is elsewhere, give points of it between the ends in photo.via_px"
        )

    @property
    def avoided(self) -> str:
        """A notice about a path that avoids all joints instead."""
        return (
            f"the darkest way between the points runs along a line as straight as a joint, from "
            f"{listed(self.stretch_px)} px. The path avoids such lines: if the crack runs along this one, give points "
            "of it in photo.via_px"
        )

    def is_left_by(self, points_px: Floats, width_px: float) -> bool:
        """Return True if another path leaves the joint by a crack width. The rims of a wide crack are no other way."""
        places_px = np.linspace(self.stretch_px[0], self.stretch_px[1], max(2, round(self.length_px)))
        return float(np.median(KDTree(points_px).query(places_px)[0])) > width_px

    def without_joints(self, field: DarkMap) -> DarkMap:
        """Return the map with all its joints as bright as the ground. A path may cross them, at the price of a gap."""
        joints = beside_straight(field.dark.shape, self.joints, 2 * ON_JOINT_CELLS)
        return replace(field, dark=np.where(joints, 0, field.dark), ridge=np.where(joints, 0, field.ridge))


def along_joint(field: DarkMap, points_px: Floats, support: Callable[[], Map]) -> AlongJoint | None:
    """Return where a path runs along a joint; None if it does not.

    Joints are searched for only if the path turns into or out of a straight stretch: ``support`` is slow.
    """
    cells = field.to_work(points_px)
    s = arc_length(cells)
    least = max(LEAST_CELLS, LEAST_SHARE * float(s[-1]))
    first, last = _longest_straight(cells, s)
    if s[last] - s[first] < least or not _turns(cells, s, first, last):
        return None
    clear = np.where(inner(field.allowed), support(), np.float32(0))
    joints, places = straight_lines(skeletonize(likely_cells(clear)), SHORT_JOINT), []
    for start, end in joints:
        ahead = (end - start) / np.linalg.norm(end - start)
        aside = np.abs((cells - start) @ np.array([-ahead[1], ahead[0]])) <= ON_JOINT_CELLS
        bounds = np.flatnonzero(np.diff(np.concatenate([[0], aside.astype(int), [0]]))).reshape(-1, 2)
        along = ((first, last - 1) for first, last in bounds.tolist())
        places += [
            (first, last) for first, last in along if s[last] - s[first] >= least and _turns(cells, s, first, last)
        ]
    if not places:
        return None
    first, last = max(places, key=lambda place: s[place[1]] - s[place[0]])
    return AlongJoint(points_px[[first, last]], float(s[last] - s[first]) / field.scale, tuple(joints))


def straight_share(cells: Floats) -> float:
    """Return the share of a line, (n, 2) in cells, that its longest straight stretch takes."""
    s = arc_length(cells)
    first, last = _longest_straight(cells, s)
    return float(s[last] - s[first]) / max(float(s[-1]), 1.0)


def _turns(cells: Floats, s: Floats, first: int, last: int) -> bool:
    """Return True if a path turns into or out of its stretch from point ``first`` to ``last``."""
    for end, other, sign in ((first, last, -1), (last, first, 1)):
        beyond = min(int(np.searchsorted(s, s[end] + sign * BEYOND_CELLS)), len(s) - 1)
        if abs(float(s[beyond] - s[end])) < BEYOND_CELLS / 2:
            continue  # The path ends there
        onward, along = cells[beyond] - cells[end], cells[end] - cells[other]
        if onward @ along < np.cos(np.radians(CORNER_DEG)) * np.linalg.norm(onward) * np.linalg.norm(along):
            return True
    return False


def _longest_straight(cells: Floats, s: Floats) -> tuple[int, int]:
    """Return the first and the last point of the longest stretch that stays near its chord."""
    longest, end = (0, 0), 0
    for start in range(0, len(cells) - 1, 2):
        end = max(end, start + 1)
        while end < len(cells) and _strays(cells[start : end + 1]) <= STRAIGHT_CELLS:
            end += 1
        longest = max(longest, (start, end - 1), key=lambda stretch: s[stretch[1]] - s[stretch[0]])
    return longest


def _strays(cells: Floats) -> float:
    """Return the largest distance of points from the chord of the first and the last."""
    chord = cells[-1] - cells[0]
    across = np.array([-chord[1], chord[0]])
    return float(np.abs((cells - cells[0]) @ across).max()) / max(float(np.linalg.norm(chord)), 1.0)
