"""Search for the path along a crack between given points."""

from collections.abc import Callable
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from digitise.crack_path import step_costs
from digitise.crack_path.darkness import DarkMap, coarser, map_darkness
from digitise.crack_path.gaps import bare, doubt_gaps, find_gaps
from digitise.crack_path.hints import CrackPath, check_hints, listed, region_px, snap_px, too_far
from digitise.crack_path.joints import along_joint
from digitise.crack_path.medial_axis import distance_outside, larger_pieces
from digitise.crack_path.profiles import width_along
from digitise.crack_path.ridge_filter import support
from digitise.crack_path.standing_out import require_dark
from digitise.image.raster import Map
from digitise.photo import Photo
from digitise.settings import Pixel
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers

# Limits of what is a path along a crack. Clearness is in noise units, support in deviations of plain ground.
#
# Chosen on 180 paths over plain ground and 111 along cracks. Lower limits of clearness and support accept fainter
# cracks and more plain ground; a higher limit of gaps accepts broken cracks.
SURE_RIDGE = 3.5  # Median clearness of a sure crack: 1 of the 180 paths has it, 95 of the 111 cracks
LEAST_SUPPORT = 1.6  # Least median support: all 111 cracks have it, 3 of the 180 paths
CLEAR_RIDGE = 3.0  # Clearness of a cell on a crack, even if grain next to it is as dark
OBVIOUS_DARKNESS = 0.5  # Median darkness that needs no line: no stain and few shadows are so dark
MOST_GAPS = 0.2  # Largest share of the path that may be as bright as mortar
AROUND = 0.5  # Room around the box of two points, as a share of their distance
LEAST_AROUND_PX = 100.0  # Least such room, in px of the photo
SAME = 1.5  # Distance in cells within which two paths are the same
BESIDE_AROUND = 6.0  # Cells from the surroundings within which a path runs along them
AROUND_WIDTHS = 3.0  # Widths over which a path may run along them, as at the edge of the sample
LEAST_BESIDE = 40.0  # The same in cells
COARSER = 4  # Size of the cells on which the widest cracks are searched for, in cells of the fine map


TAKEN = (
    "was taken for the surroundings of the sample. If it is the crack, paint it in photo.mask, or give photo.roi_px: "
    "a region whose border crosses the dark area and does not run along it"
)


