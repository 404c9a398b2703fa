import numpy as np
from manifold3d import Manifold

from digitise.geometry.mesh_topology import edge_uses, open_edges


def cube() -> np.ndarray:
    return np.array(Manifold.cube((1.0, 1.0, 1.0)).to_mesh64().tri_verts, dtype=np.int64)


def test_each_edge_of_a_closed_body_is_used_once_each_way():
    """A cube of 12 triangles has 18 edges."""
    directed, uses = edge_uses(cube())
    assert len(uses.begins) == 18
    assert (uses.count == 2).all()
    there, back = directed[uses.order].reshape(-1, 2, 2).transpose(1, 0, 2)
    assert np.array_equal(there, back[:, ::-1])


def test_a_face_left_out_leaves_its_three_edges_open_the_other_way():
    faces = cube()
    a, b, c = faces[5]
    left_open = open_edges(np.delete(faces, 5, axis=0))
    assert {tuple(edge) for edge in left_open.tolist()} == {(b, a), (c, b), (a, c)}
    assert len(open_edges(faces)) == 0
