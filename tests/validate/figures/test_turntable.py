"""The rotatable 3-D view of a fill: its packed mesh and the surface of the sealant."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from sealtwin.core.records import FaceLabel, Floats
from validate.figures.turntable import MAX_CORNERS, MAX_VERTICES, build_turntable, fluid_surface


@pytest.fixture(scope="module")
def turntable(evidence):
    return build_turntable(evidence.run, evidence.solid)


def test_the_packed_mesh_equals_the_mesh_up_to_rounding(turntable):
    """Positions are rounded to 16 bits, colours and normals to bytes."""
    packed = json.loads(turntable.packed())
    kind = np.dtype([("place", "<u2", 3), ("normal", "i1", 3), ("colour", "u1", 3)])
    assert kind.itemsize == 12
    vertex = np.frombuffer(base64.b64decode(packed["vertices"]), kind)
    place_mm = packed["low_mm"] + vertex["place"] * packed["step_mm"]
    assert np.abs(place_mm - turntable.vertices_mm).max() < 0.51 * packed["step_mm"] + 1e-6
    assert np.abs(vertex["normal"] / 127 - turntable.normal).max() < 0.5 / 127 + 1e-9
    assert np.abs(vertex["colour"] / 255 - turntable.colour).max() < 0.5 / 255 + 1e-9
    faces = np.frombuffer(base64.b64decode(packed["faces"]), "<u2").reshape(-1, 3)
    assert (faces == turntable.faces).all()


def test_a_scan_with_too_many_facets_is_simplified(evidence):
    """Each facet is divided into 4,096. 16 bits must number all corners, and the bounds move by under 0.1 mm."""
    solid = evidence.solid
    vertices_mm, faces, label = solid.vertices_mm, solid.faces, solid.face_label
    for _ in range(6):
        vertices_mm, faces = trimesh.remesh.subdivide(vertices_mm, faces)[:2]
        label = np.repeat(label, 4)
    fine = replace(solid, vertices_mm=vertices_mm, faces=faces, face_label=label)
    assert 3 * (label == FaceLabel.WALL).sum() > MAX_CORNERS
    scan, plain = build_turntable(evidence.run, fine), build_turntable(evidence.run, solid)
    assert len(scan.vertices_mm) <= 2**16
    assert np.abs(scan.vertices_mm.min(axis=0) - plain.vertices_mm.min(axis=0)).max() < 0.1
    assert np.abs(scan.vertices_mm.max(axis=0) - plain.vertices_mm.max(axis=0)).max() < 0.1


def lattice(sides: tuple[int, int, int], spacing_mm: float = 0.8) -> Floats:
    axes = [spacing_mm * (np.arange(side) + 0.5) for side in sides]
    return np.array(np.meshgrid(*axes, indexing="ij"), dtype=float).reshape(3, -1).T


def test_the_surface_of_a_block_of_particles_is_closed_with_their_volume():
    """Faces are exact where they are plane; the blur rounds the edges, which is 1 % of this block."""
    position_mm = lattice((30, 20, 15))
    surface = fluid_surface(position_mm, 0.8**3, np.zeros(len(position_mm)))
    mesh = trimesh.Trimesh(surface.vertices_mm, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(len(position_mm) * 0.8**3, rel=0.015)
    assert np.abs(mesh.bounds - [[0, 0, 0], [24, 16, 12]]).max() < 0.06
    assert (np.einsum("ij,ij->i", mesh.face_normals, surface.normal[surface.faces].mean(axis=1)) > 0).all()


def test_a_single_layer_of_particles_is_shown_and_a_lone_particle_is_not(evidence):
    """A crack without sealant is shown empty."""
    layer = lattice((20, 20, 1))
    surface = fluid_surface(np.vstack([layer, [[30.0, 30.0, 30.0]]]), 0.8**3, np.zeros(len(layer) + 1))
    assert len(surface.faces)
    assert surface.vertices_mm[:, 2].max() < 2.0
    assert not len(fluid_surface(np.zeros((1, 3)), 0.5, np.zeros(1)).faces)
    spilled = replace(evidence.run, spilled=np.ones(len(evidence.run.spilled), dtype=bool))
    empty = build_turntable(spilled, evidence.solid)
    assert json.loads(empty.packed())["faces"]


def test_the_mesh_of_many_particles_is_limited_in_size():
    """A page has 12 bytes per vertex; this block has five times the surface of the paper's trial."""
    position_mm = lattice((150, 80, 12), spacing_mm=0.5)
    surface = fluid_surface(position_mm, 0.5**3, np.zeros(len(position_mm)))
    assert MAX_VERTICES / 2 < len(surface.vertices_mm) <= MAX_VERTICES
    assert trimesh.Trimesh(surface.vertices_mm, surface.faces, process=False).is_watertight
