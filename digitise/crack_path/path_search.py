"""Search for the path along a crack between given points: the cheapest way over the line map."""

from copy import copy
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.spatial import KDTree

from digitise.crack_path.gates import GATES, Route, lighter_line_between, moved_click
from digitise.crack_path.hints import CrackPath, check_hints, region_px, snap_px, too_far
from digitise.crack_path.line_map import CLEAR, EVEN, LineMap, cheapest_legs, map_lines
from digitise.crack_path.medial_axis import distance_outside
from digitise.crack_path.profiles import width_along
from digitise.image.raster import blurred_copy, resized
from digitise.photo import Photo
from digitise.settings import Pixel
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from sealtwin.core.records import Floats, Integers

ON_CRACK = 3.0  # Clearness of a place on a crack: the darkest ways through bare ground have 2 on average
SHARE_ON_CRACK = 0.5  # The same as a share of the path's own clearness
SAME = 1.5  # Distance in cells within which two paths are the same
BESIDE = 1.0  # Widths to each side of a path within which the middle of its crack is searched for
LEAST_BESIDE = 3.0  # The same in cells
CLEAREST = 90  # Percentile of the clearness there that is the middle's


class LiveWire:
    """Paths along a photo's crack between clicked points, on one map. Several threads may use it."""

    def __init__(
        self, photo: Photo, roi_px: tuple[Pixel, ...] | None = None, found_face_px: Floats | None = None
    ) -> None:
        """Map the photo within ``roi_px`` and ``found_face_px``; raise InputError if ``roi_px`` is not a region."""
        self._photo, self._in_region = photo, roi_px is not None
        self._limits = None if roi_px is None else region_px(photo, roi_px), found_face_px
        self.field: LineMap = map_lines(photo, *self._limits)

    def path(self, ends_px: tuple[Pixel, Pixel], via_px: tuple[Pixel, ...] = ()) -> CrackPath:
        """Find the path past all clicked points in order.

        Raises InputError for a point off any crack, or if a gate refuses the path.
        """
        check_hints(self._photo, ends_px, via_px)
        points_px = np.array([ends_px[0], *via_px, ends_px[1]], dtype=float)
        return self._believing(points_px).between(points_px, "via" if via_px else "ends")

    def between(self, points_px: Floats, source: Literal["ends", "via"] | None = None) -> CrackPath:
        """Find the path past all points, (n, 2), inside the photo.

        Without a ``source`` nobody clicked the points: they are places on a line that a search found.
        """
        route = self.route(points_px, clicked=source is not None)
        gates = [gate for gate in GATES if source is not None or gate is not moved_click]
        findings = [finding for gate in gates if (finding := gate(route)) is not None]
        if any(finding.level == "fault" for finding in findings):
            findings.sort(key=lambda finding: finding.level != "fault")
            raise InputError(f"{self._photo.file}: {'. Also, '.join(texts(findings))}.")
        return CrackPath(route.points_px, route.width_px, source or "automatic", tuple(findings))

    def route(self, points_px: Floats, clicked: bool = True) -> Route:
        """Return the cheapest way past the points, from the first place on the crack to the last.

        Raises InputError if a clicked point is off any line.
        """
        field = self.field
        stops = self._on_map(points_px)
        limit_px = snap_px(self._photo)
        cost = field.cost()
        for number in range(1, len(stops) - 1):
            stops[number] = self._snapped(stops[number], points_px[number], cost, limit_px)
        cells = self._joined(cheapest_legs(cost, stops, field.scale), points_px, limit_px)
        width = float(np.median(field.width[tuple(cells.T)]))
        # A wide crack is as cheap along its walls; its middle is the clearest place.
        away = distance_outside(_marked(cells, cost.shape))
        beside = away <= max(BESIDE * width, LEAST_BESIDE)
        clearest = float(np.percentile(field.clear[beside], CLEAREST))
        cost = np.where(beside, field.cost(max(CLEAR, clearest)), np.inf)
        cells = self._joined(cheapest_legs(cost, stops, field.scale), points_px, limit_px)
        most_px = limit_px + width / field.scale if clicked else len(cells) / field.scale
        cells = self._on_crack(cells, points_px, width, most_px)
        line_px = field.to_photo(cells[:, ::-1])
        width_px = width_along(self._photo, line_px, max(width, 1.0) / field.scale)
        return Route(self._photo, field, cells, line_px, width_px, points_px)

    def _believing(self, points_px: Floats) -> "LiveWire":
        """Return a wire for which a dark border region with a clicked point deep inside is crack, not surroundings."""
        if not self.field.around.any():
            return self
        depth_px = distance_outside(~self.field.around) / self.field.scale
        column, row = np.clip(np.rint(self.field.to_cells(points_px)).astype(int).T, 0, _last(depth_px)[::-1, None])
        deep = depth_px[row, column] > snap_px(self._photo)
        if not deep.any():
            return self
        wire = copy(self)
        wire.field = map_lines(self._photo, *self._limits, points_px[deep])
        return wire

    def _on_map(self, points_px: Floats) -> Integers:
        """Return row and column of each point, moved to the nearest cell that is searched."""
        field, photo = self.field, self._photo
        if not field.allowed.any():
            raise InputError(f"{photo.file}: no part of the sample is near the ends; check ends_px and roi_px.")
        cells = np.rint(field.to_cells(points_px)[:, ::-1]).astype(int)
        searched = np.clip(cells, 0, _last(field.clear))
        for number in np.flatnonzero(~field.allowed[tuple(searched.T)]):
            allowed = np.argwhere(field.allowed)
            searched[number] = allowed[np.argmin(np.sum((allowed - cells[number]) ** 2, axis=1))]
        moved_px = np.linalg.norm(searched - cells, axis=1) / field.scale
        if moved_px.max() > snap_px(photo):
            (x, y), outside_px = points_px[moved_px.argmax()], moved_px.max()
            limits = ["the face"] if photo.face_px is not None else []
            limits += ["without its markers"] if photo.markers_px else []
            limits += ["inside roi_px"] if self._in_region else []
            limits += ["without the dark region at its border"] if field.around.any() else []
            raise InputError(
                f"{photo.file}: the point ({x:g}, {y:g}) is {outside_px:.0f} px outside the searched area, which is "
                f"{', '.join(limits) or 'the sample'}; check ends_px, via_px{' and roi_px' * self._in_region}."
            )
        return searched

    def _snapped(self, stop: Integers, point_px: Floats, cost: Floats, limit_px: float) -> Integers:
        """Return a via point moved to the cheapest place of a line near it."""
        rows, columns = np.nonzero((self.field.clear >= ON_CRACK) & self.field.allowed)
        away_px = np.hypot(rows - stop[0], columns - stop[1]) / self.field.scale
        near = np.flatnonzero(away_px <= limit_px)
        if len(near) == 0:
            nearest = f": the nearest one is {too_far(away_px.min(), limit_px)}" if len(rows) else ""
            x, y = point_px
            raise InputError(
                f"{self._photo.file}: the via point ({x:g}, {y:g}) is not on a crack{nearest}; give a point inside "
                "the crack."
            )
        # Cost grows with distance, so that the point stays on its crack if a darker one is near.
        price = cost[rows[near], columns[near]] * (1 + (2 * away_px[near] / limit_px) ** 2)
        return np.array([rows[near][np.argmin(price)], columns[near][np.argmin(price)]])

    def _joined(self, legs: list[Integers], points_px: Floats, limit_px: float) -> Integers:
        """Join the legs to one path without double parts.

        A leg may run back along the one before it, but only by as much as a click may be off.
        """
        cells = legs[0]
        for number, leg in enumerate(legs[1:], 1):
            apart, nearest = KDTree(cells).query(leg, distance_upper_bound=SAME)
            forth = int(np.flatnonzero(np.isfinite(apart))[-1])
            back = int(np.asarray(nearest)[forth])
            spur_px = float(arc_length(cells[back:].astype(float))[-1]) / self.field.scale
            if spur_px > limit_px:
                x, y = points_px[number]
                raise InputError(
                    f"{self._photo.file}: after the via point ({x:g}, {y:g}) the path runs back {spur_px:.0f} px along "
                    "itself: the point is not on the way to the next one. Give via_px in order along the crack, and "
                    "give no point on a branch."
                )
            cells = np.concatenate([cells[: back + 1], leg[forth + 1 :]])
        return cells

    def _on_crack(self, cells: Integers, points_px: Floats, width: float, limit_px: float) -> Integers:
        """Return the path from its first place on the crack to its last: a clear one that is darker than the ground."""
        clear = maximum_filter1d(self.field.clear_along(cells), 3)
        around = resized(blurred_copy(self.field.shown, EVEN + 2 * width), self.field.shown.shape)
        light = minimum_filter1d((self.field.shown / np.maximum(around, 1e-3))[tuple(cells.T)], 3)
        dark = light < (1 + float(np.median(light))) / 2
        is_clear = clear >= min(ON_CRACK, SHARE_ON_CRACK * float(np.median(clear)))
        s_px, ends = arc_length(cells.astype(float)) / self.field.scale, list[int]()
        for (x, y), away_px in zip(points_px[[0, -1]], (s_px, s_px[-1] - s_px), strict=True):
            # The tip of a crack in grain is clear beyond the last place that is dark.
            nearest_px = [float(away_px[places].min(initial=np.inf)) for places in (is_clear & dark, is_clear)]
            moved_px = nearest_px[0] if nearest_px[0] <= limit_px else nearest_px[1]
            if moved_px > limit_px:
                raise InputError(
                    f"{self._photo.file}: the end ({x:g}, {y:g}) is not on a crack: the nearest one is "
                    f"{too_far(moved_px, limit_px)}; "
                    f"{lighter_line_between(self._photo, points_px) or 'give a point inside the crack'}."
                )
            ends.append(int(np.argmin(np.abs(away_px - moved_px))))
        return cells[ends[0] : ends[1] + 1]


def _marked(cells: Integers, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    mask = np.zeros(shape, dtype=bool)
    mask[tuple(cells.T)] = True
    return mask


def _last(picture: NDArray) -> Integers:
    """Return the last row and column."""
    return np.array(picture.shape) - 1
