"""Corners of markers by their edges, and the lines that edges are."""

import numpy as np
import pytest

from digitise.geometry.polyline import coverage
from digitise.image.raster import Map, blurred
from digitise.scale.face_scale import edge_line, refined_corners

MODULE_PX = 12.0
TURNED = np.array([[60.3, 41.2], [131.6, 49.8], [122.9, 121.4], [51.7, 112.6]])
"""A square of 72 px, turned by 7 degrees: upper left, upper right, lower right, lower left."""


def square_on_white(blur_px: float) -> Map:
    return blurred((0.7 - 0.67 * coverage(TURNED, (180, 160))).astype(np.float32), blur_px)


@pytest.mark.parametrize("blur_px", [0.9, 2.0])
def test_blur_leaves_corners_where_they_are(blur_px):
    """From 3 px off. OpenCV's refinement of the corners themselves ends 0.2 and 0.6 px inside the square."""
    edges = refined_corners(square_on_white(blur_px), TURNED + np.array([3.0, -2.0]), 0.7 * MODULE_PX)
    assert edges is not None
    corners, bend_px = edges
    assert np.abs(corners - TURNED).max() < 0.03
    assert bend_px < 0.1


def test_a_square_without_white_beside_it_has_no_edge_there():
    light = square_on_white(0.9)
    light[:, 110:] = 0.03
    light += 0.002 * np.random.default_rng(1).standard_normal(light.shape, dtype=np.float32)
    assert refined_corners(light, TURNED, 0.7 * MODULE_PX) is None


@pytest.mark.parametrize("where", [slice(0, 14), slice(25, 39), slice(46, 60)], ids=["start", "middle", "end"])
def test_a_quarter_of_the_points_pulled_to_one_side_moves_nothing(where):
    """As by a fleck on an edge. Least squares alone is pulled 2 px off by it, and then keeps the fleck."""
    foot, outward = np.linspace((10.0, 20.0), (200.0, 45.0), 60), np.array([-25.0, 190.0]) / np.hypot(25, 190)
    across_px = np.random.default_rng(1).normal(0, 0.05, 60)
    across_px[where] += 8.0
    (point, direction), miss_px = edge_line(foot, outward, across_px)
    assert len(miss_px) == 46
    assert np.abs((foot[[0, -1]] - point) @ [-direction[1], direction[0]]).max() < 0.05
