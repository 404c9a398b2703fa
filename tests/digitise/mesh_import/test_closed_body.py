"""What it takes for a mesh of others to be one solid, and how it is refused if it is none."""

import numpy as np
import pytest

from digitise.geometry.mesh_topology import check_mesh, mesh_volume_mm3
from digitise.mesh_import.block import closed_body, one_surface
from digitise.solid.float_mesh import without_needles
from sealtwin.core.errors import InputError
from tests.support.meshes import SLOT_MM3, Mesh, box, fine, mesh_of, sheet, slotted, soup

VOLUME_MM3 = 100.0 * 40.0 * 20.0 - SLOT_MM3
SAMPLE = fine(slotted())
TURN = np.random.default_rng(0).random(9322) < 0.3


@pytest.mark.parametrize(
    ("damage", "notes"),
    [
        (lambda v, f: (v, f), 0),
        # STL has no other way to write a mesh: that is no damage.
        (lambda v, f: soup((v, f)), 0),
        (lambda v, f: (v, f[:, ::-1]), 1),
        # Whichever way they look.
        (lambda v, f: (v, np.concatenate([f, f[:20], f[30:50, ::-1]])), 0),
        (lambda v, f: (v, np.concatenate([f, f[:5, [0, 1, 1]]])), 0),
    ],
    ids=["sound", "soup", "inside out", "repeated", "without area"],
)
def test_a_solid_is_one_surface(damage, notes):
    vertices, faces, sentences = one_surface(*damage(*SAMPLE))
    assert check_mesh(vertices, faces, expected_euler=2) == []
    assert mesh_volume_mm3(vertices, faces) == pytest.approx(VOLUME_MM3, rel=1e-9)
    assert len(faces) == 9322
    assert len(sentences) == notes


def test_a_mesh_of_specks_is_refused():
    with pytest.raises(InputError, match="Check its units"):
        one_surface(np.array([[0.0, 0, 0], [1e-9, 0, 0], [0, 1e-9, 0]]), np.array([[0, 1, 2]]))


def test_triangles_without_height_leave_with_an_edge_that_is_turned():
    """Manifold removes them on reading, and may move others: it read 226 mm³ too little of a solid of 127,039 mm³."""
    vertices, faces = SAMPLE
    (a, b, c), halves = faces[0], np.array([[0.25], [0.5]])
    vertices = np.vstack([vertices, vertices[a] + halves * (vertices[b] - vertices[a])])
    one, other = len(SAMPLE[0]), len(SAMPLE[0]) + 1
    split = [(a, one, c), (one, other, c), (other, b, c), (a, b, other), (a, other, one)]
    turned = without_needles(vertices, np.vstack([faces[1:], split]))
    corners = vertices[turned]
    assert np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).min() > 0.1
    assert check_mesh(vertices, turned, expected_euler=2) == []
    assert mesh_volume_mm3(vertices, turned) == pytest.approx(VOLUME_MM3, rel=1e-12)


def joined(*meshes: Mesh) -> Mesh:
    """Side by side in one file, as they are."""
    offsets = np.cumsum([0, *(len(mesh[0]) for mesh in meshes)])
    faces = [mesh[1] + at for mesh, at in zip(meshes, offsets[:-1], strict=True)]
    return np.concatenate([mesh[0] for mesh in meshes]), np.concatenate(faces)


ONE = mesh_of(slotted())
CRUMB = mesh_of(box((120.0, 0.0, -2.0), (121.0, 1.0, -1.0)))
PORE = mesh_of(slotted(box((5.0, 5.0, -15.0), (10.0, 10.0, -12.0))))


@pytest.mark.parametrize(
    "mesh", [joined(ONE, CRUMB), PORE, (PORE[0], PORE[1][:, ::-1])], ids=["crumb", "pore", "turned"]
)
def test_crumbs_and_pores_are_left_out_and_told(mesh):
    """No sealant gets into a pore."""
    vertices, faces, _ = one_surface(*mesh)
    body, (note,) = closed_body(vertices, faces)
    assert body.volume() == pytest.approx(VOLUME_MM3)
    assert note.text.startswith("1 loose crumbs or closed pores")


FOLD = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])


@pytest.mark.parametrize(
    ("mesh", "says"),
    [
        ((SAMPLE[0], SAMPLE[1][1:]), r"not watertight; open edges: 3, the first near \("),
        (sheet(), r"not watertight; open edges: 350, the first near \("),
        (soup(SAMPLE, noise_mm=1e-5), "not watertight"),
        (
            (SAMPLE[0], np.where(TURN[:, None], SAMPLE[1][:, ::-1], SAMPLE[1])),
            r"point to opposite sides: \d+, the first",
        ),
        # Bodies that overlap would count twice where they do.
        (joined(ONE, mesh_of(box((90.0, 10.0, -15.0), (110.0, 20.0, -10.0)))), "2 separate bodies: 100 x 40 x 20 mm"),
        (
            joined(ONE, mesh_of(box((120.0, 0.0, -15.0), (130.0, 10.0, -5.0)))),
            r"10 x 10 mm around \(125, 5, -10\)",
        ),
        ((FOLD, np.array([[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]])), "not watertight"),
    ],
    ids=["hole", "sheet", "noisy soup", "turned at random", "overlap", "apart", "fold"],
)
def test_what_is_no_solid_is_refused_by_its_place(mesh, says):
    vertices, faces, _ = one_surface(*mesh)
    with pytest.raises(InputError, match=says):
        closed_body(vertices, faces)
