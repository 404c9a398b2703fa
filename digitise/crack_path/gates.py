"""Gates: what a path between clicks must not be. Each takes a route and returns a finding with its place, or None.

A gate refuses a path that cannot be along a crack, by a fault, and doubts one that may be along something else. Its
sentence has no full stop.
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

# Limits, in units of clearness, on 115 right paths of real photos and on 300 ways between places of bare ground.
LEAST_CLEAR = 3.0  # Least median along a path: the ways over ground have 2.85 at most, 2 % of the right paths less
STRETCH, STRETCH_WIDTHS = 24.0, 2.0  # Length of a stretch in cells and in widths of the crack, the longer of both
NEAR_GROUND = 2.6  # Least mean of a stretch without a doubt
LONG = 2.0  # Such lengths over which the mean is taken for a refusal
AS_GROUND = 2.1  # Least mean over them that is not refused

LIGHT_PX = 12.0  # Distance from the wall up to which a light line is searched for
LIGHT = 0.5  # Step from ground to the light line over that from path to ground: 12 % of the right paths have more
NOT_DARK, BRIGHT = 0.9, 1.25  # Light of the path and of the light line over the ground's, above which it is refused

LEG_SHARE = 0.15  # Least length of a leg along a joint over the path's
SMOOTHED = 2.0  # Cells over which the steps of the path are smoothed
ONWARD = 28.0  # Cells beyond the corner, plus two widths, at which the joint goes on
LEAST_APART, APART = 5.0, 1.5  # Distance from the path at which a place is not the path: cells, and widths
LEAST_ONWARD = 8  # Least such places
GOES_ON = 4.0  # Least mean clearness there

BESIDE_PX = 7.0  # Distance from the middle of a crack at which a click is still on it, if the crack is as wide

BESIDE_AROUND = 6.0  # Cells from the surroundings within which a path runs along them
AROUND_WIDTHS, LEAST_BESIDE = 3.0, 40.0  # Length over which it may: widths, and least cells


@dataclass(frozen=True)
class Route:
    """A path on the line map, from the first place on its crack to the last."""

    photo: Photo
    field: LineMap
    cells: Integers  # Rows and columns, (n, 2)
    points_px: Floats  # The same in the photo, x and y
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
    if clear >= LEAST_CLEAR:
        return None
    fault = (
        f"no crack between the ends: the darkest way there is {clear:.1f} times as dark as the ground's grain (at "
        f"least {LEAST_CLEAR:g} times along a crack); check ends_px; {IF_LIGHTER}"
    )
    return doubt("path.not-dark", fault, clear, level="fault")


def bare_stretch(route: Route) -> Fact | None:
    """Find the longest stretch that is as bright as the ground. Clicks at both of its ends confirm it.

    A click that was moved to the beginning of such a stretch is beside the crack.
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
        text = f"an end is not on a crack: beside it are {where} of plain ground; check ends_px"
        return doubt("path.end-beside", text, level="fault")
    clicked_px = np.linalg.norm(route.points_px[ends][:, None] - route.clicks_px, axis=2).min(axis=1)
    if _means(route.clear, int(LONG * count)).min() < AS_GROUND and clicked_px.max() > snap_px(route.photo):
        crosses = (
            f"the path crosses plain ground: {where} are as bright as the ground. Give a point of the crack between "
            "the ends in photo.via_px. If the crack runs there, give both of these places"
        )
        return doubt("path.bare-stretch", crosses, level="fault")
    return doubt(
        "path.bare-stretch",
        f"part of the path shows hardly any crack and may cross plain ground: {where}. Look there, and give a point of "
        "the crack between the ends in photo.via_px",
    )


def _means(values: Floats, count: int) -> Floats:
    """Return the mean of every ``count`` values that follow each other, or of all if there are fewer."""
    return np.convolve(values, np.ones(min(count, len(values))) / min(count, len(values)), mode="valid")


def lighter_line(route: Route) -> Fact | None:
    """Find a line beside the path that is much lighter than the ground: the path may be the shade of a light crack."""
    half_px = max(route.width_px, 2.0) / 2
    profiles = profiles_across(route.photo, route.points_px, route.width_px, half_px + 2 * LIGHT_PX)
    light, away_px = profiles.mean(), np.abs(profiles.offset_px)
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
        f"{listed(route.points_px[[0, -1]])} px: {IF_LIGHTER}"
    )
    refused = darkness > NOT_DARK and times > BRIGHT
    return doubt("path.lighter-line", text, times, level="fault" if refused else "caution")


def along_joint(route: Route) -> Fact | None:
    """Find a straight leg of the path that goes on straight where the path turns off it, as a joint does."""
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
            apart = np.asarray(path.query(onward)[0]) > max(LEAST_APART, APART * width)
            column, row = np.rint(onward).astype(int).T
            shown = apart & (column >= 0) & (row >= 0) & (column < clear.shape[1]) & (row < clear.shape[0])
            if length >= least and shown.sum() >= LEAST_ONWARD and clear[row[shown], column[shown]].mean() >= GOES_ON:
                joints.append((length, first, last))
    if not joints:
        return None
    length, first, last = max(joints)
    joint_px = length / route.field.scale
    return doubt(
        "path.along-joint",
        f"{joint_px:.0f} px of the path, from {listed(route.points_px[[first, last]])} px, run along a line as "
        "straight as a joint. If the crack is elsewhere, give points of it between the ends in photo.via_px",
        joint_px,
        "px",
    )


def moved_click(route: Route) -> Fact | None:
    """Find a clicked end or point that is farther beside the path than the crack is wide, or outside a wide crack."""
    # A crack fades at its tip: there a click may be ahead of the path.
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
    """Find a long part of the path beside dark surroundings, which may be a wide crack taken for them."""
    if not route.field.around.any():
        return None
    near = distance_outside(route.field.around)[tuple(route.cells.T)] <= BESIDE_AROUND
    beside_px = float(np.diff(route.s_px)[near[1:] & near[:-1]].sum())
    if beside_px <= max(AROUND_WIDTHS * route.width_px, LEAST_BESIDE / route.field.scale):
        return None
    return doubt(
        "path.along-surroundings",
        f"{beside_px:.0f} px of the path, from {listed(route.points_px[near][[0, -1]])} px, run along a dark region at "
        "the photo's border, which was taken for the surroundings of the sample. If it is the crack, paint it in "
        "photo.mask, or give photo.roi_px: a region whose border crosses the dark area and does not run along it",
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
