"""Crossing triangles, against counts by hand and a plain double loop."""

import numpy as np
import pytest

from digitise.geometry.mesh_topology import intersecting_faces

FLAT = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]


def crossings(*triangles) -> int:
    vertices = np.array(triangles, dtype=float).reshape(-1, 3)
    return len(intersecting_faces(vertices, np.arange(len(vertices)).reshape(-1, 3)))


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ([[1, 1, -1], [1, 1, 1], [2, 2, 5]], 1),
        ([[1, 1, 0.1], [1, 1, 1], [2, 2, 5]], 0),
        ([[1, 1, 0], [1, 1, 1], [2, 2, 5]], 0),
        ([[1, 1, -5e-6], [1, 1, 1], [2, 2, 5]], 0),
        ([[9, 9, -1], [9, 9, 1], [8, 8, 5]], 0),
        ([[3, 3, -1], [3, 3, 1], [4, 4, 5]], 0),
        ([[1, -1, -1], [1, -1, 1], [1, 9, 0]], 1),
        ([[1, 1, -1], [1, 1, 1], [1, 1, 3]], 1),
    ],
    ids=["through", "above", "touching", "within a contact", "far", "beside, boxes overlap", "edges cross", "needle"],
)
def test_pairs_of_triangles(other, expected):
    assert crossings(FLAT, other) == expected


def test_triangles_that_share_a_vertex_may_still_cross():
    """A fold: the third edge of one passes through the other."""
    faces = np.array([[0, 1, 2], [0, 3, 4]])
    assert len(intersecting_faces(np.array([*FLAT, [3.0, 1.0, -2.0], [0.5, 2.0, 2.0]]), faces)) == 1
    assert len(intersecting_faces(np.array([*FLAT, [3.0, 1.0, 1.0], [0.5, 2.0, 2.0]]), faces)) == 0


def test_the_sweep_misses_no_pair_in_one_part_or_in_many(monkeypatch):
    """Thirty random triangles: as many crossings as when each pair is tried alone.

    A scan of millions of faces is swept in parts, so that its memory is bounded.
    """
    rng = np.random.default_rng(1)
    triangles = rng.uniform(0, 4, (30, 1, 3)) + rng.uniform(-2, 2, (30, 3, 3))
    alone = sum(crossings(triangles[i], triangles[j]) for i in range(30) for j in range(i))
    assert 20 < alone < 1000
    corners, faces = triangles.reshape(-1, 3), np.arange(90).reshape(-1, 3)
    whole = intersecting_faces(corners, faces)
    assert len(whole) == alone
    monkeypatch.setattr("digitise.geometry.mesh_topology.FEW", 5)
    parts = intersecting_faces(corners, faces)
    assert len(parts) == alone
    assert sorted(parts.tolist()) == sorted(whole.tolist())
