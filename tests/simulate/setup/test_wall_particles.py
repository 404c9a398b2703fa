from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from digitise.mesh_import.import_mesh import import_sample
from digitise.settings import CrackShape, MeshInput
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import FaceLabel, Floats, Outline, Solid
from simulate.setup.signed_distance import CM, MARGIN_MM, build_barrier
from simulate.setup.wall_particles import (
    WallParticles,
    calibrated_wall_mass,
    place_walls,
    source_wall_mass,
    spread_points,
)
from tests.support.meshes import scanned
from tests.support.shapes import straight_slot
from tests.support.small_fluids import slot

RADIUS_MM = 0.4


def walls_of(solid: Solid, outline) -> tuple[WallParticles, Any, Any]:
    """The layer, its points in mm and its shares."""
    walls = place_walls(solid, outline, build_barrier(solid, outline, RADIUS_MM, "cpu"), RADIUS_MM)
    return walls, walls.position_and_share.numpy()[:, :3] / CM, walls.position_and_share.numpy()[:, 3]


def crack(shape: str) -> tuple[Solid, Outline]:
    """A slot of that tilt, lean or with a stone in it; a scan of a crack with its grain."""
    if shape == "scanned":
        with TemporaryDirectory() as folder:
            trimesh.Trimesh(*scanned(from_mm=40.0, to_mm=70.0), process=False).export(Path(folder, "scan.ply"))
            scan = MeshInput(file=Path("scan.ply"), data="synthetic", units="mm")
            sample = import_sample(scan, Path(folder))
        return sample.solid, sample.outline
    tilt, _, odd = shape.partition(" ")
    turn = -2 * np.pi * np.arange(24) / 24
    stone = np.array([10.0, 0.6]) + 1.2 * np.column_stack([np.cos(turn), np.sin(turn)])
    outline = replace(straight_slot(20.0, 6.0), islands_mm=(stone,) if odd == "stone" else ())
    depth_mm = ((0.0, 3.0), (8.0, 7.0), (12.0, 4.0)) if odd == "hills" else 7.0
    settings = {"depth_mm": depth_mm, "tilt": tilt, "wall_angle_deg": 5.5}
    return build_solid(outline, CrackShape.model_validate(settings)), outline


@pytest.mark.parametrize("shape", [*["lean hills", "flare stone"], pytest.param("scanned", marks=pytest.mark.slow)])
def test_the_layer_lies_a_radius_deep_and_covers_what_sealant_can_touch(shape):
    """Bounds of the design study: holes of 1.1 particles at most, no two nearer than 0.75, none on the wrong side.

    A hole is the distance from where a particle might lie, R deep, to the nearest that does. Beside the mouth's edge
    none may lie, because the other face is nearer; from there it is never more than another tenth.
    """
    solid, outline = crack(shape)
    barrier = build_barrier(solid, outline, RADIUS_MM, "cpu")
    walls = place_walls(solid, outline, barrier, RADIUS_MM)
    point, share = walls.position_and_share.numpy()[:, :3] / CM, walls.position_and_share.numpy()[:, 3]
    assert barrier.exact_mm(point).max() < -0.88 * RADIUS_MM
    near = KDTree(point)
    assert near.query(point, k=2)[0][:, 1].min() > 0.75 * 2 * RADIUS_MM
    touched = np.isin(solid.face_label, [FaceLabel.WALL, FaceLabel.FLOOR])
    mesh = trimesh.Trimesh(solid.vertices_mm, solid.faces[touched], process=False)
    sample: Any = trimesh.sample.sample_surface(mesh, 5000, seed=0)
    surface, face = sample
    deep = surface - RADIUS_MM * mesh.face_normals[face]
    hole_mm, lies_deep = near.query(deep)[0], barrier.exact_mm(deep) < -0.9 * RADIUS_MM
    assert lies_deep.mean() > 0.8
    assert hole_mm[lies_deep].max() < 1.1 * 2 * RADIUS_MM
    assert hole_mm.max() < 1.2 * 2 * RADIUS_MM
    assert share.min() >= 0


