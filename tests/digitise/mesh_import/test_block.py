"""An imported mesh becomes one closed solid, with a face and a block of four sides."""

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from digitise.geometry.mesh_topology import examine_mesh, mesh_volume_mm3
from digitise.mesh_import.block import FacePlane, closed_body, cut_block, find_face, one_surface, parted
from digitise.solid.float_mesh import without_needles
from sealtwin.core.errors import InputError
from tests.support.meshes import BLOCK_MM, SLOT_MM3, Mesh, box, fine, mesh_of, modelled, sheet, slotted, soup, turned
from tests.support.shapes import wandering_crack


def face_of(mesh: Mesh) -> FacePlane:
    return find_face(*mesh)


def test_a_level_face_is_not_rotated():
    """The dams above and the floor below are not taken for the face."""
    vertices, faces = modelled(wandering_crack(), depth_mm=16.0, tilt="flare", wall_angle_deg=5.5)
    plane = face_of((vertices + np.array([0.0, 0.0, 64.0]), faces))
    assert plane.tilt_deg == 0.0
    assert plane.roughness_mm < 1e-6  # the tidied vertices of its edge
    assert np.array_equal(plane.to_level[:3, :3], np.eye(3))
    assert plane.to_level[2, 3] == pytest.approx(-64.0, abs=1e-6)


@pytest.mark.parametrize(("about", "by_deg"), [(1, -20.0), (0, 0.01)])
def test_a_tilted_face_is_levelled_by_the_shortest_rotation(about, by_deg):
    mesh = turned(mesh_of(slotted()), about, by_deg)
    plane = face_of(mesh)
    assert plane.tilt_deg == pytest.approx(abs(by_deg), abs=1e-6)
    level = trimesh.transform_points(mesh[0], plane.to_level)
    assert level[:, 2].max() == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(level[:, 2]) == pytest.approx(20.0)
    # The shortest rotation turns about no other axis.
    assert np.ptp(level[:, :2], axis=0) == pytest.approx([100.0, 40.0])


BALL = trimesh.creation.icosphere(4, 50.0)
EDGEWISE = turned(sheet(rough_mm=0.0, from_mm=200.0), 0, 90.0)


@pytest.mark.parametrize("mesh", [(np.array(BALL.vertices), np.array(BALL.faces)), EDGEWISE], ids=["ball", "edgewise"])
def test_a_mesh_without_a_plane_upper_side_is_refused(mesh):
    with pytest.raises(InputError, match=r"face .*: only \d+%"):
        face_of(mesh)


BELOW_MM = 0.05


def oblique_slot(width_mm: float, angle_deg: float) -> Manifold:
    half = width_mm / 2
    slot = box((-100.0, -half, -10.0), (100.0, half, 1.0)).rotate((0.0, 0.0, angle_deg)).translate((50.0, 20.0, 0.0))
    return slotted() - slot


@pytest.mark.parametrize(
    "body",
    [
        slotted(),
        # A crack may leave through a fifth of a side.
        slotted(box((-1.0, 16.0, -10.0), (30.0, 24.0, 1.0))),
        # Its walls recede from the side slowly: lines beside its opening are less than 1 mm behind it.
        oblique_slot(4.0, 20.0),
        # In a slot of 0.6 mm at 52 degrees no line is 1 mm behind the side, and the side is plane.
        oblique_slot(0.6, 52.0),
    ],
    ids=["slot", "side crack", "oblique", "thin"],
)
def test_cracks_through_the_sides_do_not_change_the_size_of_the_block(body):
    block = cut_block(body.translate((12.5, -4.5, 0.0)), BELOW_MM)
    assert block.size_mm == BLOCK_MM[:2]
    assert block.trimmed_mm == 0.0
    assert block.placed[:2, 3] == pytest.approx([-12.5, 4.5])
    assert block.body.volume() == pytest.approx(body.volume(), rel=1e-9)


@pytest.mark.parametrize(
    "body",
    [Manifold.cylinder(30.0, 50.0, 50.0, 128), Manifold.cylinder(30.0, 10.0, 60.0, 4)],
    ids=["core", "pyramid on its tip"],
)
def test_a_solid_without_four_upright_sides_is_refused(body):
    with pytest.raises(InputError, match="not a block with four upright sides"):
        cut_block(body.translate((0.0, 0.0, -30.0)), BELOW_MM)


def test_a_cut_that_loses_volume_is_refused():
    """The mesh library loses volume if the corners of a triangle lie on a line."""

    class Lossy:
        def volume(self) -> float:
            return 100.0

        def split(self, _cutter: object) -> tuple[Manifold, Manifold]:
            return box((0, 0, 0), (4, 4, 4)), box((0, 0, 0), (1, 1, 35.99))

    with pytest.raises(InputError, match="cannot be cut without loss"):
        parted(Lossy(), slotted())


