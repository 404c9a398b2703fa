"""Faults of a mesh: crossing triangles, compared with counts by hand and a plain double loop, and others."""

import numpy as np
import pytest
import trimesh

from digitise.geometry.mesh_topology import examine_mesh, intersecting_faces, mesh_volume_mm3

FLAT = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]
CUBE = trimesh.creation.box((10.0, 10.0, 10.0))
RING = trimesh.creation.torus(10.0, 3.0, major_sections=24, minor_sections=12)
V, F = np.array(CUBE.vertices), np.array(CUBE.faces, dtype=np.int64)


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
        ([[3, 3, -1], [3, 3, 1], [4, 4, 5]], 0),
        ([[1, -1, -1], [1, -1, 1], [1, 9, 0]], 1),
        ([[1, 1, -1], [1, 1, 1], [1, 1, 3]], 1),
    ],
    ids=["through", "above", "touching", "within a contact", "beside, boxes overlap", "edges cross", "needle"],
)
def test_only_pairs_of_triangles_that_cross_are_counted_as_crossings(other, expected):
    assert crossings(FLAT, other) == expected


@pytest.mark.parametrize("few", [5, None], ids=["in many parts", "in one part"])
def test_the_sweep_finds_the_same_crossings_as_a_test_of_all_pairs(monkeypatch, few):
    """Each pair of thirty random triangles is also tested alone.

    A scan of millions of faces is swept in parts, so that its memory is bounded.
    """
    rng = np.random.default_rng(1)
    triangles = rng.uniform(0, 4, (30, 1, 3)) + rng.uniform(-2, 2, (30, 3, 3))
    expected = {(j, i) for i in range(30) for j in range(i) if crossings(triangles[i], triangles[j])}
    assert 20 < len(expected) < 1000
    if few is not None:
        monkeypatch.setattr("digitise.geometry.mesh_topology.GROUP", few)
    pairs = intersecting_faces(triangles.reshape(-1, 3), np.arange(90).reshape(-1, 3))
    assert len(pairs) == len(expected)
    assert {(min(pair), max(pair)) for pair in pairs.tolist()} == expected


def test_a_cube_without_faults_has_the_same_volume_far_from_the_origin():
    assert examine_mesh(V, F, expected_euler=2)[0] == []
    assert mesh_volume_mm3(V + 1e6, F) == pytest.approx(1000.0, rel=1e-9)


@pytest.mark.parametrize(
    ("vertices", "faces", "euler", "says"),
    [
        (V, F[1:], None, ["open edges: 3, the first near", "5.00"]),
        (V, np.vstack([F[:4], F[4:5, ::-1], F[5:]]), None, ["opposite sides: 3"]),
        (np.vstack([V, [20.0, 0, 0]]), np.vstack([F, [*F[0][:2], 8], [*F[0][1::-1], 8]]), None, ["more faces: 1", "("]),
        (np.vstack([V, V + np.array([5.0, 4.0, 3.0])]), np.vstack([F, F + 8]), None, ["crosses itself"]),
        (np.array(RING.vertices), np.array(RING.faces, dtype=np.int64), 2, ["Euler number 0 instead of 2"]),
    ],
    ids=["hole", "turned face", "fin", "overlap", "ring for a ball"],
)
def test_each_fault_of_a_mesh_is_reported_in_one_sentence(vertices, faces, euler, says):
    (fault,) = examine_mesh(vertices, faces, expected_euler=euler)[0]
    assert all(words in fault for words in says)


def test_tiny_edges_and_vertices_that_coincide_in_float32_are_reported():
    """A corner is cut by 1e-6 mm at z = 105 mm, where float32 steps by 8e-6 mm."""
    corner = V.argmax(axis=0)[0]
    face = next(face for face in F if corner in face)
    # That face gets the new vertex, and slivers close the gaps on both sides of it.
    a, b, c = np.roll(face, -list(face).index(corner))
    mended = np.vstack([F[(face != F).any(axis=1)], [8, b, c], [a, b, 8], [a, 8, c]])
    faults = examine_mesh(np.vstack([V, V[corner] - [0, 0, 1e-6]]) + np.array([0.0, 0.0, 100.0]), mended)[0]
    assert any("1e-06 mm" in fault for fault in faults)
    assert any("1 vertices that coincide" in fault for fault in faults)