def test_the_face_is_covered_beside_the_crack_and_no_farther():
    """What heaps up over the mouth rests on wall particles for 12 mm, and beyond on the plane of the face."""
    solid, outline = slot()
    _, point, _ = walls_of(solid, outline)
    rows = KDTree(np.vstack([outline.left_wall_mm, outline.centreline_mm, outline.right_wall_mm]))
    mesh = trimesh.Trimesh(solid.vertices_mm, solid.faces[solid.face_label == FaceLabel.TOP], process=False)
    sample: Any = trimesh.sample.sample_surface(mesh, 5000, seed=0)
    deep = sample[0] - np.array([0.0, 0.0, RADIUS_MM])
    away_mm, hole_mm = rows.query(deep[:, :2])[0], KDTree(point).query(deep)[0]
    beside = (away_mm > 1.0) & (away_mm < MARGIN_MM - 2 * RADIUS_MM)
    assert beside.sum() > 500
    assert hole_mm[beside].max() < 1.2 * 2 * RADIUS_MM
    assert rows.query(point[:, :2])[0].max() < MARGIN_MM + RADIUS_MM


def test_walls_that_lean_far_are_covered_to_the_floor():
    """Its floor lies 18 mm beside its mouth; a margin around the mouth alone ends at a depth of 34 mm."""
    solid, outline = slot(tilt="lean", depth_mm=40.0, angle_deg=24.0)
    _, point, _ = walls_of(solid, outline)
    assert point[:, 2].min() == pytest.approx(-40 - RADIUS_MM, abs=1e-3)
    depth, _ = np.histogram(point[:, 2], bins=np.linspace(-39, -1, 9))
    assert depth.min() > 0.8 * depth.max()


def test_shares_add_up_to_the_surface():
    """Two walls from the floor up to 0.8 mm below the face, 18 mm long; the floor's layer apart."""
    solid, outline = slot(20.0, depth_mm=7.0)
    _, point, share = walls_of(solid, outline)
    upright = (np.abs(point[:, 1]) < 2.5) & (np.abs(point[:, 0] - 10) < 9) & (point[:, 2] < -0.8) & (point[:, 2] > -6.6)
    assert share[upright].sum() * (2 * RADIUS_MM) ** 2 == pytest.approx(2 * 18 * (7 - 0.8 - 0.4), rel=0.03)


def test_the_calibrated_strength_is_a_fifth_of_the_sources():
    """The prototype measures 0.21 to 0.24 of 1 / W(0) over the distances at which fluid rests."""
    assert calibrated_wall_mass(0.04) / source_wall_mass(0.04) == pytest.approx(0.22, abs=0.01)
    # Both are volumes: ten times the radius, a thousand times the mass.
    assert calibrated_wall_mass(0.4) == pytest.approx(1e3 * calibrated_wall_mass(0.04))


def test_a_flat_wall_completes_the_density():
    """Fluid of rest density up to the wall, in a continuum: kernel inside the fluid plus wall particles make 1."""
    solid, outline = slot(20.0, width_mm=8.0, depth_mm=10.0)
    _, point, share = walls_of(solid, outline)
    support = 4 * RADIUS_MM
    rng = np.random.default_rng(0)
    place = np.column_stack([rng.uniform(6, 14, 400), np.full(400, -4 + 0.86 * RADIUS_MM), rng.uniform(-7, -3, 400)])
    away = np.linalg.norm(place[:, None] - point, axis=2)
    weight = 315 / (64 * np.pi * support**9) * np.clip(support**2 - away**2, 0, None) ** 3
    from_walls = calibrated_wall_mass(RADIUS_MM) * (share * weight).sum(axis=1)
    # Sphere of the kernel, cut by the wall at 0.86 R: 28.6 % of its weight is beyond.
    z = np.linspace(0.86 * RADIUS_MM, support, 4001)
    beyond = np.trapezoid(315 / (256 * support**9) * (support**2 - z**2) ** 4, z)
    assert from_walls.mean() == pytest.approx(beyond, rel=0.03)
    assert from_walls.std() < 0.1 * beyond


SPACING_MM = 0.2


def areas_mm2(triangles: Floats) -> Floats:
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2