VOLUME_MM3 = 100.0 * 40.0 * 20.0 - SLOT_MM3
SAMPLE = fine(slotted())
TURN = (np.random.default_rng(0).random(9322) < 0.3)[:, None]


@pytest.mark.parametrize(
    ("damage", "notes"),
    [
        (lambda v, f: (v, f), 0),
        # STL has no other way to write a mesh: that is no damage.
        (lambda v, f: soup((v, f)), 0),
        (lambda v, f: (v, f[:, ::-1]), 1),
        # Repeated faces are dropped, also if they are turned.
        (lambda v, f: (v, np.concatenate([f, f[:20], f[30:50, ::-1]])), 0),
        (lambda v, f: (v, np.concatenate([f, f[:5, [0, 1, 1]]])), 0),
    ],
    ids=["no damage", "soup", "inside out", "repeated", "without area"],
)
def test_triangle_soups_and_turned_or_repeated_faces_become_one_closed_surface(damage, notes):
    vertices, faces, sentences = one_surface(*damage(*SAMPLE))
    assert examine_mesh(vertices, faces, expected_euler=2)[0] == []
    assert mesh_volume_mm3(vertices, faces) == pytest.approx(VOLUME_MM3, rel=1e-9)
    assert len(faces) == 9322
    assert len(sentences) == notes


def test_a_mesh_of_implausibly_small_size_is_refused():
    with pytest.raises(InputError, match="Check its units"):
        one_surface(np.array([[0.0, 0, 0], [1e-9, 0, 0], [0, 1e-9, 0]]), np.array([[0, 1, 2]]))


def test_triangles_without_area_are_removed_without_changing_the_volume():
    """Manifold removes them too, but may move other triangles: a solid of 127,039 mm³ lost 226 mm³."""
    vertices, faces = SAMPLE
    a, b, c = faces[0]
    vertices = np.vstack([vertices, vertices[a] + np.array([[0.25], [0.5]]) * (vertices[b] - vertices[a])])
    near, far = len(SAMPLE[0]), len(SAMPLE[0]) + 1
    split = [(a, near, c), (near, far, c), (far, b, c), (a, b, far), (a, far, near)]
    mended = without_needles(vertices, np.vstack([faces[1:], split]))
    edges = np.diff(vertices[mended], axis=1)
    assert np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).min() > 0.1
    assert examine_mesh(vertices, mended, expected_euler=2)[0] == []
    assert mesh_volume_mm3(vertices, mended) == pytest.approx(VOLUME_MM3, rel=1e-12)


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes in one file, unchanged."""
    offsets = np.cumsum([0, *(len(mesh[0]) for mesh in meshes)])
    faces = [mesh[1] + offset for mesh, offset in zip(meshes, offsets[:-1], strict=True)]
    return np.concatenate([mesh[0] for mesh in meshes]), np.concatenate(faces)


ONE = mesh_of(slotted())
CRUMB = mesh_of(box((120.0, 0.0, -2.0), (121.0, 1.0, -1.0)))
PORE = mesh_of(slotted(box((5.0, 5.0, -15.0), (10.0, 10.0, -12.0))))


@pytest.mark.parametrize(
    "mesh", [joined(ONE, CRUMB), PORE, (PORE[0], PORE[1][:, ::-1])], ids=["crumb", "pore", "turned"]
)
def test_crumbs_and_pores_of_a_mesh_are_left_out_with_a_note(mesh):
    """No sealant gets into a pore."""
    vertices, faces, _ = one_surface(*mesh)
    body, (note,) = closed_body(vertices, faces)
    assert body.volume() == pytest.approx(VOLUME_MM3)
    assert note.text.startswith("1 loose crumbs or closed pores")


FOLD = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])


@pytest.mark.parametrize(
    ("mesh", "says"),
    [
        (sheet(), r"open edges: 350, the first near \("),
        (soup(SAMPLE, noise_mm=1e-5), "not watertight"),
        ((SAMPLE[0], np.where(TURN, SAMPLE[1][:, ::-1], SAMPLE[1])), r"opposite sides: \d+, the first"),
        # The overlap of two bodies would count twice.
        (joined(ONE, mesh_of(box((90.0, 10.0, -15.0), (110.0, 20.0, -10.0)))), "2 separate bodies: 100 x 40 x 20 mm"),
        (joined(ONE, mesh_of(box((120, 0, -15), (130, 10, -5)))), r"10 x 10 mm around \(125, 5, -10\)"),
        ((FOLD, np.array([[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]])), "not watertight"),
    ],
    ids=["sheet", "noisy soup", "turned at random", "overlap", "apart", "fold"],
)
def test_open_overlapping_or_separate_surfaces_are_refused(mesh, says):
    vertices, faces, _ = one_surface(*mesh)
    with pytest.raises(InputError, match=says):
        closed_body(vertices, faces)
