"""Pairs of places on two walls that face each other."""

import numpy as np

from digitise.mesh_import.wall_pairs import facing


def test_straight_walls_are_paired_square_to_each_other():
    x = np.linspace(0.0, 10.0, 101)
    left, right = np.column_stack([x, np.full(101, 3.0)]), np.column_stack([x, np.zeros(101)])
    assert np.array_equal(facing(left, right), np.column_stack([np.arange(101)] * 2))


def test_an_inner_corner_is_paired_with_all_of_the_outer_one():
    """An L of width 2 round a corner at (0, 0): the middles are the L half way, 1 off both walls."""
    step = np.arange(0.0, 8.01, 0.1)
    inner = np.vstack(
        [np.column_stack([step[:0:-1], 0 * step[1:]]), [[0.0, 0.0]], np.column_stack([0 * step, step])[1:]]
    )
    out = np.arange(0.0, 10.01, 0.1)
    outer = (
        np.vstack([np.column_stack([out[:0:-1], 0 * out[1:]]), [[0.0, 0.0]], np.column_stack([0 * out, out])[1:]]) - 2
    )
    pairs = facing(inner, outer)
    assert np.all(np.diff(pairs, axis=0) >= 0)
    middle = (inner[pairs[:, 0]] + outer[pairs[:, 1]]) / 2
    assert np.abs(middle.min(axis=1) + 1).max() < 1e-6
    assert len(np.unique(pairs[pairs[:, 0] == 80, 1])) == 41