@pytest.fixture(scope="module")
def soup() -> Floats:
    """Triangles of all sizes and slants, upright and level ones among them."""
    triangles = np.random.default_rng(0).uniform(-30, 30, (60, 3, 3))
    triangles[:10, :, 2] = triangles[:10, :1, 2]
    triangles[10:20, :, 0] = triangles[10:20, :1, 0]
    return triangles


def test_a_triangle_gets_its_area_s_worth_of_points(soup):
    """A lattice is off by what its rim cuts at random: half a square for some of the hundreds along it."""
    points = spread_points(soup, SPACING_MM)
    covered = np.bincount(points.face, minlength=len(soup)) * SPACING_MM**2
    large = areas_mm2(soup) > 50
    assert large.sum() > 40
    assert covered[large] == pytest.approx(areas_mm2(soup)[large], rel=0.02)
    assert covered.sum() == pytest.approx(areas_mm2(soup).sum(), rel=1e-3)


def test_points_lie_in_their_triangles(soup):
    soup = soup[::4]
    points = spread_points(soup, SPACING_MM)
    a, b, c = soup[points.face].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.abs(((points.position_mm - a) * normal).sum(axis=1)).max() < 1e-9
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        inward = np.cross(normal, side) / np.linalg.norm(side, axis=1)[:, None]
        # They stand beside their nodes by up to a thousandth of a step.
        assert ((points.position_mm - start) * inward).sum(axis=1).min() > -2e-3 * SPACING_MM


def test_a_plane_cut_into_more_triangles_has_the_same_points(soup):
    soup = soup[::4]
    vertices: Any = soup.reshape(-1, 3)
    faces: Any = np.arange(3 * len(soup)).reshape(-1, 3)
    whole = spread_points(soup, SPACING_MM)
    for _ in range(2):
        parts: Any = trimesh.remesh.subdivide(vertices, faces)
        vertices, faces = parts
    cut = spread_points(vertices[faces], SPACING_MM)
    assert len(cut.position_mm) == len(whole.position_mm)
    away, which = KDTree(cut.position_mm).query(whole.position_mm)
    assert away.max() < 1e-9
    assert np.array_equal(np.sort(which), np.arange(len(whole.lot)))
    assert np.array_equal(cut.lot[which], whole.lot)


def test_a_wall_of_narrow_facets_gets_its_share_all_along():
    """Strips of a quarter of a step, upright like a rough crack's: a lattice in line with them would miss most."""
    x = np.arange(0.0, 20.0, SPACING_MM / 4)
    y = 0.01 * np.random.default_rng(0).standard_normal(len(x))
    foot, top = (np.column_stack([x, y, np.full_like(x, z)]) for z in (0.0, 16.0))
    strips = np.vstack([np.stack([foot[:-1], foot[1:], top[1:]], 1), np.stack([foot[:-1], top[1:], top[:-1]], 1)])
    points = spread_points(strips, SPACING_MM).position_mm
    per_mm, _ = np.histogram(points[:, 0], bins=np.arange(0.0, 20.0, 1.0))
    area_mm2, _ = np.histogram(strips.mean(axis=1)[:, 0], bins=np.arange(0.0, 20.0, 1.0), weights=areas_mm2(strips))
    assert per_mm * SPACING_MM**2 == pytest.approx(area_mm2, rel=0.1)


def test_triangles_without_area_get_no_points():
    assert len(spread_points(np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]]), SPACING_MM).position_mm) == 0
    assert len(spread_points(np.zeros((0, 3, 3)), SPACING_MM).position_mm) == 0


def test_random_numbers_of_points_have_no_pattern():
    """As evenly spread as chance has them, and those of neighbours in a row unlike each other."""
    points = spread_points(np.array([[[0.0, 0, 0], [60, 0, 0], [0, 60, 0]]]), SPACING_MM)
    chance = points.lot / 2.0**64
    counts, _ = np.histogram(chance, bins=20)
    assert counts == pytest.approx(np.full(20, len(chance) / 20), rel=0.08)
    assert abs(np.corrcoef(chance[:-1], chance[1:])[0, 1]) < 0.02
