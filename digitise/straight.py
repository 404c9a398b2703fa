"""Straight lines through noisy points, and where they meet."""

import numpy as np

from sealtwin.records import Floats


def fit_line(points: Floats) -> tuple[Floats, Floats]:
    """Line of least squares, (2, 2): a point and a direction; and each point's signed distance from it, (n,)."""
    centre = points.mean(axis=0)
    direction = np.linalg.svd(points - centre, full_matrices=False)[2][0]
    return np.array([centre, direction]), (points - centre) @ np.array([-direction[1], direction[0]])


def fit_line_to_most(points: Floats, least: float) -> tuple[Floats, Floats]:
    """The same with points left out that lie three median distances off, or ``least`` where that is more.

    Median, since what a crack or a pore has pulled away lies far off.
    """
    line, miss = fit_line(points)
    for _ in range(5):
        points = points[np.abs(miss) <= max(least, 3 * float(np.median(np.abs(miss))))]
        line, miss = fit_line(points)
    return line, miss


def meeting(first: Floats, second: Floats) -> Floats:
    """Where two lines, each a point and a direction, cross."""
    (p, u), (q, v) = first, second
    along = np.linalg.solve(np.column_stack([u, -v]), q - p)[0]
    return p + along * u
