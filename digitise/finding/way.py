"""One question to a search map: the way along the crack, past the points that were clicked on it."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from digitise.finding.costs import cheapest, cost_of_thin, cost_of_wide, cost_off_centre, measure
from digitise.finding.crack_path import CrackPath
from digitise.finding.darkness import DarkMap
from digitise.finding.hints import SNAP_PX
from digitise.finding.path_width import width_along
from digitise.finding.pieces import larger_pieces
from digitise.photo import Photo
from digitise.pictures.raster import Map
from sealtwin.errors import InputError
from sealtwin.records import Floats, Integers, arc_length

THIN_PX = 6.0
"""On the search map: thinner cracks are told by their shape as lines, wider ones by their darkness."""
SURE_RIDGE = 3.5
"""In noise units, half of the way. Of the best ways over drawn pictures of plain ground, 1 of 180 had so much; of those
along cracks, 95 of 111.
"""
LEAST_SUPPORT = 1.6
"""In standard deviations of plain ground, half of the way: all of those 111 had it, and 3 of the 180."""
CLEAR_RIDGE = 3.0
"""In noise units, of a place: it is on a crack even where grain of its darkness lies beside it."""
MOST_GAPS = 0.2
"""Share of the path that may be as bright as mortar."""
AROUND, LEAST_AROUND_PX = 0.5, 100.0
"""A path may leave the box of two points by this share of their distance, and by so many pixels of the photo."""
BESIDE = 1.5
"""Cells: two ways this close are the same way."""


@dataclass(frozen=True)
class Way:
    """First end, via points and last end, and the map to find them a way on."""

    photo: Photo
    field: DarkMap
    points_px: Floats
    support: Callable[[], Map]
    """How line-like the best way through each cell of the map is: asked for in doubt, for it takes a while."""

    def found(self) -> CrackPath:
        """The way, from the first place in the crack to the last. Raises InputError where there is none."""
        field = self.field
        stops = self._on_map(self.points_px)
        # The cost of wide cracks finds any path well enough to tell how wide the crack is.
        legs = self._legs(cost_of_wide(field), stops)
        rough = np.concatenate(legs)
        darkness, width = measure(field, rough)
        thin = width < THIN_PX
        cost = cost_of_thin(field, rough) if thin else cost_off_centre(field, rough, darkness)
        if thin:
            legs = self._legs(cost, stops)
            darkness, width = measure(field, np.concatenate(legs))
        self._check_clear(np.concatenate(legs))
        # A path through a thin crack may run a cell beside it.
        crack = cv2.dilate(field.dark, np.ones((3, 3), np.uint8)) > darkness / 2
        if thin:
            crack |= field.ridge > CLEAR_RIDGE
        limit_px = max(SNAP_PX, width / field.scale)
        if not thin or len(stops) > 2:
            stops[1:-1] = self._snapped(stops[1:-1], cost, crack, limit_px)
            legs = self._legs(cost, stops)
            darkness, width = measure(field, np.concatenate(legs))
        cells = self._without_spurs(legs, limit_px)
        points_px = field.to_photo(cells[:, ::-1])
        on_crack = self._from_crack_to_crack(points_px, crack[tuple(cells.T)], limit_px)
        width_px = width_along(self.photo, points_px[on_crack], width / field.scale)
        return CrackPath(points_px[on_crack], width_px, "ends")

    def _legs(self, cost: Floats, stops: Integers) -> list[Integers]:
        return [
            cheapest(cost, start, end, leg_margin(float(np.linalg.norm(end - start)), self.field.scale))
            for start, end in pairwise(stops)
        ]

    def _on_map(self, points_px: Floats) -> Integers:
        """Row and column of each point, moved to the nearest place that may be searched."""
        allowed = np.argwhere(self.field.allowed)
        if len(allowed) == 0:
            raise InputError(
                f"{self.photo.file}: nothing of the sample lies around the ends; check ends_px and roi_px."
            )
        cells = np.rint(self.field.to_work(points_px)[:, ::-1]).astype(int)
        limits = np.array(self.field.dark.shape) - 1
        searched = np.clip(cells, 0, limits)
        for index in np.flatnonzero(~self.field.allowed[tuple(searched.T)]):
            searched[index] = allowed[np.argmin(np.sum((allowed - cells[index]) ** 2, axis=1))]
        moved_px = np.linalg.norm(searched - cells, axis=1) / self.field.scale
        if moved_px.max() > SNAP_PX:
            (x, y), outside_px = points_px[moved_px.argmax()], moved_px.max()
            raise InputError(
                f"{self.photo.file}: the point ({x:g}, {y:g}) lies {outside_px:.0f} px outside what is searched, which "
                "is the face, less its markers, inside roi_px; check ends_px, via_px and roi_px."
            )
        return searched

    def _check_clear(self, cells: Integers) -> None:
        along = tuple(cells.T)
        if np.median(self.field.ridge[along]) >= SURE_RIDGE:
            return
        clearness = float(np.median(self.support()[along]))
        if clearness < LEAST_SUPPORT:
            found = (
                f"stands out from plain ground by {clearness:.1f} of its spread (a crack by at least {LEAST_SUPPORT:g})"
                if clearness > 0
                else "is no darker line than plain ground has anywhere"
            )
            raise InputError(
                f"{self.photo.file}: no crack between the ends: the best way there {found}; check ends_px."
            )

    def _snapped(self, stops: Integers, cost: Floats, crack: NDArray[np.bool_], limit_px: float) -> Integers:
        """Each via point moved to the cheapest place of the crack near it."""
        rows, columns = np.nonzero(crack & self.field.allowed)
        moved = []
        for stop, (x, y) in zip(stops, self.points_px[1:-1], strict=True):
            away_px = np.hypot(rows - stop[0], columns - stop[1]) / self.field.scale
            near = np.flatnonzero(away_px <= limit_px)
            if len(near) == 0:
                nearest = (
                    f": the nearest one is {away_px.min():.0f} px away (at most {limit_px:.0f})" if len(rows) else ""
                )
                raise InputError(
                    f"{self.photo.file}: the via point ({x:g}, {y:g}) is on no crack{nearest}; give a point inside it."
                )
            # Dearer with distance, so that a crack clicked upon is not left for a darker neighbour.
            price = cost[rows[near], columns[near]] * (1 + (2 * away_px[near] / limit_px) ** 2)
            moved.append((rows[near][np.argmin(price)], columns[near][np.argmin(price)]))
        return np.array(moved, dtype=np.int64).reshape(-1, 2)

    def _without_spurs(self, legs: list[Integers], limit_px: float) -> Integers:
        """The legs as one path: where one comes back on the last, by no more than a click's error, both are cut."""
        cells = legs[0]
        for number, leg in enumerate(legs[1:]):
            back, forth = _common(cells, leg)
            spur_px = (
                float(arc_length(cells[back:].astype(float))[-1]) / self.field.scale if back < len(cells) - 1 else 0.0
            )
            if spur_px > limit_px:
                x, y = self.points_px[number + 1]
                raise InputError(
                    f"{self.photo.file}: behind the via point ({x:g}, {y:g}) the path comes back {spur_px:.0f} px on "
                    "itself: the point lies off the way to the next one. Give via_px in the crack's order, and none on "
                    "a branch."
                )
            cells = np.concatenate([cells[: back + 1], leg[forth + 1 :]])
        return cells

    def _from_crack_to_crack(self, points_px: Floats, on_crack: NDArray[np.bool_], limit_px: float) -> slice:
        """The path's points from the first to the last that is in the crack."""
        inside = np.flatnonzero(on_crack)
        first, last = int(inside[0]), int(inside[-1])
        s_px = arc_length(points_px)
        ends_px = self.points_px[[0, -1]]
        for (x, y), beside_px in zip(ends_px, (s_px[first], s_px[-1] - s_px[last]), strict=True):
            if beside_px > limit_px:
                raise InputError(
                    f"{self.photo.file}: the end ({x:g}, {y:g}) is on no crack: the nearest one is {beside_px:.0f} px "
                    f"away (at most {limit_px:.0f}); give a point inside the crack."
                )
        # A few cells as bright as mortar are a grain in the crack.
        gap = larger_pieces(~on_crack[None, first : last + 1], limit_px * self.field.scale)
        gaps = float(np.mean(gap))
        if gaps > MOST_GAPS:
            raise InputError(
                f"{self.photo.file}: no crack on {gaps:.0%} of the way between the ends (at most {MOST_GAPS:.0%}); "
                "give ends of one unbroken crack."
            )
        return slice(first, last + 1)


def leg_margin(apart: float, scale: float) -> int:
    """Cells by which a path between points so many cells apart may leave their box."""
    return int(np.ceil(max(LEAST_AROUND_PX * scale, AROUND * apart)))


def _common(there: Integers, back: Integers) -> tuple[int, int]:
    """Where ``back``, which begins at the end of ``there``, leaves it: the index in either."""
    apart, nearest = KDTree(there).query(back, distance_upper_bound=BESIDE)
    leaves = int(np.flatnonzero(np.isfinite(apart))[-1])
    return int(np.asarray(nearest)[leaves]), leaves