@dataclass(frozen=True)
class PathSearch:
    """A search on one map for the path from the first end past the via points to the last end."""

    photo: Photo
    field: DarkMap
    points_px: Floats
    support: Callable[[], Map]  # How line-like the best path through each cell is; slow, so called only if needed
    in_region: bool = False  # Whether the search is limited to a region of interest

    def obvious(self) -> bool:
        """Return True if the path is plainly dark and wide on the map."""
        try:
            rough = np.concatenate(self._rough)
        except InputError:  # The finer map is searched next and refuses a point outside.
            return False
        darkness, _ = step_costs.measure(self.field, rough)
        width = step_costs.middle_width(self.field, rough, darkness)
        return darkness >= OBVIOUS_DARKNESS and width >= step_costs.WIDE_PX

    def result(self) -> CrackPath:
        """Return the path from the first point in the crack to the last. Raises InputError if there is none."""
        field = self.field
        stops, legs = self._stops.copy(), self._rough
        rough = np.concatenate(legs)
        darkness, width = step_costs.measure(field, rough)
        thin = width < step_costs.THIN_PX
        cost = step_costs.cost_of_thin(field, rough) if thin else step_costs.cost_off_centre(field, rough, darkness)
        if thin:
            legs = self._legs(cost, stops)
            darkness, width = step_costs.measure(field, np.concatenate(legs))
        if thin or darkness < OBVIOUS_DARKNESS:
            self._check_clear(np.concatenate(legs))
        # A path through a thin crack may be one cell off it.
        dark = np.asarray(cv2.dilate(field.dark, np.ones((3, 3), np.uint8)), dtype=np.float32)
        crack = dark > darkness / 2
        if thin:
            crack |= field.ridge > CLEAR_RIDGE
        limit_px = max(snap_px(self.photo), width / field.scale)
        if not thin or len(stops) > 2:
            stops[1:-1] = self._snapped(stops[1:-1], cost, crack, limit_px)
            legs = self._legs(cost, stops)
            darkness, width = step_costs.measure(field, np.concatenate(legs))
        cells = self._without_spurs(legs, limit_px)
        points_px = field.to_photo(cells[:, ::-1])
        inside = crack[tuple(cells.T)]
        on_crack = self._from_crack_to_crack(points_px, inside, limit_px)
        points_px, cells = points_px[on_crack], cells[on_crack]
        width_px = width_along(self.photo, points_px, width / field.scale)
        on_dark = inside[on_crack] & ~bare(dark[tuple(cells.T)], width_px * field.scale)
        gaps = find_gaps(points_px, on_dark, width_px, field.scale)
        doubts = (
            *doubt_gaps(self.photo, field, cells, gaps, self.points_px),
            *self._along_surroundings(points_px, width_px),
        )
        path = CrackPath(points_px, width_px, "ends", doubts)
        require_dark(self.photo, path)
        return path

    @cached_property
    def _stops(self) -> Integers:
        return self._on_map(self.points_px)

    @cached_property
    def _rough(self) -> list[Integers]:
        """Search the parts of the path between its stops with the cost function for wide cracks.

        The result is good enough to measure the width of any crack.
        """
        return self._legs(step_costs.cost_of_wide(self.field), self._stops)

    def _legs(self, cost: Floats, stops: Integers) -> list[Integers]:
        return [
            step_costs.cheapest(cost, start, end, leg_margin(float(np.linalg.norm(end - start)), self.field.scale))
            for start, end in pairwise(stops)
        ]

    def _on_map(self, points_px: Floats) -> Integers:
        """Return row and column of each point, moved to the nearest cell that is searched."""
        allowed = np.argwhere(self.field.allowed)
        if len(allowed) == 0:
            raise InputError(f"{self.photo.file}: no part of the sample is near the ends; check ends_px and roi_px.")
        cells = np.rint(self.field.to_work(points_px)[:, ::-1]).astype(int)
        limits = np.array(self.field.dark.shape) - 1
        searched = np.clip(cells, 0, limits)
        for index in np.flatnonzero(~self.field.allowed[tuple(searched.T)]):
            searched[index] = allowed[np.argmin(np.sum((allowed - cells[index]) ** 2, axis=1))]
        moved_px = np.linalg.norm(searched - cells, axis=1) / self.field.scale
        if moved_px.max() > snap_px(self.photo):
            (x, y), outside_px = points_px[moved_px.argmax()], moved_px.max()
            beside = f"{self.photo.file}: the point ({x:g}, {y:g}) is {outside_px:.0f} px"
            if self.field.around[tuple(np.clip(cells[moved_px.argmax()], 0, limits))]:
                raise InputError(f"{beside} inside a dark region at the photo's border, which {TAKEN}.")
            raise InputError(f"{beside} outside the searched area, {self._searched()}.")
        return searched

    def _searched(self) -> str:
        """Return a clause on the limits of the search and the settings to check."""
        limits = ["the face"] if self.photo.face_px is not None else []
        limits += ["without its markers"] if self.photo.markers_px else []
        limits += ["inside roi_px"] if self.in_region else []
        return f"which is {', '.join(limits) or 'the sample'}; check ends_px, via_px{' and roi_px' * self.in_region}"

    def _border_hint(self, points_px: Floats) -> str:
        """Return a sentence about dark surroundings near the path, or an empty string."""
        if not self._near_surroundings(points_px).any():
            return ""
        return f" The path comes close to a dark region at the photo's border, which {TAKEN}."

    def _near_surroundings(self, points_px: Floats) -> NDArray[np.bool_]:
        if not self.field.around.any():
            return np.zeros(len(points_px), dtype=bool)
        cells = np.rint(self.field.to_work(points_px)[:, ::-1]).astype(int)
        return distance_outside(self.field.around)[tuple(cells.T)] <= BESIDE_AROUND

    def _along_surroundings(self, points_px: Floats, width_px: float) -> list[str]:
        """Return a warning if the path runs along the surroundings, which may be a wide crack taken for them."""
        near = self._near_surroundings(points_px)
        beside_px = float(np.linalg.norm(np.diff(points_px, axis=0), axis=1)[near[1:] & near[:-1]].sum())
        if beside_px <= max(AROUND_WIDTHS * width_px, LEAST_BESIDE / self.field.scale):
            return []
        where = listed(points_px[near][[0, -1]])
        return [
            f"{beside_px:.0f} px of the path, from {where} px, run along a dark region at the photo's border, which "
            f"{TAKEN}"
        ]

    def _check_clear(self, cells: Integers) -> None:
        along = tuple(cells.T)
        if np.median(self.field.ridge[along]) >= SURE_RIDGE:
            return
        clearness = float(np.median(self.support()[along]))
        if clearness < LEAST_SUPPORT:
            fault = (
                f"differs from plain ground by {clearness:.1f} standard deviations (a crack differs by at least "
                f"{LEAST_SUPPORT:g})"
                if clearness > 0
                else "is not darker than lines on plain ground"
            )
            raise InputError(
                f"{self.photo.file}: no crack between the ends: the best path there {fault}; check ends_px."
            )

    def _snapped(self, stops: Integers, cost: Floats, crack: NDArray[np.bool_], limit_px: float) -> Integers:
        """Return the via points, each moved to the cheapest place of the crack near it."""
        rows, columns = np.nonzero(crack & self.field.allowed)
        moved = []
        for stop, (x, y) in zip(stops, self.points_px[1:-1], strict=True):
            away_px = np.hypot(rows - stop[0], columns - stop[1]) / self.field.scale
            near = np.flatnonzero(away_px <= limit_px)
            if len(near) == 0:
                nearest = f": the nearest one is {too_far(away_px.min(), limit_px)}" if len(rows) else ""
                raise InputError(
                    f"{self.photo.file}: the via point ({x:g}, {y:g}) is not on a crack{nearest}; give a point inside "
                    "the crack."
                )
            # Cost grows with distance, so that the point stays on its crack if a darker one is near.
            price = cost[rows[near], columns[near]] * (1 + (2 * away_px[near] / limit_px) ** 2)
            moved.append((rows[near][np.argmin(price)], columns[near][np.argmin(price)]))
        return np.array(moved, dtype=np.int64).reshape(-1, 2)

    def _without_spurs(self, legs: list[Integers], limit_px: float) -> Integers:
        """Join the legs to one path without double parts.

        A leg may run back along the one before it, but only by as much as a click may be off.
        """
        cells = legs[0]
        for number, leg in enumerate(legs[1:]):
            back, forth = _common(cells, leg)
            spur_px = float(arc_length(cells[back:].astype(float))[-1]) / self.field.scale
            if spur_px > limit_px:
                x, y = self.points_px[number + 1]
                raise InputError(
                    f"{self.photo.file}: after the via point ({x:g}, {y:g}) the path runs back {spur_px:.0f} px along "
                    "itself: the point is not on the way to the next one. Give via_px in order along the crack, and "
                    "give no point on a branch."
                )
            cells = np.concatenate([cells[: back + 1], leg[forth + 1 :]])
        return cells

    def _from_crack_to_crack(self, points_px: Floats, on_crack: NDArray[np.bool_], limit_px: float) -> slice:
        """Return the slice of the path from its first point in the crack to its last."""
        inside = np.flatnonzero(on_crack)
        first, last = int(inside[0]), int(inside[-1])
        s_px = arc_length(points_px)
        ends_px = self.points_px[[0, -1]]
        for (x, y), beside_px in zip(ends_px, (s_px[first], s_px[-1] - s_px[last]), strict=True):
            if beside_px > limit_px:
                raise InputError(
                    f"{self.photo.file}: the end ({x:g}, {y:g}) is not on a crack: the nearest one is "
                    f"{too_far(beside_px, limit_px)}; give a point inside the crack.{self._border_hint(points_px)}"
                )
        # A gap of a few cells is a grain in the crack.
        gap = larger_pieces(~on_crack[None, first : last + 1], limit_px * self.field.scale)
        gaps = float(np.mean(gap))
        if gaps > MOST_GAPS:
            raise InputError(
                f"{self.photo.file}: no crack on {gaps:.0%} of the path between the ends (at most "
                f"{MOST_GAPS:.0%}); give ends of one unbroken crack.{self._border_hint(points_px)}"
            )
        return slice(first, last + 1)


