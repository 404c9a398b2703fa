"""Corners of markers by their edges, and the lines that edges are."""

import numpy as np

from digitise.scale.face_scale import edge_line


def test_a_quarter_of_the_points_pulled_to_one_side_moves_nothing():
    """As by a fleck on an edge. Least squares alone is pulled 2 px off by it, and then keeps the fleck."""
    foot, outward = np.linspace((10.0, 20.0), (200.0, 45.0), 60), np.array([-25.0, 190.0]) / np.hypot(25, 190)
    across_px = np.random.default_rng(1).normal(0, 0.05, 60)
    across_px[46:60] += 8.0
    (point, direction), miss_px = edge_line(foot, outward, across_px)
    assert len(miss_px) == 46
    assert np.abs((foot[[0, -1]] - point) @ [-direction[1], direction[0]]).max() < 0.05
