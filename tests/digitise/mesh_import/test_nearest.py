"""Places on a ring, to the last digit."""

import numpy as np
import pytest

from digitise.mesh_import import cavity
from digitise.mesh_import.cavity import nearest_on_ring

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def test_a_point_comes_to_its_edge_and_beyond_an_edge_to_its_corner():
    points = np.array([[1.0, 0.3], [3.9, 2.0], [2.0, 9.0], [-1.0, -2.0], [5.0, 0.0], [0.0, 2.5]])
    expected = np.array([[1.0, 0.0], [4.0, 2.0], [2.0, 4.0], [0.0, 0.0], [4.0, 0.0], [0.0, 2.5]])
    assert np.array_equal(nearest_on_ring(points, SQUARE), expected)


def test_in_parts_it_is_the_same(monkeypatch):
    points = np.random.default_rng(0).uniform(-1, 5, (101, 2))
    whole = nearest_on_ring(points, SQUARE)
    monkeypatch.setattr(cavity, "AT_ONCE", 10)
    assert np.array_equal(nearest_on_ring(points, SQUARE), whole)


def test_a_repeated_corner_does_no_harm():
    ring = np.vstack([SQUARE[:2], SQUARE[1:]])
    assert nearest_on_ring(np.array([[5.0, -1.0]]), ring) == pytest.approx(np.array([[4.0, 0.0]]))
