"""Gates: checks of a path between clicks. A gate takes a route and returns a finding with its position, or None.

A gate refuses a path that cannot follow a crack (level "fault"), and warns of a path that may not follow the crack. The
text of a finding has no full stop.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import cv2
import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path.candidates import straight_legs
from digitise.crack_path.hints import IF_LIGHTER, listed, snap_px
from digitise.crack_path.line_map import CLEARNESS_LIMIT, LineMap
from digitise.crack_path.medial_axis import distance_outside
from digitise.crack_path.profiles import finite_median, profiles_across, row_medians
from digitise.geometry.polyline import extended, runs, smoothed
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats, Integers

# Limits in units of clearness, from 115 right paths on real photos and 300 paths beside cracks.
# Minimum median along a path. Paths beside cracks reach at most 2.85, and 2 % of the right paths are below 3
MIN_CLEAR = 3.0
STRETCH, STRETCH_WIDTHS = 24.0, 2.0  # Length of a stretch: cells, or widths of the crack if that is longer
NEAR_GROUND = 2.6  # A stretch with a lower mean gives a warning
LONG = 2.0  # Length of the stretch, as a multiple of the length above, whose mean can refuse a path
AS_GROUND = 2.1  # A path is refused if a stretch of that length has a lower mean

LIGHT_PX = 12.0  # Largest distance from the wall at which a light line is searched for
# Largest step from ground to light line, divided by the step from path to ground. 12 % of the right paths have more
LIGHT = 0.5
# A path is refused if the brightness of the path and of the light line, relative to the ground, is above these values
NOT_DARK, BRIGHT = 0.9, 1.25

LEG_SHARE = 0.15  # Minimum length of a leg along a joint, as a fraction of the path's length
SMOOTHED = 2.0  # Cells over which the steps of the path are smoothed
ONWARD = 28.0  # The joint must go on this many cells, plus two widths, beyond the corner
MIN_APART, APART = 5.0, 1.5  # A cell is off the path if it is farther from it than this: cells, and widths
MIN_ONWARD = 8  # Minimum number of cells ahead that are off the path
GOES_ON = 4.0  # Minimum mean clearness of those cells

BESIDE_PX = 7.0  # A click up to this far from the crack's middle is not reported if the crack is at least as wide

BESIDE_AROUND = 6.0  # A path within this many cells of the surroundings runs along them
# Longest allowed run along the surroundings: widths of the crack, and at least this many cells
AROUND_WIDTHS, MIN_BESIDE = 3.0, 40.0


@dataclass(frozen=True)
class Route:
    """A path on the line map, from the first cell on its crack to the last."""

    photo: Photo
    field: LineMap
    cells: Integers  # Row and column, (n, 2)
    points_px: Floats  # The same points in the photo, x and y in px, (n, 2)
    width_px: float
    clicks_px: Floats

    @cached_property
    def clear(self) -> Floats:
        return self.field.clear_along(self.cells)

    @cached_property
    def s_px(self) -> Floats:
        return arc_length(self.points_px)


def dark_enough(route: Route) -> Fact | None:
    clear = float(np.median(route.clear))
    if clear >= MIN_CLEAR:
        return None
    fault = (
        f"no crack between the ends: the darkest path there has a contrast of {clear:.1f} times the noise (a "
        f"crack has at least {MIN_CLEAR:g} times). Check ends_px; {IF_LIGHTER}"
    )
    return doubt("path.not-dark", fault, clear, level="fault")


def bare_stretch(route: Route) -> Fact | None:
    """Find the longest stretch of the path that is as bright as the ground.

    Clicks at both ends of the stretch confirm that the crack runs there. If the stretch begins or ends the path and a
    click was moved, the click is beside the crack.
    """
    count = int(max(STRETCH, STRETCH_WIDTHS * route.width_px * route.field.scale))
    mean = _means(route.clear, count)
    bounds = runs(mean < NEAR_GROUND)
    if len(bounds) == 0 or len(route.clear) < 2 * count:
        return None
    first, last = max(bounds.tolist(), key=lambda stretch: stretch[1] - stretch[0])
    ends = [first, min(last + count - 1, len(route.clear) - 1)]
    where = f"{route.s_px[ends[1]] - route.s_px[ends[0]]:.0f} px from {listed(route.points_px[ends])} px"
    if (first == 0 or last == len(mean)) and moved_click(route):
        text = f"an end is not on a crack: beside it, {where} are plain ground. Check ends_px"
        return doubt("path.end-beside", text, level="fault")
    clicked_px = np.linalg.norm(route.points_px[ends][:, None] - route.clicks_px, axis=2).min(axis=1)
    if _means(route.clear, int(LONG * count)).min() < AS_GROUND and clicked_px.max() > snap_px(route.photo):
        crosses = (
            f"the path crosses plain ground: {where} are as bright as the ground. Give a point of the crack between "
            "the ends in photo.via_px. If the crack does run there, give both of these points"
        )
        return doubt("path.bare-stretch", crosses, level="fault")
    return doubt(
        "path.bare-stretch",
        f"part of the path shows hardly any crack and may cross plain ground: {where}. Check that part of the photo, "
        "and give a point of the crack between the ends in photo.via_px",
    )


def _means(values: Floats, count: int) -> Floats:
    """Return the mean of every ``count`` consecutive values. If there are fewer values, return their mean, (1,)."""
    return np.convolve(values, np.ones(min(count, len(values))) / min(count, len(values)), mode="valid")


def lighter_line(route: Route) -> Fact | None:
    """Find a line beside the path that is much lighter than the ground.

    Such a line may be a light crack, and the path its shadow.
    """
    half_px = max(route.width_px, 2.0) / 2
    profiles = profiles_across(route.photo, route.points_px, route.width_px, half_px + 2 * LIGHT_PX)
    light, away_px = profiles.mean(), profiles.away_px
    dark = np.nan_to_num(light[:, away_px <= half_px], nan=np.inf).min(axis=1)
    ground = row_medians(light[:, away_px > half_px + LIGHT_PX])
    near = (away_px > half_px / 2) & (away_px <= half_px + LIGHT_PX)
    sides = [np.nan_to_num(light[:, near & (side * profiles.offset_px > 0)], nan=0).max(axis=1) for side in (1, -1)]
    steps = [finite_median((side - ground) / np.fmax(ground - dark, 1e-3)) for side in sides]
    if not max(steps) > LIGHT:
        return None
    times = finite_median(sides[int(np.argmax(steps))] / np.fmax(ground, 1e-6))
    darkness = finite_median(dark / np.fmax(ground, 1e-6))
    text = (
        f"a line {times:.1f} times as bright as the ground runs within {half_px + LIGHT_PX:.0f} px of the path, from "
        f"{listed(route.points_px[[0, -1]])} px; {IF_LIGHTER}"
    )
    refused = darkness > NOT_DARK and times > BRIGHT
    return doubt("path.lighter-line", text, times, level="fault" if refused else "caution")


def along_joint(route: Route) -> Fact | None:
    """Find a straight leg of the path on a line that continues straight where the path turns off, as a joint does."""
    cells = smoothed(route.cells[:, ::-1].astype(float), SMOOTHED)
    width = max(route.width_px * route.field.scale, 1.0)
    corners, least = straight_legs(cells, width)
    places = np.asarray(KDTree(cells).query(corners)[1])
    s = arc_length(cells)
    least, beyond = max(least, LEG_SHARE * s[-1]), ONWARD + 2 * width
    clear = cv2.dilate(np.minimum(route.field.clear, CLEARNESS_LIMIT), np.ones((3, 3), np.uint8))
    path, joints = KDTree(cells), []
    for first, last in pairwise(places.tolist()):
        length = float(s[last] - s[first])
        for corner, other in ((last, first), (first, last)):
            ahead = (cells[corner] - cells[other]) / max(length, 1.0)
            onward = cells[corner] + np.arange(beyond)[:, None] * ahead
            apart = np.asarray(path.query(onward)[0]) > max(MIN_APART, APART * width)
            column, row = np.rint(onward).astype(int).T
            shown = apart & (column >= 0) & (row >= 0) & (column < clear.shape[1]) & (row < clear.shape[0])
            if length >= least and shown.sum() >= MIN_ONWARD and clear[row[shown], column[shown]].mean() >= GOES_ON:
                joints.append((length, first, last))
    if not joints:
        return None
    length, first, last = max(joints)
    joint_px = length / route.field.scale
    return doubt(
        "path.along-joint",
        f"{joint_px:.0f} px of the path, from {listed(route.points_px[[first, last]])} px, follow a line as straight "
        "as a joint. If the crack is elsewhere, give points of the crack between the ends in photo.via_px",
        joint_px,
        "px",
    )


def moved_click(route: Route) -> Fact | None:
    """Find a click that is outside a wide crack, or farther from the path than a thin crack is wide."""
    # A crack fades at its tip, so a click there may be beyond the end of the path.
    ahead_px = snap_px(route.photo)
    line_px = extended(route.points_px, ahead_px, ahead_px, 2 * route.width_px, 1.0)
    away_px, nearest = KDTree(line_px).query(route.clicks_px)
    farthest = int(np.argmax(away_px))
    if away_px[farthest] <= max(route.width_px / 2, min(route.width_px, BESIDE_PX), 1 / route.field.scale):
        return None
    places = listed(np.array([route.clicks_px[farthest], line_px[np.asarray(nearest)[farthest]]]))
    moved_px = float(away_px[farthest])
    text = f"a click was moved by {moved_px:.0f} px onto the nearest line, from {places} px"
    return doubt("path.moved-click", text, moved_px, "px")


def along_surroundings(route: Route) -> Fact | None:
    """Find a long part of the path beside dark surroundings. The surroundings may in truth be a wide crack."""
    if not route.field.around.any():
        return None
    near = distance_outside(route.field.around)[tuple(route.cells.T)] <= BESIDE_AROUND
    beside_px = float(np.diff(route.s_px)[near[1:] & near[:-1]].sum())
    if beside_px <= max(AROUND_WIDTHS * route.width_px, MIN_BESIDE / route.field.scale):
        return None
    return doubt(
        "path.along-surroundings",
        f"{beside_px:.0f} px of the path, from {listed(route.points_px[near][[0, -1]])} px, run along a dark region "
        "at the photo's border, which was taken for the surroundings of the sample. If that region is the crack, "
        "paint it in photo.mask, or give photo.roi_px as a region whose border crosses the dark area and does not "
        "run along it",
        beside_px,
        "px",
    )


GATES: tuple[Callable[[Route], Fact | None], ...] = (
    dark_enough,
    bare_stretch,
    lighter_line,
    along_joint,
    moved_click,
    along_surroundings,
)
