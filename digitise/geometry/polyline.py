"""Geometry of open polylines and rings in the plane. Both are (n, 2) arrays in one unit, and y points up."""

import numpy as np
from manifold3d import CrossSection, FillRule
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.arrays import Booleans, Floats, Integers, counted_up, cross, lengths
from sealtwin.core.solid_figures import Box

ROWS_PER_PX = 8  # Number of sub-rows of a pixel. With 8, the covered fraction of a pixel at an edge is right to 0.01
AT_ONCE = 64  # Number of segments compared with all others at a time: all pairs of 100,000 do not fit in memory


def resampled(points: Floats, spacing: float) -> Floats:
    """Return points at equal steps of arc length, as close to ``spacing`` as possible. Both ends are kept."""
    s = arc_length(points)
    stations = np.linspace(0, s[-1], max(2, 1 + round(s[-1] / spacing)))
    return at_arc_length(points, s, stations)


def smoothed(values: Floats, sigma: float, returns: int = 1) -> Floats:
    """Smooth values along the first axis with a Gaussian. ``sigma`` is in samples.

    The residual is then smoothed and added, ``returns`` times, which keeps more of the shape (Tukey's twicing).
    """
    if len(values) < 3 or sigma <= 0:
        return values
    pad = min(len(values) - 1, int(4 * sigma) + 1)

    def blurred(rest: Floats) -> Floats:
        around = np.pad(rest, [(pad, pad), *[(0, 0)] * (rest.ndim - 1)], "reflect", reflect_type="odd")
        return gaussian_filter1d(around, sigma, axis=0)[pad : pad + len(rest)]

    smooth = blurred(values)
    for _ in range(returns):
        smooth = smooth + blurred(values - smooth)
    return smooth


def tangents(points: Floats) -> Floats:
    """Return the unit vector along the polyline at each point, (n, 2)."""
    along = np.gradient(points, axis=0)
    return along / np.linalg.norm(along, axis=1, keepdims=True)


def left_normals(points: Floats) -> Floats:
    """Return the unit vector to the left of the polyline at each point, (n, 2)."""
    return to_left(tangents(points))


def places_beside(points: Floats, offset: Floats, normal: Floats | None = None) -> Floats:
    """Return the point at each offset to the left of each point, (points, offsets, 2).

    ``normal`` may give smoother normals, (points, 2).
    """
    return points[:, None] + offset[:, None] * (left_normals(points) if normal is None else normal)[:, None]


def extended(points: Floats, before: float, after: float, over: float, spacing: float) -> Floats:
    """Return the polyline with a straight piece added at each end.

    The pieces have the lengths ``before`` and ``after``. Each has the mean direction of the polyline over the length
    ``over`` next to its end.
    """
    s = arc_length(points)
    # If the last segment is longer than ``over``, its direction is used.
    near, far = points[: max(2, int((s <= over).sum()))], points[-max(2, int((s >= s[-1] - over).sum())) :]
    backward = np.arange(spacing, before + spacing / 2, spacing)[::-1, None] * unit(near[0] - near[-1])
    forward = np.arange(spacing, after + spacing / 2, spacing)[:, None] * unit(far[-1] - far[0])
    return np.concatenate([near[0] + backward, points, far[-1] + forward])


def without_loops(points: Floats) -> Floats:
    """Return the polyline with the points of each loop moved to the point where the loop crosses itself.

    Offset lines have loops at bends whose radius is smaller than the offset.
    """
    tight = points.copy()
    for first, second in crossings(points):
        step = np.diff(tight, axis=0)
        tight[first + 1 : second + 1] = meeting((tight[first], step[first]), (tight[second], step[second]))
    return tight


def crossings(points: Floats, closed: bool = False) -> list[tuple[int, int]]:
    """Return pairs of crossing segments. A segment is given by the index of its first point.

    If loops are nested, only the outermost is returned. Segments that share a point do not cross.
    """
    start = points if closed else points[:-1]
    end = np.roll(points, -1, axis=0) if closed else points[1:]
    low, high, number = np.minimum(start, end), np.maximum(start, end), np.arange(len(start))

    def apart(first: Integers, other: Integers) -> Booleans:
        """Return True if the ends of the first segment are on opposite sides of the line along the other."""
        step = end[first] - start[first]
        return cross(step, start[other] - start[first]) * cross(step, end[other] - start[first]) < 0

    pairs, beyond = [], -1
    for begin in range(0, len(start) - 2, AT_ONCE):
        first = number[begin : begin + AT_ONCE, None]
        # In a long line, few segments are near a given run of segments.
        others = number[begin + 2 :]
        near = (low[others] <= high[first].max(axis=0)) & (high[others] >= low[first].min(axis=0))
        others = others[near.all(axis=1)][None]
        crossed = (others > first + 1) & apart(first, others) & apart(others, first)
        # A segment's last crossing counts; a crossing that begins inside an earlier pair does not.
        for row in np.flatnonzero(crossed.any(axis=1)).tolist():
            if begin + row > beyond:
                beyond = int(others[0, crossed[row]].max())
                pairs.append((begin + row, beyond))
    return pairs


