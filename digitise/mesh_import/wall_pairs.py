"""Pairs of places on the two walls of a crack that face each other."""

import numpy as np

from sealtwin.core.records import Floats, Integers

BOTH, LEFT, RIGHT = 0, 1, 2  # Steps of a pair: along both walls, or along one of them


def facing(left_mm: Floats, right_mm: Floats) -> Integers:
    """Pair the points of two walls in order, (k, 2). The first pair is both first points, the last both last points.

    The pairs minimise the distance between the walls, integrated over the arc length of both (the summed Fréchet
    distance). The method is dynamic programming along the anti-diagonals of all pairs.
    """
    count, other = len(left_mm), len(right_mm)
    left_step, right_step = (
        np.concatenate([[0.0], np.linalg.norm(np.diff(wall, axis=0), axis=1)]) for wall in (left_mm, right_mm)
    )
    # Costs and distances on the last two anti-diagonals, by the number of the left point plus one.
    cost, before = np.full((2, count + 1), np.inf)
    across, across_before = np.zeros((2, count + 1))
    came_by = np.zeros((count + other - 1, count), dtype=np.int8)
    for total in range(count + other - 1):
        left = np.arange(max(0, total - other + 1), min(count - 1, total) + 1)
        right = total - left
        here = np.hypot(*(left_mm[left] - right_mm[right]).T)
        along_left, along_right = left_step[left], right_step[right]
        ways = np.stack(
            [
                before[left] + (across_before[left] + here) / 2 * (along_left + along_right),
                cost[left] + (across[left] + here) / 2 * along_left,
                cost[left + 1] + (across[left + 1] + here) / 2 * along_right,
            ]
        )
        step = ways.argmin(axis=0)
        came_by[total, left] = step
        before, across_before = cost, across
        cost, across = np.full(count + 1, np.inf), np.zeros(count + 1)
        cost[left + 1] = ways[step, np.arange(len(left))] if total else 0.0
        across[left + 1] = here
    pair = (count - 1, other - 1)
    pairs = [pair]
    while pair != (0, 0):
        step = came_by[sum(pair), pair[0]]
        pair = pair[0] - (step != RIGHT), pair[1] - (step != LEFT)
        pairs.append((int(pair[0]), int(pair[1])))
        pair = pairs[-1]
    return np.array(pairs[::-1], dtype=np.int64)
