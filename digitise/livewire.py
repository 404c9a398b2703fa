"""The darkest way between clicked points, quickly: the photo's search map is made once, each click only walks on it."""

from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter
from scipy.spatial import KDTree
from skimage.graph import MCP_Geometric

from digitise.crack_path import CrackPath
from digitise.darkness import DarkMap, map_darkness
from digitise.hints import SNAP_PX, check_hints, region_px
from digitise.photo import Photo
from digitise.settings import Pixel
from sealtwin.errors import InputError
from sealtwin.records import Floats, Integers, arc_length

THIN_PX = 6.0
"""On the search map: thinner cracks are told by their shape as lines, wider ones by their darkness."""
LEAST_DARKNESS = 0.2
"""Of a crack's middle, relative to the mortar beside it: stains and shadows stay below."""
SURE_RIDGE = 5.0
"""In noise units: a line this strong is a crack even where the search map is too coarse to show how dark it is."""
MOST_GAPS = 0.2
"""Share of the path that may be as bright as mortar."""
CLEAR = 8.0
"""In noise units: a clearer line is no cheaper, or one strong grain would pay for a detour."""
NOTHING = 0.04
"""Worth of a step where there is no line: a gap costs as much as a line 25 times as long."""
AROUND = 0.5
"""A path may leave the box of its points by this much of their distance."""
LEAST_AROUND_PX = 100.0
BESIDE = 1.5
"""Cells: two ways this close are the same way."""


class LiveWire:
    """Paths along a photo's crack between clicked points.

    Made once for a photo, which is the slow part; safe to ask from several threads.
    """

    def __init__(
        self, photo: Photo, roi_px: tuple[Pixel, ...] | None = None, seen_face_px: Floats | None = None
    ) -> None:
        """``roi_px`` and ``seen_face_px`` bound where paths run. Raises InputError where ``roi_px`` is no region."""
        self._photo = photo
        self.field: DarkMap = map_darkness(photo, None if roi_px is None else region_px(photo, roi_px), seen_face_px)

    def path(self, ends_px: tuple[Pixel, Pixel], via_px: tuple[Pixel, ...] = ()) -> CrackPath:
        """From the first end to the second, past every via point in turn.

        Raises InputError where a point is outside the photo or on no crack, where the crack is broken between them, or
        where the path would have to come back on itself to reach the next point.
        """
        check_hints(self._photo, ends_px, via_px)
        points_px = np.array([ends_px[0], *via_px, ends_px[1]], dtype=float)
        way = _Way(self._photo, _window(self.field, points_px), points_px)
        return replace(way.found(), source="via" if via_px else "ends")


def _window(field: DarkMap, points_px: Floats) -> DarkMap:
    """The part of the search map where a path between the points may run."""
    span_px = float(np.linalg.norm(np.ptp(points_px, axis=0)))
    margin = max(LEAST_AROUND_PX, AROUND * span_px)
    height, width = field.dark.shape
    left, top = np.clip(np.floor(field.to_work(points_px.min(axis=0) - margin)), 0, (width - 1, height - 1)).astype(int)
    right, bottom = np.clip(np.ceil(field.to_work(points_px.max(axis=0) + margin)), 0, (width - 1, height - 1)).astype(
        int
    )
    return field.window(int(left), int(top), int(right) + 1, int(bottom) + 1)