def uncrossed(ring: Floats) -> Floats:
    """Return the region that a counter-clockwise ring encloses, as a ring that does not cross itself, (n, 2).

    If there are several such regions, the largest is returned.
    """
    return _largest(CrossSection([ring], FillRule.Positive)) if crossings(ring, closed=True) else ring


def _largest(region: CrossSection) -> Floats:
    rings = (np.asarray(ring, float) for ring in region.to_polygons())
    return max(rings, key=signed_area, default=np.empty((0, 2)))


def meeting(first: tuple[Floats, Floats] | Floats, second: tuple[Floats, Floats] | Floats) -> Floats:
    """Return the intersection of two lines, (2,). A line is given by a point and a direction."""
    (p, u), (q, v) = first, second
    return p + np.linalg.solve(np.column_stack([u, -v]), q - p)[0] * u


def depth_inside(points: Floats, box: Box) -> Floats:
    """Return the distance of each point, (..., 2), from a rectangle's boundary. It is negative outside."""
    beside = np.maximum(box[:2] - points, points - box[2:])
    around = np.hypot(*np.moveaxis(np.maximum(beside, 0), -1, 0))
    return np.where(around > 0, -around, -beside.max(axis=-1))


def nearest_side(point: Floats, box: Box) -> int:
    """Return the side of the box that is closest to the point, as an index into the box."""
    return int(np.argmin([abs(point[side % 2] - box[side]) for side in range(4)]))


def on_side(point: Floats, box: Box) -> Floats:
    """Return the point moved onto the nearest side of a box, (2,)."""
    side, moved = nearest_side(point, box), point.copy()
    moved[side % 2] = box[side]
    return moved


def rectangle(box: Box) -> Floats:
    """Return the corners of a box, (4, 2): lower left, lower right, upper right, upper left."""
    x_min, y_min, x_max, y_max = box
    return np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]], float)


def project(homography: Floats, points: Floats) -> Floats:
    """Map points, (n, 2), through a (3, 3) homography."""
    lifted = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return lifted[:, :2] / lifted[:, 2:]


def clipped_to_box(ring: Floats, box: Box) -> Floats:
    """Return the largest part of a counter-clockwise ring inside a rectangle. It may be empty."""
    return _largest(CrossSection([ring]) ^ CrossSection([rectangle(box)]))


def without_repeats(ring: Floats, closer_than: float) -> Floats:
    """Return a ring without points whose distance from the point before them is at most ``closer_than``."""
    step = lengths(ring - np.roll(ring, 1, axis=0))
    return ring[step > closer_than]


def signed_area(ring: Floats) -> float:
    """Return the area of a ring. It is positive if the ring runs counter-clockwise."""
    return float(cross(ring, np.roll(ring, -1, axis=0)).sum() / 2)


def to_left(vector: Floats) -> Floats:
    """Return plane vectors, (..., 2), rotated by 90 degrees to the left."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def unit(vector: Floats) -> Floats:
    """Return the vector divided by its length."""
    return vector / np.linalg.norm(vector)


def coverage(ring: Floats, size_px: tuple[int, int]) -> NDArray[np.float32]:
    """Return the fraction of each pixel that is inside a ring, (height, width).

    OpenCV's fill is not used because it would add half a pixel.
    """
    width, height = size_px
    start, end = ring, np.roll(ring, -1, axis=0)
    low, high = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
    # Sub-row r is sampled at y = (r + 0.5) / ROWS_PER_PX - 0.5.
    first = np.maximum(np.ceil((low + 0.5) * ROWS_PER_PX - 0.5), 0).astype(int)
    last = np.minimum(np.ceil((high + 0.5) * ROWS_PER_PX - 0.5), height * ROWS_PER_PX).astype(int)
    edge, row = counted_up(last - first, first)
    y = (row + 0.5) / ROWS_PER_PX - 0.5
    (x0, y0), (x1, y1) = start[edge].T, end[edge].T
    x = np.clip(x0 + (y - y0) * (x1 - x0) / (y1 - y0) + 0.5, 0, width)
    sign = np.sign(y1 - y0) / ROWS_PER_PX
    column = np.floor(x).astype(int)
    steps = np.zeros((height, width + 2), np.float64)
    np.add.at(steps, (row // ROWS_PER_PX, column), sign * (column + 1 - x))
    np.add.at(steps, (row // ROWS_PER_PX, column + 1), sign * (x - column))
    return np.abs(np.cumsum(steps, axis=1)[:, :width]).astype(np.float32)