def leg_margin(apart: float, scale: float) -> int:
    """Return how far, in cells, a path may leave the box around two points that are ``apart`` cells from each other."""
    return int(np.ceil(max(LEAST_AROUND_PX * scale, AROUND * apart)))


def _common(there: Integers, back: Integers) -> tuple[int, int]:
    """Return the last index of ``there`` and of ``back`` at which they coincide.

    ``back`` begins at the end of ``there``.
    """
    apart, nearest = KDTree(there).query(back, distance_upper_bound=SAME)
    leaves = int(np.flatnonzero(np.isfinite(apart))[-1])
    return int(np.asarray(nearest)[leaves]), leaves


class LiveWire:
    """Paths along a photo's crack between clicked points, on one map. Several threads may use it."""

    def __init__(
        self, photo: Photo, roi_px: tuple[Pixel, ...] | None = None, found_face_px: Floats | None = None
    ) -> None:
        """Map the photo within ``roi_px`` and ``found_face_px``; raise InputError if ``roi_px`` is not a region."""
        self._photo, self._in_region = photo, roi_px is not None
        self._limits = None if roi_px is None else region_px(photo, roi_px), found_face_px
        self.field: DarkMap = map_darkness(photo, *self._limits)

    def path(self, ends_px: tuple[Pixel, Pixel], via_px: tuple[Pixel, ...] = ()) -> CrackPath:
        """Find the path past all clicked points in order.

        Raises InputError for a point off any crack, or a broken crack.
        """
        check_hints(self._photo, ends_px, via_px)
        points_px = np.array([ends_px[0], *via_px, ends_px[1]], dtype=float)
        wire = self._believing(points_px)
        path = wire.between(points_px, "via" if via_px else "ends")
        joint = along_joint(wire.field, path.points_px, lambda: wire.support)
        if joint is None:
            return path
        # Between clicks on a crack in a tile, the joints around the tile may be the darkest way.
        with suppress(InputError):
            aside = wire._way(joint.without_joints(wire.field), points_px).result()
            if not aside.warnings and joint.is_left_by(aside.points_px, path.width_px):
                return replace(aside, source=path.source, warnings=(joint.avoided,))
        return replace(path, warnings=(*path.warnings, joint.doubt))

    def between(self, points_px: Floats, source: Literal["ends", "via"] = "ends") -> CrackPath:
        """Find the path past all points, (n, 2), of a line that is known not to be a joint."""
        coarse = self._way(self.coarse, points_px)
        if coarse.obvious():
            # The coarse map does not show an end that tapers to a hairline: the fine map then decides.
            with suppress(InputError):
                return replace(coarse.result(), source=source)
        return replace(self._way(self.field, points_px).result(), source=source)

    def _believing(self, points_px: Floats) -> "LiveWire":
        """Return a wire for which a dark border region with a clicked point deep inside is crack, not surroundings.

        It is this wire if there is no such region.
        """
        if not self.field.around.any():
            return self
        depth_px = distance_outside(~self.field.around) / self.field.scale
        cells = np.rint(self.field.to_work(points_px)[:, ::-1]).astype(int)
        deep = depth_px[tuple(np.clip(cells, 0, np.array(depth_px.shape) - 1).T)] > snap_px(self._photo)
        if not deep.any():
            return self
        wire = copy(self)
        wire.field = map_darkness(self._photo, *self._limits, points_px[deep])
        for name in ("support", "coarse"):
            wire.__dict__.pop(name, None)
        return wire

    @cached_property
    def support(self) -> Map:
        """Return how line-like the best path through each cell is. Slow: computed only when needed."""
        return support(self.field.even, self.field.allowed)

    @cached_property
    def coarse(self) -> DarkMap:
        """The map on which the widest cracks are searched for."""
        return coarser(self.field, COARSER)

    def _way(self, field: DarkMap, points_px: Floats) -> PathSearch:
        """Return a search of the cells that a path between the points may use."""
        work = field.to_work(points_px)
        apart = np.linalg.norm(np.diff(work, axis=0), axis=1)
        margin = leg_margin(float(apart.max()), field.scale) + 1
        last = np.array(field.dark.shape[::-1]) - 1
        left, top = np.clip(np.floor(work.min(axis=0)) - margin, 0, last).astype(int).tolist()
        right, bottom = (1 + np.clip(np.ceil(work.max(axis=0)) + margin, 0, last)).astype(int).tolist()
        part = field.window(left, top, right, bottom)

        def line_support() -> Map:
            whole = self.support if field.even is self.field.even else support(field.even, field.allowed)
            return whole[top:bottom, left:right]

        return PathSearch(self._photo, part, points_px, line_support, self._in_region)