@dataclass(frozen=True)
class _Way:
    """One question to the search map."""

    photo: Photo
    field: DarkMap
    points_px: Floats
    """First end, via points, last end."""

    def found(self) -> CrackPath:
        field = self.field
        stops = self._on_map(self.points_px)
        # The cost of wide cracks finds any path well enough to tell how wide the crack is.
        legs = _legs(_cost_of_wide(field), stops)
        darkness, width = _measure(field, np.concatenate(legs))
        thin = width < THIN_PX
        cost = cost_of_thin(field) if thin else _cost_off_centre(field, np.concatenate(legs), darkness)
        if thin:
            legs = _legs(cost, stops)
            darkness, width = _measure(field, np.concatenate(legs))
        self._check_dark(darkness, np.concatenate(legs))
        # A path through a thin crack may run a cell beside it.
        crack = np.asarray(maximum_filter(field.dark, size=3)) > darkness / 2
        limit_px = max(SNAP_PX, width / field.scale)
        if not thin or len(stops) > 2:
            stops[1:-1] = self._snapped(stops[1:-1], cost, crack, limit_px)
            legs = _legs(cost, stops)
            darkness, width = _measure(field, np.concatenate(legs))
        cells = self._without_spurs(legs, limit_px)
        points_px = field.to_photo(cells[:, ::-1])
        on_crack = self._from_crack_to_crack(points_px, crack[tuple(cells.T)], limit_px)
        return CrackPath(points_px[on_crack], width / field.scale, "ends")

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

    def _check_dark(self, darkness: float, cells: Integers) -> None:
        if darkness < LEAST_DARKNESS and np.median(self.field.ridge[tuple(cells.T)]) < SURE_RIDGE:
            raise InputError(
                f"{self.photo.file}: no crack between the ends: the way there is only {darkness:.0%} darker than "
                f"around it (a crack is at least {LEAST_DARKNESS:.0%}); check ends_px."
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
        gaps = 1 - float(np.mean(on_crack[first : last + 1]))
        if gaps > MOST_GAPS:
            raise InputError(
                f"{self.photo.file}: no crack on {gaps:.0%} of the way between the ends (at most {MOST_GAPS:.0%}); "
                "give ends of one unbroken crack."
            )
        return slice(first, last + 1)


def cost_of_thin(field: DarkMap) -> Floats:
    """Of a step on a thin crack's way: its clearness as a line counts."""
    return np.where(field.allowed, 1 / (NOTHING + np.clip(field.ridge, 0, CLEAR) / CLEAR), np.inf)


def _cost_of_wide(field: DarkMap) -> Floats:
    reference = max(float(np.percentile(field.dark[field.allowed], 99)), LEAST_DARKNESS)
    strength = np.clip(field.ridge, 0, CLEAR) / CLEAR * field.dark / reference
    return np.where(field.allowed, 1 / (0.03 + np.minimum(strength, 1.5) ** 1.5), np.inf)


def _cost_off_centre(field: DarkMap, cells: Integers, darkness: float) -> Floats:
    """Cheapest in the middle of a wide crack, which is as dark everywhere."""
    to_rim = _to_rim(field, darkness)
    usual = max(float(np.percentile(to_rim[tuple(cells.T)], 75)), 1.0)
    return np.where(field.allowed, 1 / (0.03 + np.minimum(to_rim / usual, 1.5) ** 2), np.inf)


def _legs(cost: Floats, stops: Integers) -> list[Integers]:
    return [_cheapest(cost, start, end) for start, end in pairwise(stops)]


def _cheapest(cost: Floats, start: Integers, end: Integers) -> Integers:
    """Rows and columns, (n, 2), of the path with the least cost per length."""
    search = MCP_Geometric(np.where(np.isfinite(cost), cost, -1), fully_connected=True)
    search.find_costs([tuple(start)], [tuple(end)])
    return np.array(search.traceback(tuple(end)), dtype=np.int64)


def _common(there: Integers, back: Integers) -> tuple[int, int]:
    """Where ``back``, which begins at the end of ``there``, leaves it: the index in either."""
    apart, nearest = KDTree(there).query(back, distance_upper_bound=BESIDE)
    leaves = int(np.flatnonzero(np.isfinite(apart))[-1])
    return int(np.asarray(nearest)[leaves]), leaves


def _measure(field: DarkMap, cells: Integers) -> tuple[float, float]:
    """Typical darkness along a path, and width of the dark around it, on the map."""
    darkness = float(np.median(field.dark[tuple(cells.T)]))
    to_rim = _to_rim(field, darkness)[tuple(cells.T)]
    return darkness, float(2 * np.median(to_rim[to_rim > 0]) - 1) if np.any(to_rim > 0) else 0.0


def _to_rim(field: DarkMap, darkness: float) -> Floats:
    """Distance from the nearest cell that is not half as dark as the crack, or not on the sample or the map."""
    mask = ((field.dark > darkness / 2) & field.allowed).astype(np.uint8)
    mask[[0, -1]] = 0
    mask[:, [0, -1]] = 0
    return cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE).astype(float)
