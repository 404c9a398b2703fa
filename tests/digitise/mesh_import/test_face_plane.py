"""The face of a sample in its mesh, whichever way it lies and however rough it is."""

import numpy as np
import pytest
import trimesh

from digitise.mesh_import.block import FacePlane, find_face
from digitise.mesh_import.import_mesh import moved
from digitise.mesh_import.repair import one_surface
from sealtwin.core.errors import InputError
from tests.meshes import Mesh, mesh_of, modelled, sheet, slotted, turned
from tests.shapes import wandering_crack


def face_of(mesh: Mesh) -> FacePlane:
    return find_face(one_surface(*mesh))


def test_a_level_face_is_left_exactly_where_it_is():
    """Dams stand above it, and a floor lies below: neither is the face."""
    vertices, faces = modelled(wandering_crack(), depth_mm=16.0, tilt="flare", wall_angle_deg=5.5)
    plane = face_of((vertices + np.array([0.0, 0.0, 64.0]), faces))
    assert plane.tilt_deg == 0.0
    assert plane.roughness_mm < 1e-6  # the tidied vertices of its edge
    assert np.array_equal(plane.to_level[:3, :3], np.eye(3))
    assert plane.to_level[2, 3] == pytest.approx(-64.0, abs=1e-6)


def test_a_face_that_is_level_but_for_rounding_is_not_turned():
    """By 2e-7 radians, 0.02 µm over its width: float32 leaves as much, and exact sides would be lost for it."""
    mesh = turned(mesh_of(slotted()), 0, 1e-5)
    assert np.array_equal(face_of(mesh).to_level[:3, :3], np.eye(3))


@pytest.mark.parametrize(("about", "by_deg"), [(0, 7.0), (1, -20.0), (0, 0.01)])
def test_a_tilted_face_is_brought_level(about, by_deg):
    mesh = turned(mesh_of(slotted()), about, by_deg)
    plane = face_of(mesh)
    assert plane.tilt_deg == pytest.approx(abs(by_deg), abs=1e-6)
    level = moved(mesh[0], plane.to_level)
    assert level[:, 2].max() == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(level[:, 2]) == pytest.approx(20.0)
    # By the shortest way: it was not turned about any other axis.
    assert np.ptp(level[:, :2], axis=0) == pytest.approx([100.0, 40.0])


def test_a_rough_face_is_known_by_its_middle():
    """The grain of this very sheet leans by 0.02 degrees itself, 0.014 mm over its width."""
    plane = face_of(turned(sheet(rough_mm=0.1, from_mm=30.0), 0, 3.0))
    assert plane.tilt_deg == pytest.approx(3.0, abs=0.04)
    assert plane.roughness_mm == pytest.approx(0.1, rel=0.2)
    middle = np.array([50.0, 5.0])
    assert plane.height_mm(middle[None])[0] == pytest.approx(5.0 * np.sin(np.radians(3.0)), abs=0.03)


def test_a_ball_has_no_face():
    ball = trimesh.creation.icosphere(4, 50.0)
    with pytest.raises(InputError, match=r"face .*: \d+% "):
        face_of((np.array(ball.vertices), np.array(ball.faces, dtype=np.int64)))


def test_a_sheet_on_edge_has_no_face():
    with pytest.raises(InputError, match="no plane face on its upper side: 0%"):
        face_of(turned(sheet(rough_mm=0.0, from_mm=200.0), 0, 90.0))
