"""Find the crack in a photo: in a painted mask, along the darkest path between clicked points, or by a chosen line."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.spatial import KDTree

from digitise.crack_path.candidates import MAX_UNLIKE, FoundCrack, candidates
from digitise.crack_path.hints import IF_LIGHTER, CrackPath, check_hints, listed, region_px, snap_px, too_far
from digitise.crack_path.line_map import CLEARNESS_LIMIT, SIGMA, LineMap, cheapest_legs, map_lines
from digitise.crack_path.line_verdict import REFUSED, TAKEN, Route, judge
from digitise.crack_path.medial_axis import distance_outside, nearest_cell
from digitise.crack_path.painted_path import painted_path
from digitise.crack_path.profiles import width_along
from digitise.image.raster import blurred_copy, resized
from digitise.photo import Photo
from digitise.settings import Clicks, PixelPair
from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import Floats, Integers, lengths
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts, doubt, texts

# Chosen on the 127 photos of the first five sets of benchmarks/real_roads. On the 117 photos of three later sets, a
# quarter less or a third more changes at most one right trace of 102 (benchmarks.line_constants).
#
# A path strays from the chosen line if more than this fraction of its length is more than this many cells away
FOLLOWS_CELLS, MAX_ASTRAY = 5.0, 0.2
ON_CRACK = 3.0  # Clearness of a cell on a crack: the darkest paths through bare ground have 2 on average
SHARE_ON_CRACK = 0.5  # The same limit as a share of the path's own clearness
RIVAL = 0.5  # A line with this share of the best line's score is nearly as good
PATH_CELLS = 1.5  # Paths closer than this, in cells, are the same
SEARCH_WIDTHS = 1.0  # The crack's middle is searched for within this many widths to each side of the path
MIN_BESIDE = 3.0  # Minimum of that distance, in cells
ASTRAY = 1e3  # Factor of a step's cost off that band, which a stop that the first path passes by may need
CLEAREST = 90  # Percentile of the clearness near the path that is taken for the clearness of the crack's middle


class RivalCracksError(InputError):
    """Raised if the user must choose one of the lines that may be the crack. ``cracks`` lists them, best first.

    ``refused_px``, (n, 2), is the refused path between clicked ends. None without ends.
    """

    def __init__(self, message: str, cracks: Sequence[FoundCrack] = (), refused_px: Floats | None = None) -> None:
        super().__init__(message)
        self.cracks, self.refused_px = cracks, refused_px


def find_path(
    photo: Photo,
    ends_px: PixelPair | None,
    via_px: Clicks = (),
    roi_px: Clicks | None = None,
    crack: int | None = None,
) -> CrackPath:
    """Return the path between the ends, past the via points in their order, inside ``roi_px``.

    In a painted photo the path is the middle of the paint. Without ends it runs from left to right along the found
    line with the number ``crack``, or without a number along the best line if that is probably the crack. Raises
    InputError if a point is outside the photo or off any crack, or if no crack is found. Raises RivalCracksError
    without ends and number if the user must choose a line.
    """
    if photo.drawn is not None:
        return painted_path(photo, ends_px)
    if ends_px is None:
        return CrackSearch.of(photo, roi_px).path(crack)
    return LiveWire(photo, roi_px).path(ends_px, via_px)


@dataclass(frozen=True)
class CrackSearch:
    """The lines that are most likely to be the crack, most likely first."""

    photo: Photo
    wire: "LiveWire"
    cracks: tuple[FoundCrack, ...]
    warnings: Facts

    @classmethod
    def of(cls, photo: Photo, roi_px: Clicks | None = None) -> "CrackSearch":
        """Search the photo within ``roi_px``. Raises InputError if ``roi_px`` is not a region."""
        wire = LiveWire(photo, roi_px)
        cracks, straight_px = candidates(photo, wire.field)
        text = "a line from {} px is as straight as a joint"
        warnings = tuple(doubt("path.joint", text.format(listed(line_px))) for line_px in straight_px[:1])
        return cls(photo, wire, tuple(cracks), warnings)

    def path(self, number: int | None) -> CrackPath:
        """Return the path along the crack with this number, which counts from 1, from left to right.

        Without a number, the best line is taken if it is probably the crack. Raises InputError if there is no such
        crack, and RivalCracksError if the user must choose.
        """
        photo, ranked = self.photo, self.cracks
        if not ranked:
            raise InputError(
                f"{photo.file}: no crack found: nothing in the photo is dark, thin and long; "
                f"{'; '.join(('give ends_px', *texts(self.warnings)))}."
            )
        if number is None:
            if (path := self._taken()) is not None:
                return path
            raise RivalCracksError(
                f"{photo.file}: which line is the crack? Lines that may be it (best first, with the score as a share "
                f"of the best): {self._listed()}. Choose one by its number, for example photo.crack = 1 (as "
                "--set photo.crack=1, or 1 in the column crack of pairing.csv), or give both ends, ends_px (--ends).",
                ranked,
            )
        if number > len(ranked):
            raise InputError(
                f"{photo.file}: photo.crack = {number}, but only {len(ranked)} cracks were found: {self._listed()}. "
                "Give one of these numbers."
            )
        chosen = ranked[number - 1]
        try:
            path = self._along(chosen)
        except InputError:
            # The user has not given these ends, so a message about them would not help.
            raise InputError(
                f"{photo.file}: no crack found: line {number}, from {listed(chosen.line_px[[0, -1]])} px, is not a "
                "crack over its whole length. Give ends_px."
            ) from None
        # Whoever chose the line has confirmed it.
        return replace(path, warnings=self.warnings)

    def _taken(self) -> CrackPath | None:
        """Return the path along the best line if it is probably the crack.

        Returns None if another line is nearly as good, or if the line may be an edge.
        """
        best, *others = self.cracks
        if best.unlike > MAX_UNLIKE or any(other.score >= RIVAL * best.score for other in others):
            return None
        with suppress(InputError):
            path = self._along(best)
            if path.verdict["probability"] >= TAKEN and not path.warnings:
                return replace(path, source="found")
        return None

    def _along(self, crack: FoundCrack) -> CrackPath:
        """Return the path between the ends of a line.

        If this path leaves the line, points of the line are added as via points.
        """
        line_px = crack.line_px
        path = self.wire.between(line_px[[0, -1]])
        near_px = max(crack.width_px, FOLLOWS_CELLS / self.wire.field.scale)
        if np.mean(KDTree(line_px).query(path.points_px)[0] > near_px) <= MAX_ASTRAY:
            return path
        return self.wire.between(line_px[np.linspace(0, len(line_px) - 1, 5).astype(int)])

    def _listed(self) -> str:
        best = self.cracks[0].score
        return "; ".join(
            f"{rank}. {listed(crack.line_px[[0, -1]])} px, {crack.score / best:.0%}"
            for rank, crack in enumerate(self.cracks, 1)
        )


class LiveWire:
    """Find paths along a photo's crack between clicked points, on one line map. Several threads may use it."""

    def __init__(self, photo: Photo, roi_px: Clicks | None = None) -> None:
        """Map the photo within ``roi_px``. Raises InputError if ``roi_px`` is not a region."""
        self._photo, self._snap_px = photo, snap_px(photo)
        self._region_px = None if roi_px is None else region_px(photo, roi_px)
        self.field: LineMap = map_lines(photo, self._region_px)

    def path(self, ends_px: PixelPair, via_px: Clicks = ()) -> CrackPath:
        """Return the path past all clicked points in their order.

        Raises InputError for a point off any crack, or if the path is probably no crack.
        """
        check_hints(self._photo, ends_px, via_px)
        points_px = np.array([ends_px[0], *via_px, ends_px[1]], float)
        return self.between(points_px, "via" if via_px else "ends")

    def rivals(self) -> list[FoundCrack]:
        """Return the lines of the photo that may be the crack, best first."""
        return candidates(self._photo, self.field)[0]

    def between(self, points_px: Floats, source: Literal["ends", "via"] | None = None) -> CrackPath:
        """Return the path past all points, (n, 2) in px, inside the photo.

        ``source`` is None if the points were found by a search and not clicked.
        """
        route = self.route(points_px, clicked=source is not None)
        probability, inputs, reason, doubtful = judge(route)
        if probability < REFUSED and source != "via":
            rivals = self.rivals() if source else []
            choose = ", or choose a numbered line by photo.crack, without ends_px" if rivals else ""
            fault = f"{self._photo.file}: no crack between the ends: {reason}. Check ends_px{choose}."
            raise RivalCracksError(fault, rivals, route.points_px)
        text = f"the path may not be the crack, so its width is not measured: {reason}"
        doubts = (doubt("path.doubtful", text, probability),) if doubtful else ()
        verdict = {"probability": probability, **inputs}
        return CrackPath(route.points_px, route.width_px, source or "choice", doubts, verdict)

    def route(self, points_px: Floats, clicked: bool) -> Route:
        """Return the cheapest route past the points, from the first cell on the crack to the last.

        Raises InputError if a clicked point is off any line.
        """
        field, stops = self.field, self._on_map(points_px)
        cost, line = field.cost(), np.zeros(field.clear.shape, bool)
        for number in range(1, len(stops) - 1):
            stops[number] = self._snapped(stops[number], points_px[number], cost)
        cells = self._joined(cost, stops, points_px)
        width, line[tuple(cells.T)] = float(np.median(field.width[tuple(cells.T)])), True
        # In a wide crack, a path along the walls is as cheap as in the middle. The middle is where cells are clearest.
        beside = distance_outside(line) <= max(SEARCH_WIDTHS * width, MIN_BESIDE)
        clearest = float(np.percentile(field.clear[beside], CLEAREST))
        cost = np.where(beside, field.cost(max(CLEARNESS_LIMIT, clearest)), ASTRAY * cost)
        cells = self._joined(cost, stops, points_px)
        most_px = self._snap_px + width / field.scale if clicked else len(cells) / field.scale
        cells = self._on_crack(cells, points_px, width, most_px)
        line_px = field.to_photo(cells[:, ::-1])
        width_px = width_along(self._photo, line_px, max(width, 1.0) / field.scale)
        return Route(self._photo, field, cells, line_px, width_px, stops[1:-1] if clicked else stops[:0])

    def _on_map(self, points_px: Floats) -> Integers:
        """Return the row and column of each point, (n, 2), moved to the nearest cell that is searched.

        Raises InputError if a point is too far outside the searched area.
        """
        allowed = np.argwhere(self.field.allowed)
        if len(allowed) == 0:
            raise InputError(f"{self._photo.file}: no part of the sample is near the ends. Check ends_px and roi_px.")
        cells = np.rint(self.field.to_cells(points_px)[:, ::-1])
        # A point outside the map is moved to the map's rim.
        searched = np.clip(cells.astype(int), 0, np.array(self.field.clear.shape) - 1)
        for number in np.flatnonzero(~self.field.allowed[tuple(searched.T)]):
            searched[number] = allowed[nearest_cell(allowed, cells[number])]
        moved_px = lengths(searched - cells) / self.field.scale
        farthest = moved_px.argmax()
        if moved_px[farthest] > self._snap_px:
            raise InputError(
                f"{self._photo.file}: the point {listed(points_px[[farthest]])} is {moved_px[farthest]:.0f} px "
                "outside the searched area. That area is the face of the sample inside roi_px, without markers. "
                "Check ends_px, via_px and roi_px."
            )
        return searched

    def _snapped(self, stop: Integers, point_px: Floats, cost: Floats) -> Integers:
        """Return the row and column of a via point, (2,), moved to the cheapest cell of a nearby line.

        Raises InputError if no line is near.
        """
        clear = np.argwhere((self.field.clear >= ON_CRACK) & self.field.allowed)
        away_px = np.hypot(*(clear - stop).T) / self.field.scale
        near = away_px <= self._snap_px
        if not near.any():
            nearest = f": the nearest one is {too_far(away_px.min(), self._snap_px)}" if len(clear) else ""
            raise InputError(
                f"{self._photo.file}: the via point {listed(point_px[None])} is not on a crack{nearest}. Give a point "
                "inside the crack."
            )
        # Cost grows with distance, so that the point stays on its crack if a darker one is near.
        price = cost[tuple(clear[near].T)] * (1 + (2 * away_px[near] / self._snap_px) ** 2)
        return clear[near][np.argmin(price)]

    def _joined(self, cost: Floats, stops: Integers, points_px: Floats) -> Integers:
        """Return the cheapest legs between the stops as one path, without parts that are passed twice.

        Raises InputError if a leg runs back along the leg before it for longer than a click may be off its crack.
        """
        cells, *legs = cheapest_legs(cost, stops, self.field.scale)
        for number, leg in enumerate(legs, 1):
            apart, nearest = KDTree(cells).query(leg, distance_upper_bound=PATH_CELLS)
            forth = int(np.flatnonzero(np.isfinite(apart))[-1])
            back = int(np.asarray(nearest)[forth])
            spur_px = arc_length(cells[back:].astype(float))[-1] / self.field.scale
            if spur_px > self._snap_px:
                raise InputError(
                    f"{self._photo.file}: after the via point {listed(points_px[[number]])} the path runs back "
                    f"{spur_px:.0f} px along itself, so the point is not on the way to the next one. Give via_px in "
                    "order along the crack, and give no point on a branch."
                )
            cells = np.concatenate([cells[: back + 1], leg[forth + 1 :]])
        return cells

    def _on_crack(self, cells: Integers, points_px: Floats, width: float, limit_px: float) -> Integers:
        """Return the part of a path from the first to the last cell that is clear and darker than the ground.

        Raises InputError if that part begins or ends more than ``limit_px`` from an end of the path.
        """
        clear = maximum_filter1d(self.field.clear_along(cells), 3)
        around = resized(blurred_copy(self.field.shown, SIGMA + 2 * width), self.field.shown.shape)
        light = minimum_filter1d((self.field.shown / np.maximum(around, 1e-3))[tuple(cells.T)], 3)
        dark = light < (1 + float(np.median(light))) / 2
        is_clear = clear >= min(ON_CRACK, SHARE_ON_CRACK * float(np.median(clear)))
        s_px, ends = arc_length(cells.astype(float)) / self.field.scale, []
        for end, away_px in ((0, s_px), (-1, s_px[-1] - s_px)):
            # In coarse grain, the tip of a crack is clear beyond the last dark cell.
            nearest_px = [away_px[places].min(initial=np.inf) for places in (is_clear & dark, is_clear)]
            moved_px = nearest_px[0] if nearest_px[0] <= limit_px else nearest_px[1]
            if moved_px > limit_px:
                raise InputError(
                    f"{self._photo.file}: the end {listed(points_px[[end]])} is not on a crack: the nearest one is "
                    f"{too_far(moved_px, limit_px)}. Give a point inside the crack; {IF_LIGHTER}."
                )
            ends.append(int(np.argmin(np.abs(away_px - moved_px))))
        return cells[ends[0] : ends[1] + 1]
