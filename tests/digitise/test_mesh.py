"""Damage that a mesh can have, each told in its own sentence."""

import numpy as np
import pytest
import trimesh

from digitise.geometry.mesh_topology import check_mesh, mesh_volume_mm3
from sealtwin.core.records import Floats, Integers

Mesh = tuple[Floats, Integers]


@pytest.fixture
def box() -> Mesh:
    """A cube of 10 mm in twelve faces."""
    cube = trimesh.creation.box((10.0, 10.0, 10.0))
    return np.array(cube.vertices), np.array(cube.faces, dtype=np.int64)


def joined(one: Mesh, other: Mesh) -> Mesh:
    return np.vstack([one[0], other[0]]), np.vstack([one[1], other[1] + len(one[0])])


def test_a_cube_is_sound(box):
    assert check_mesh(*box, expected_euler=2) == []
    assert mesh_volume_mm3(*box) == pytest.approx(1000.0)


def test_volume_keeps_its_digits_far_from_the_origin(box):
    vertices, faces = box
    assert mesh_volume_mm3(vertices + 1e6, faces) == pytest.approx(1000.0, rel=1e-9)


def test_a_missing_face_is_told_with_its_place(box):
    vertices, faces = box
    (fault,) = check_mesh(vertices, faces[1:])
    assert "not watertight: 3 open edges" in fault
    assert "5.00" in fault


def test_faces_that_look_inward_are_told(box):
    vertices, faces = box
    (fault,) = check_mesh(vertices, faces[:, ::-1])
    assert "inside out (volume -1000 mm³)" in fault


def test_one_turned_face_is_told(box):
    vertices, faces = box
    turned = faces.copy()
    turned[4] = turned[4][::-1]
    (fault,) = check_mesh(vertices, turned)
    assert "3 edges with two faces that point to opposite sides" in fault


def test_a_third_face_on_an_edge_is_told(box):
    vertices, faces = box
    fin = np.vstack([vertices, [20.0, 0.0, 0.0]])
    (fault,) = check_mesh(fin, np.vstack([faces, [*faces[0][:2], 8], [*faces[0][:2][::-1], 8]]))
    assert "1 edge at which three or more faces meet, near (" in fault


def test_a_sheet_on_itself_encloses_nothing(box):
    vertices, faces = box
    (fault,) = check_mesh(vertices[faces[0]], np.array([[0, 1, 2], [2, 1, 0]]))
    assert "encloses no volume" in fault


def test_a_ring_has_another_euler_number_than_a_ball():
    ring = trimesh.creation.torus(10.0, 3.0, major_sections=24, minor_sections=12)
    vertices, faces = np.array(ring.vertices), np.array(ring.faces, dtype=np.int64)
    assert check_mesh(vertices, faces, expected_euler=0) == []
    (fault,) = check_mesh(vertices, faces, expected_euler=2)
    assert "Euler number 0, not 2" in fault


def test_a_tiny_edge_and_vertices_that_a_file_would_merge_are_told(box):
    """The cut of a corner, 1e-6 mm long at z = 105 mm, where float32 steps by 8e-6 mm."""
    vertices, faces = box
    corner = vertices.argmax(axis=0)[0]
    around = [face for face in faces if corner in face]
    cut = vertices[corner] - [0, 0, 1e-6]
    moved = np.vstack([vertices, cut])
    # The first face at the corner gets the new vertex, and slivers close the gaps on both sides of it.
    a, b, c = np.roll(around[0], -list(around[0]).index(corner))
    new = len(vertices)
    rest = np.array([face for face in faces if not np.array_equal(face, around[0])])
    mended = np.vstack([rest, [new, b, c], [a, b, new], [a, new, c]])
    faults = check_mesh(moved + np.array([0.0, 0.0, 100.0]), mended)
    assert any("edge of 1e-06 mm" in fault for fault in faults)
    assert any("1 vertices that coincide in a float32 file" in fault for fault in faults)


def test_bodies_that_overlap_are_told(box):
    other = box[0] + [5.0, 4.0, 3.0], box[1]
    (fault,) = check_mesh(*joined(box, other))
    assert "crosses itself" in fault


def test_bodies_that_stand_apart_are_not(box):
    assert check_mesh(*joined(box, (box[0] + [11.0, 0.0, 0.0], box[1])), expected_euler=4) == []


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (np.zeros((3, 3)), np.empty((0, 3), dtype=np.int64), "no faces"),
        (np.full((3, 3), np.nan), np.array([[0, 1, 2]]), "3 vertices that are not finite numbers"),
        (np.zeros((3, 3)), np.array([[0, 1, 3]]), "names vertices 0 to 3, but has 3"),
    ],
)
def test_what_is_no_mesh_is_told(vertices, faces, says):
    (fault,) = check_mesh(vertices, faces)
    assert says in fault
