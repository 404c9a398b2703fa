"""Damage that a mesh can have, each told in its own sentence."""

import numpy as np
import pytest
import trimesh

from digitise.geometry.mesh_topology import check_mesh, mesh_volume_mm3
from sealtwin.core.records import Floats, Integers

CUBE = trimesh.creation.box((10.0, 10.0, 10.0))
V, F = np.array(CUBE.vertices), np.array(CUBE.faces, dtype=np.int64)
RING = trimesh.creation.torus(10.0, 3.0, major_sections=24, minor_sections=12)


def test_a_cube_is_sound_and_keeps_its_volume_far_from_the_origin():
    assert check_mesh(V, F, expected_euler=2) == []
    assert mesh_volume_mm3(V, F) == pytest.approx(1000.0)
    assert mesh_volume_mm3(V + 1e6, F) == pytest.approx(1000.0, rel=1e-9)


def beside(shift_mm: tuple[float, float, float]) -> tuple[Floats, Integers]:
    """The cube and a second one."""
    return np.vstack([V, V + shift_mm]), np.vstack([F, F + 8])


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (V, F[1:], ["not watertight; open edges: 3, the first near", "5.00"]),
        (V, np.vstack([F[:4], F[4:5, ::-1], F[5:]]), ["edges with two faces that point to opposite sides: 3"]),
        (
            np.vstack([V, [20.0, 0.0, 0.0]]),
            np.vstack([F, [*F[0][:2], 8], [*F[0][:2][::-1], 8]]),
            ["edges with three or more faces: 1, the first near ("],
        ),
        (*beside((5.0, 4.0, 3.0)), ["crosses itself"]),
    ],
    ids=["hole", "turned face", "fin", "overlap"],
)
def test_a_fault_is_told_in_one_sentence(vertices, faces, says):
    (fault,) = check_mesh(vertices, faces)
    assert all(words in fault for words in says)


def test_a_ring_has_another_euler_number_than_a_ball():
    mesh = np.array(RING.vertices), np.array(RING.faces, dtype=np.int64)
    assert check_mesh(*mesh, expected_euler=0) == []
    (fault,) = check_mesh(*mesh, expected_euler=2)
    assert "Euler number 0, not 2" in fault


def test_a_tiny_edge_and_vertices_that_a_file_would_merge_are_told():
    """The cut of a corner, 1e-6 mm long at z = 105 mm, where float32 steps by 8e-6 mm."""
    corner = V.argmax(axis=0)[0]
    face = next(face for face in F if corner in face)
    # That face gets the new vertex, and slivers close the gaps on both sides of it.
    a, b, c = np.roll(face, -list(face).index(corner))
    rest = F[(face != F).any(axis=1)]
    mended = np.vstack([rest, [8, b, c], [a, b, 8], [a, 8, c]])
    faults = check_mesh(np.vstack([V, V[corner] - [0, 0, 1e-6]]) + np.array([0.0, 0.0, 100.0]), mended)
    assert any("edge of 1e-06 mm" in fault for fault in faults)
    assert any("1 vertices that coincide in a float32 file" in fault for fault in faults)
