"""Straight lines through noisy points, and where they meet."""

import numpy as np

from sealtwin.records import Floats


def fit_line(points: Floats) -> tuple[Floats, Floats]:
    """Line of least squares, (2, 2): a point and a direction; and each point's signed distance from it, (n,)."""
    centre = points.mean(axis=0)
    direction = np.linalg.svd(points - centre, full_matrices=False)[2][0]
    return np.array([centre, direction]), (points - centre) @ _across(direction)


def fit_line_to_most(points: Floats, least: float) -> tuple[Floats, Floats]:
    """The same with points left out that lie three median distances off, or ``least`` where that is more.

    Points run along the line. Up to a quarter of them may have been pulled away by a crack, dirt or a pore.
    """
    miss = _miss_of_most(points)
    line = np.empty((2, 2))
    for _ in range(5):
        points = points[np.abs(miss) <= max(least, 3 * float(np.median(np.abs(miss))))]
        line, miss = fit_line(points)
    return line, miss


def meeting(first: Floats, second: Floats) -> Floats:
    """Where two lines, each a point and a direction, cross."""
    (p, u), (q, v) = first, second
    along = np.linalg.solve(np.column_stack([u, -v]), q - p)[0]
    return p + along * u


def _miss_of_most(points: Floats) -> Floats:
    """Distances from the line whose slope is the median of those between points half the line apart (Theil, Sen)."""
    (centre, direction), aside = fit_line(points)
    along = (points - centre) @ direction
    half = len(points) // 2
    run = along[half:] - along[: len(points) - half]
    slope = np.median((aside[half:] - aside[: len(points) - half]) / np.where(run == 0, np.inf, run))
    level = aside - slope * along
    return level - np.median(level)


def _across(direction: Floats) -> Floats:
    return np.array([-direction[1], direction[0]])
