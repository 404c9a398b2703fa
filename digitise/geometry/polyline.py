"""Small geometry of open polylines and rings in the plane; (n, 2) arrays in any one unit, y up."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sealtwin.records import Floats, arc_length

Box = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max."""


def resampled(points: Floats, spacing: float) -> Floats:
    """Points at equal steps of arc length, as close to ``spacing`` as fits; both ends kept."""
    s = arc_length(points)
    stations = np.linspace(0, s[-1], max(2, 1 + round(s[-1] / spacing)))
    return at_arc_length(points, s, stations)


def at_arc_length(values: Floats, s: Floats, stations: Floats) -> Floats:
    """Each column of ``values``, known at ``s``, linearly at ``stations``."""
    return np.column_stack([np.interp(stations, s, column) for column in values.T])


def smoothed(values: Floats, sigma: float, returns: int = 1) -> Floats:
    """Gaussian along the first axis, sigma in samples, then what it took away, smoothed, back again, ``returns`` times.

    A single Gaussian cuts every corner and shortens a wandering line; twicing (Tukey) leaves far more of it, and the
    more so the more often: four returns keep all that is longer than 4 sigma, and little of what is shorter than half
    of that. The ends stay where they are: odd reflection.
    """
    smooth = _blurred(values, sigma)
    for _ in range(returns):
        smooth = smooth + _blurred(values - smooth, sigma)
    return smooth


def _blurred(values: Floats, sigma: float) -> Floats:
    if len(values) < 3 or sigma <= 0:
        return values
    pad = min(len(values) - 1, int(4 * sigma) + 1)
    before = 2 * values[:1] - values[pad:0:-1]
    after = 2 * values[-1:] - values[-2 : -pad - 2 : -1]
    return gaussian_filter1d(np.concatenate([before, values, after]), sigma, axis=0)[pad : pad + len(values)]


def tangents(points: Floats) -> Floats:
    """Unit vectors along the polyline."""
    along = np.gradient(points, axis=0)
    return along / np.linalg.norm(along, axis=1, keepdims=True)


def left_normals(points: Floats) -> Floats:
    """Unit vectors to the left of travel."""
    along = tangents(points)
    return np.column_stack([-along[:, 1], along[:, 0]])


def extended(points: Floats, before: float, after: float, over: float, spacing: float) -> Floats:
    """The polyline with a straight piece at each end, in the mean direction of the ``over`` next to it."""
    s = arc_length(points)
    near, far = points[s <= over], points[s >= s[-1] - over]
    backward = np.arange(spacing, before + spacing / 2, spacing)[::-1, None] * _unit(near[0] - near[-1])
    forward = np.arange(spacing, after + spacing / 2, spacing)[:, None] * _unit(far[-1] - far[0])
    return np.concatenate([near[0] + backward, points, far[-1] + forward])


def without_loops(points: Floats) -> Floats:
    """A polyline whose loops are pulled tight: their points move to where it crosses itself, and their number stays.

    A line offset by more than its radius of curvature makes such loops.
    """
    tight = points.copy()
    for first, second in crossings(points):
        here, there = tight[first : first + 2], tight[second : second + 2]
        tight[first + 1 : second + 1] = _meeting(here, there)
    return tight


def crossings(points: Floats, closed: bool = False) -> list[tuple[int, int]]:
    """Pairs of segments, by their first points, that cross; of loops within loops the outermost only.

    Neighbours, which share a point, do not count.
    """
    start = points if closed else points[:-1]
    end = np.roll(points, -1, axis=0) if closed else points[1:]
    low, high = np.minimum(start, end), np.maximum(start, end)
    found, beyond = [], -1
    for first in range(len(start) - 2):
        if first <= beyond:
            continue
        later = np.arange(first + 2, len(start) - (1 if closed and first == 0 else 0))
        near = later[np.all((low[later] <= high[first]) & (high[later] >= low[first]), axis=1)]
        crossed = [int(second) for second in near if _cross(start[first], end[first], start[second], end[second])]
        if crossed:
            beyond = crossed[-1]
            found.append((first, beyond))
    return found


def uncrossed(ring: Floats) -> Floats:
    """What a counter-clockwise ring encloses once, as one simple ring: the largest, where it falls apart."""
    if not crossings(ring, closed=True):
        return ring
    from manifold3d import CrossSection, FillRule

    pieces = [np.asarray(piece, dtype=float) for piece in CrossSection([ring], FillRule.Positive).to_polygons()]
    return max(pieces, key=signed_area, default=np.empty((0, 2)))


def _cross(a: Floats, b: Floats, c: Floats, d: Floats) -> bool:
    """Whether two segments properly cross."""

    def side(p: Floats, q: Floats, r: Floats) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0


def _meeting(first: Floats, second: Floats) -> Floats:
    """Where the lines through two segments cross."""
    u, v = first[1] - first[0], second[1] - second[0]
    along = np.linalg.solve(np.column_stack([u, -v]), second[0] - first[0])[0]
    return first[0] + along * u


def depth_inside(points: Floats, box: Box) -> Floats:
    """Distance of each point from the nearest side of a rectangle; negative outside, (n,)."""
    x_min, y_min, x_max, y_max = box
    x, y = points.T
    beside = np.maximum(np.maximum(x_min - x, x - x_max), np.maximum(y_min - y, y - y_max))
    around = np.hypot(np.maximum(np.maximum(x_min - x, x - x_max), 0), np.maximum(np.maximum(y_min - y, y - y_max), 0))
    return np.where(beside > 0, -around, -beside)


def on_side(point: Floats, box: Box) -> Floats:
    """The place on the nearest side of a rectangle, (2,)."""
    x_min, y_min, x_max, y_max = box
    side = int(np.argmin(np.abs(np.array([point[0] - x_min, point[1] - y_min, point[0] - x_max, point[1] - y_max]))))
    moved = point.copy()
    moved[side % 2] = box[side]
    return moved


def rectangle(box: Box) -> Floats:
    """Its corners: lower left, lower right, upper right, upper left."""
    x_min, y_min, x_max, y_max = box
    return np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]], dtype=float)


def project(homography: Floats, points: Floats) -> Floats:
    """Points through a (3, 3) homography."""
    lifted = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return lifted[:, :2] / lifted[:, 2:]


def clipped_to_box(ring: Floats, box: Box) -> Floats:
    """The part of a ring inside a rectangle (Sutherland and Hodgman); empty where they do not meet."""
    x_min, y_min, x_max, y_max = box
    for axis, limit, sign in ((0, x_min, 1), (0, x_max, -1), (1, y_min, 1), (1, y_max, -1)):
        inside = sign * (ring[:, axis] - limit)
        clipped = []
        for here, there, depth, next_depth in zip(
            ring, np.roll(ring, -1, axis=0), inside, np.roll(inside, -1), strict=True
        ):
            if depth >= 0:
                clipped.append(here)
            if (depth >= 0) != (next_depth >= 0):
                crossing = here + (there - here) * depth / (depth - next_depth)
                crossing[axis] = limit
                clipped.append(crossing)
        if not clipped:
            return np.empty((0, 2))
        ring = np.array(clipped)
    return ring


def without_repeats(ring: Floats, closer_than: float) -> Floats:
    """A ring less the points that lie on their predecessor."""
    step = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
    return ring[step > closer_than]


def signed_area(ring: Floats) -> float:
    """Positive where the ring runs counter-clockwise."""
    x, y = ring.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)
