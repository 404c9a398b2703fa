"""Places on a ring by the number of an edge and the share of it."""

import numpy as np
import pytest

from digitise.mesh_import.rim import dense, first_exit, openings, stretch, within

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]])


def test_a_ray_leaves_the_ring_at_its_first_edge():
    away_mm, at = first_exit(SQUARE, np.array([1.0, 1.0]), np.array([1.0, 0.0]))
    assert (away_mm, at) == pytest.approx((3.0, 1.5))
    away_mm, _ = first_exit(SQUARE, np.array([5.0, 1.0]), np.array([1.0, 0.0]))
    assert away_mm == np.inf


def test_a_stretch_runs_counter_clockwise_past_the_first_corner():
    assert stretch(SQUARE, 3.5, 0.25) == pytest.approx(np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]))
    assert stretch(SQUARE, 0.25, 1.0) == pytest.approx(np.array([[1.0, 0.0], [4.0, 0.0]]))
    assert within(0.1, 3.5, 0.25)
    assert not within(2.0, 3.5, 0.25)


def test_openings_are_the_stretches_on_the_edge_of_the_face():
    split = np.insert(SQUARE, 2, [4.0, 1.0], axis=0)
    assert openings(split, (-5.0, -5.0, 4.0, 5.0)) == [(1.0, 3.0)]
    assert openings(split, (-5.0, -5.0, 5.0, 5.0)) == []


def test_a_dense_ring_keeps_its_corners():
    points = dense(SQUARE, 0.3)
    assert all((points == corner).all(axis=1).any() for corner in SQUARE)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= 0.3
