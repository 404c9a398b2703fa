"""The repair of meshes that have very short edges."""

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from digitise.geometry.mesh_topology import examine_mesh, mesh_volume_mm3
from digitise.solid.float_mesh import SHORT_MM, tidy
from sealtwin.core.records import Floats, Integers


def cube(size_mm: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Manifold:
    return Manifold.cube((size_mm, size_mm, size_mm)).translate(at)


def test_mesh_edges_below_the_length_limit_are_collapsed_without_changing_the_volume():
    """Two cubes with an offset of a micrometre have edges of that length along their common side."""
    body = Manifold.batch_boolean([cube(10), cube(10, (5.0, 1e-3, 0.0))], OpType.Add)
    assert shortest_mm(*arrays(body)) == pytest.approx(1e-3)
    vertices, faces = tidy(body)
    assert examine_mesh(vertices, faces, expected_euler=2)[0] == []
    assert shortest_mm(vertices, faces) >= SHORT_MM
    assert mesh_volume_mm3(vertices, faces) == pytest.approx(body.volume(), rel=1e-4)


def arrays(body: Manifold) -> tuple[Floats, Integers]:
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64)


def shortest_mm(vertices: Floats, faces: Integers) -> float:
    ends = vertices[faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).min())
