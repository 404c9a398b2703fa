"""The surface of particles: closed, where the sealant ends, and no larger than a page can carry."""

import numpy as np
import pytest
import trimesh

from sealtwin.core.records import Floats
from validate.figures.turntable import MODEL, fluid_surface


def lattice(sides: tuple[int, int, int], spacing_mm: float = 0.8) -> Floats:
    axes = [spacing_mm * (np.arange(side) + 0.5) for side in sides]
    return np.array(np.meshgrid(*axes, indexing="ij"), dtype=float).reshape(3, -1).T


def test_a_block_of_particles_is_a_closed_block_of_their_volume():
    """Faces lie where the half-filled space is: exact on the plane; the blur rounds edges, 1 % of this block."""
    position_mm = lattice((30, 20, 15))
    surface = fluid_surface(position_mm, 0.8**3, np.zeros(len(position_mm)))
    mesh = trimesh.Trimesh(surface.vertices_mm, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(len(position_mm) * 0.8**3, rel=0.015)
    assert np.abs(mesh.bounds - [[0, 0, 0], [24, 16, 12]]).max() < 0.06
    assert (np.einsum("ij,ij->i", mesh.face_normals, surface.normal[surface.faces].mean(axis=1)) > 0).all()


def test_a_layer_one_particle_thick_is_there_and_a_lone_particle_is_not():
    layer = lattice((20, 20, 1))
    surface = fluid_surface(np.vstack([layer, [[30.0, 30.0, 30.0]]]), 0.8**3, np.zeros(len(layer) + 1))
    assert len(surface.faces)
    assert surface.vertices_mm[:, 2].max() < 2.0


def test_colours_are_those_of_the_particles_around():
    """Seen to fail with the weights left out."""
    position_mm = lattice((40, 10, 10))
    surface = fluid_surface(position_mm, 0.8**3, position_mm[:, 0])
    inner = (surface.vertices_mm[:, 0] > 2) & (surface.vertices_mm[:, 0] < 30)
    assert np.abs(surface.value - surface.vertices_mm[:, 0])[inner].max() < 0.2


def test_many_particles_make_no_larger_mesh():
    """A page carries 12 bytes a vertex; this block has five times the surface of the paper's trial."""
    position_mm = lattice((150, 80, 12), spacing_mm=0.5)
    surface = fluid_surface(position_mm, 0.5**3, np.zeros(len(position_mm)))
    assert MODEL.most_vertices / 2 < len(surface.vertices_mm) <= MODEL.most_vertices
    assert trimesh.Trimesh(surface.vertices_mm, surface.faces, process=False).is_watertight


def test_no_particles_have_no_surface():
    for position_mm in (np.empty((0, 3)), np.zeros((1, 3))):
        assert not len(fluid_surface(position_mm, 0.5, np.zeros(len(position_mm))).faces)
