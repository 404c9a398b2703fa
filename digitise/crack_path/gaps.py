"""Find the stretches of a path that are as bright as the ground, and refuse those that the ground beside them equals.

The ground beside a stretch is measured as the path was found: by the cheapest ways between its two ends, moved aside.
On 127 real photos the stretches of right paths cost at most 0.91 of the median of these ways. On paths that cross plain
ground they cost 0.73 to 1.5 of it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from digitise.crack_path import step_costs
from digitise.crack_path.darkness import DarkMap
from digitise.crack_path.hints import listed, snap_px
from digitise.geometry.polyline import unit
from digitise.image.raster import Map
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers

PALE = 0.28  # Largest mean darkness of a gap over the path's usual one: cracks have 0.31 and more
PALE_CELLS = 24.0  # Least length of a gap over which that mean is taken
GAP_WIDTHS, GAP_CELLS = 4.0, 10.0  # Longest gap that is a grain: at most 3.6 widths on 55 cracks, and least cells
ASIDE = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)  # Steps by which a gap's ends are moved aside, to the left and right
STEP_CELLS, STEP_SHARE = 8.0, 0.35  # Least such step, and as a share of the gap's length
ROOM_CELLS, ROOM_SHARE = 4, 0.25  # Room around the moved ends for a way, likewise
LEAST_WAYS = 4  # Fewer ways beside a gap show no ground
AS_GROUND = 1.0  # Least cost of a gap over the median of these ways for a refusal


@dataclass(frozen=True)
class Bridge:
    """A stretch of a path without a crack."""

    first: int
    last: int
    ends_px: Floats  # (2, 2)
    length_px: float

    def __str__(self) -> str:
        return f"{self.length_px:.0f} px from {listed(self.ends_px)} px"

    def pointed_at(self, clicks_px: Floats, limit_px: float) -> bool:
        """Return True if a click is near each end of the gap: what is clicked is crack."""
        apart_px = np.linalg.norm(self.ends_px[:, None] - clicks_px, axis=2)
        return bool((apart_px.min(axis=1) <= limit_px).all())


def bare(dark: Map, width: float) -> NDArray[np.bool_]:
    """Return True for each place of a path that is in a stretch as bright as the ground.

    ``dark`` is the path's darkness, ``width`` its width in cells. The line filter does not show such a gap, because it
    is longer than it is wide and responds between two lines too.
    """
    usual = float(np.median(dark))
    length = round(max(PALE_CELLS, GAP_WIDTHS * width))
    if len(dark) < 2 * length:
        return np.zeros(len(dark), dtype=bool)
    pale = uniform_filter1d(dark, length, mode="nearest") < PALE * usual
    near = maximum_filter1d(pale.astype(np.uint8), length) > 0
    return near & (dark < usual / 2)


def find_gaps(points_px: Floats, inside: NDArray[np.bool_], width_px: float, scale: float) -> list[Bridge]:
    """Return the stretches outside the crack that are several widths long."""
    s_px = np.append(arc_length(points_px), np.inf)
    bounds = np.flatnonzero(np.diff(np.concatenate([[0], ~inside, [0]]))).reshape(-1, 2)
    least_px = max(GAP_WIDTHS * width_px, GAP_CELLS / scale)
    gaps = [
        Bridge(first, last - 1, points_px[[first, last - 1]], float(s_px[last - 1] - s_px[first]))
        for first, last in bounds.tolist()
    ]
    return [gap for gap in gaps if np.isfinite(gap.length_px) and gap.length_px > least_px]


def doubt_gaps(photo: Photo, field: DarkMap, cells: Integers, gaps: list[Bridge], clicks_px: Floats) -> list[str]:
    """Return a warning about the gaps of a path along ``cells``.

    Raises InputError if one does not stand out from the ground beside it, unless a click is near each of its ends.
    """
    if not gaps:
        return []
    cost = step_costs.cost_of_thin(field, cells)
    cost = np.where(np.isfinite(cost), cost, 1 / step_costs.NOTHING)
    for gap in gaps:
        if not gap.pointed_at(clicks_px, snap_px(photo)) and _as_ground(field, cost, cells[gap.first : gap.last + 1]):
            raise InputError(
                f"{photo.file}: the path crosses plain ground: {gap} do not stand out from the ground beside them. "
                "Give a point of the crack between the ends in photo.via_px. If the crack runs there, give both of "
                "these places."
            )
    return [
        f"part of the path shows no crack and may cross plain ground to another line or joint: "
        f"{'; '.join(map(str, gaps))}. Look there, and give a point of the crack between the ends in photo.via_px"
    ]


def _as_ground(field: DarkMap, cost: Floats, cells: Integers) -> bool:
    """Return True if the way along ``cells`` costs as much as ways between their ends that are moved aside."""
    first, last = cells[0], cells[-1]
    ahead = unit((last - first).astype(float))
    step = max(STEP_CELLS, STEP_SHARE * len(cells))
    room, costs = max(ROOM_CELLS, round(ROOM_SHARE * len(cells))), []
    limits = np.array(cost.shape)
    for aside in (sign * step * steps for steps in ASIDE for sign in (1, -1)):
        ends = np.array([first, last]) + np.rint(aside * np.array([-ahead[1], ahead[0]])).astype(int)
        if (ends >= 0).all() and (ends < limits).all() and field.allowed[tuple(ends.T)].all():
            costs.append(_cost_along(cost, step_costs.cheapest(cost, ends[0], ends[1], room)))
    return len(costs) >= LEAST_WAYS and _cost_along(cost, cells) >= AS_GROUND * float(np.median(costs))


def _cost_along(cost: Floats, cells: Integers) -> float:
    own, steps = cost[tuple(cells.T)], np.linalg.norm(np.diff(cells, axis=0), axis=1)
    return float((own[1:] + own[:-1]) @ steps / 2)
