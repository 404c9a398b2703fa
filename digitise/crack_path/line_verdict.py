"""Judge a path by one probability that it follows a crack, and name the reason against it with its place.

The probability p of an input vector x is a logistic regression with a share ``LAPSE`` that no input explains:
p = LAPSE + (1 - 2 LAPSE) / (1 + exp(-(CONSTANT + sum of weight times x))).

The weights are fitted to routes on 244 photos of eight public sets. More than half of the routes are wrong on purpose:
clicks on bare ground, on a joint, on two cracks, clicks moved by 10 to 40 px, and cracks in negatives. The hit rate is
that of each set by a fit without this set: ``python -m benchmarks.line_verdict``.
"""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path.hints import IF_LIGHTER, listed
from digitise.crack_path.line_map import LineMap
from digitise.crack_path.medial_axis import distance_outside
from digitise.crack_path.profiles import finite_median, profiles_across, row_medians
from digitise.geometry.polyline import smoothed
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length, step_lengths
from sealtwin.core.records import Floats, Integers


class Weight(NamedTuple):
    """Weight of an input in the log odds, and the input's median along right paths."""

    weight: float
    usual: float


CONSTANT, LAPSE = 0.737, 0.01
WEIGHTS = {
    # -log of the share of cells away from the path that are clearer than its barest stretch
    "clearest": Weight(0.946, 4.62),
    # Share of the path in stretches as bright as the ground
    "bare": Weight(-7.614, 0.0),
    # Step from the ground to a light line beside the path, divided by the step from the path to the ground
    "light_beside": Weight(-1.046, 0.154),
    # Length of the longest straight leg divided by the path's length
    "straight": Weight(-6.218, 0.165),
    # Log of the path's length divided by the distance of its ends
    "winding": Weight(-3.708, 0.1),
}
# Probability below which a path is refused or gives a caution, and above which a line that was found is taken. Chosen
# on routes whose probability comes from a fit without their set
REFUSED, DOUBTED, TAKEN = 0.05, 0.545, 0.9
# A light line this much above the ground, in steps from the path to the ground, gives a caution by itself: the crack
# may be the light line, and the path its shade. Of 242 such lines that were painted beside real cracks, 3 of 4 are said
LIGHT = 0.75

STRETCH, STRETCH_WIDTHS = 24, 2.0  # Length of a stretch: cells, or widths of the crack if that is longer
LONG = 48  # The same of the barest stretch
NEAR_GROUND = 2.6  # Clearness below which a stretch is as bright as the ground
FEWEST = 1e-3  # Added to the share of clearer cells, which may be 0
APART, APART_WIDTHS = 8.0, 1.5  # Cells farther from the path than this, in cells and widths, are compared with it
LIGHT_PX = 12.0  # Largest distance from the wall at which a light line is searched for
LIGHT_RANGE = -1.0, 4.0
BARE = "it is hardly darker than the ground"
STRAIGHT = 1.5  # Largest distance of a straight leg from its chord, in cells
SMOOTHED = 2.0  # Cells over which the steps of the path are smoothed


@dataclass(frozen=True)
class Route:
    """A path on the line map, from the first cell on its crack to the last."""

    photo: Photo
    field: LineMap
    cells: Integers  # Row and column, (n, 2)
    points_px: Floats  # The same points in the photo, x and y in px, (n, 2)
    width_px: float
    via: Integers  # Row and column of each clicked point between the ends, (m, 2)


class LineVerdict(NamedTuple):
    """Probability that a path follows a crack, with the inputs that it follows from, by the names of ``WEIGHTS``."""

    probability: float
    inputs: dict[str, float]
    reason: str  # The strongest reason against the path, with its place
    doubtful: bool  # False if a via point is on the stretch that the reason names


def judge(route: Route) -> LineVerdict:
    """Return the verdict on a path."""
    field, points_px, width = route.field, route.points_px, route.width_px * route.field.scale
    clear, on_path = field.clear_along(route.cells), np.zeros(field.clear.shape, bool)
    on_path[tuple(route.cells.T)] = True
    apart = distance_outside(on_path) > max(APART, APART_WIDTHS * width)
    others = field.clear_along(np.argwhere(apart & field.allowed))
    means, longer = (_means(clear, max(cells, STRETCH_WIDTHS * width)) for cells in (STRETCH, LONG))
    steps = smoothed(route.cells[:, ::-1].astype(float), SMOOTHED).astype(np.float32)
    corners = np.asarray(cv2.approxPolyDP(steps, STRAIGHT, False)[:, 0], float)
    legs, ends = step_lengths(corners), (0, len(clear) - 1)
    longest = int(np.argmax(legs))
    step, times = _light_beside(route)
    inputs = {
        "clearest": -float(np.log(np.mean(others >= longer.min()) + FEWEST)) if len(others) else 0.0,
        "bare": float(np.mean(means < NEAR_GROUND)),
        "light_beside": step,
        "straight": float(legs[longest] / max(legs.sum(), 1.0)),
        "winding": float(np.log(arc_length(points_px)[-1] / max(np.linalg.norm(points_px[-1] - points_px[0]), 1.0))),
    }
    odds = CONSTANT + sum(WEIGHTS[name].weight * value for name, value in inputs.items())
    against = {name: WEIGHTS[name].weight * (value - WEIGHTS[name].usual) for name, value in inputs.items()}
    barest = int(longer.argmin())
    bare, along = (barest, barest + len(clear) - len(longer)), KDTree(steps)
    reasons = {
        "clearest": (bare, BARE),
        "bare": (bare, BARE),
        "light_beside": (ends, f"a line {times:.1f} times as bright as the ground is beside it; {IF_LIGHTER}"),
        "straight": (along.query(corners[longest : longest + 2])[1], "it is as straight as a joint"),
        "winding": (ends, "it winds like a path over bare ground"),
    }
    probability, light = LAPSE + (1 - 2 * LAPSE) / (1 + float(np.exp(-odds))), step > LIGHT
    stretch, text = reasons["light_beside" if light else min(against, key=lambda name: against[name])]
    reached = np.asarray(along.query(route.via[:, ::-1])[1])
    confirmed = bool(((reached >= stretch[0]) & (reached <= stretch[1])).any())
    return LineVerdict(
        probability,
        inputs,
        f"from {listed(points_px[list(stretch)])} px {text}. If it is the crack, give points of it in photo.via_px",
        not confirmed and (light or probability < DOUBTED),
    )


def _means(values: Floats, count: float) -> Floats:
    """Return the mean of every ``count`` consecutive values, or of a third of the values if that is fewer."""
    # Both ends of a short path may be in legs of a crack, and its middle on the ground between them.
    count = min(int(count), max(len(values) // 3, 1))
    return np.convolve(values, np.ones(count) / count, mode="valid")


def _light_beside(route: Route) -> tuple[float, float]:
    """Return the input ``light_beside``, and how many times as bright as the ground the light line is.

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
    brighter = int(np.argmax(steps))
    times = finite_median(sides[brighter] / np.fmax(ground, 1e-6))
    return float(np.clip(steps[brighter], *LIGHT_RANGE)), times
