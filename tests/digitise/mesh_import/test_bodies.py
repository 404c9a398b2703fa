"""From closed surfaces to one body: what counts once, what is filled, what is left out."""

import numpy as np
import pytest

from digitise.mesh_import.repair import RepairedSurface, bounded_body, one_surface
from sealtwin.core.errors import InputError
from tests.meshes import SLOT_MM3, Mesh, box, mesh_of, slotted

VOLUME_MM3 = 100.0 * 40.0 * 20.0 - SLOT_MM3


def joined(*meshes: Mesh) -> RepairedSurface:
    """Side by side in one file, as they are."""
    offsets = np.cumsum([0, *(len(mesh[0]) for mesh in meshes)])
    faces = [mesh[1] + at for mesh, at in zip(meshes, offsets[:-1], strict=True)]
    return one_surface(np.concatenate([mesh[0] for mesh in meshes]), np.concatenate(faces))


def test_one_body_is_taken_as_it_is():
    body, repairs = bounded_body(joined(mesh_of(slotted())))
    assert body.volume() == pytest.approx(VOLUME_MM3)
    assert repairs == ()


def test_bodies_that_overlap_count_once():
    """A library takes them without a word, and counts 500 mm³ twice."""
    body, (repair,) = bounded_body(joined(mesh_of(slotted()), mesh_of(box((90.0, 10.0, -15.0), (110.0, 20.0, -10.0)))))
    assert body.volume() == pytest.approx(VOLUME_MM3 + 500)
    assert (repair.what, repair.count) == ("overlapping bodies united", 2)
    assert repair.volume_change == pytest.approx(-500 / (VOLUME_MM3 + 1000))


def test_bodies_that_stand_apart_stay():
    body, repairs = bounded_body(joined(mesh_of(slotted()), mesh_of(box((120.0, 0.0, -15.0), (130.0, 10.0, -5.0)))))
    assert body.volume() == pytest.approx(VOLUME_MM3 + 1000)
    assert repairs == ()


def test_hollows_are_filled():
    """No sealant gets there, and a body inside out would turn every later cut around."""
    hollow = slotted(box((5.0, 5.0, -15.0), (10.0, 10.0, -12.0)))
    body, (repair,) = bounded_body(joined(mesh_of(hollow)))
    assert body.volume() == pytest.approx(VOLUME_MM3)
    assert (repair.what, repair.count) == ("hollows inside the sample filled", 1)
    assert repair.volume_change == pytest.approx(75 / (VOLUME_MM3 - 75))


def test_crumbs_beside_the_sample_are_left_out():
    body, (repair,) = bounded_body(joined(mesh_of(slotted()), mesh_of(box((120.0, 0.0, -2.0), (121.0, 1.0, -1.0)))))
    assert body.volume() == pytest.approx(VOLUME_MM3)
    assert (repair.what, repair.count) == ("loose crumbs left out", 1)


def test_a_surface_that_is_not_closed_bounds_nothing():
    surface = joined(mesh_of(slotted()))
    with pytest.raises(InputError, match="not watertight: 3 open edges"):
        bounded_body(RepairedSurface(surface.vertices_mm, surface.faces[1:]))


def test_a_fold_bounds_nothing():
    corners = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    with pytest.raises(InputError, match="encloses no volume"):
        bounded_body(RepairedSurface(corners, np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]])))
