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
from simulate.setup.signed_distance import CM, build_barrier
from simulate.setup.wall_particles import (
    WallParticles,
    calibrated_wall_mass,
    place_walls,
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
    """A slot of this tilt, with a floor of several depths or with a stone; or a scan of a crack with its grain."""
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
def test_wall_particles_cover_all_walls_that_sealant_can_touch(shape):
    """By the design study holes are at most 1.1 diameters, and particles at least 0.75 apart, none in the cavity.

    A hole is the distance from a possible position, R deep, to the nearest wall particle. Beside the mouth's edge no
    position is possible, because the other face is nearer; holes there may be a tenth larger.
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


def test_the_particles_of_a_flat_wall_complete_the_density_of_the_fluid():
    """In a continuous fluid at rest density up to the wall, fluid and wall particles make a density of 1."""
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


@pytest.fixture(scope="module")
def soup() -> Floats:
    """Triangles of all sizes and slants, upright and level ones among them."""
    triangles = np.random.default_rng(0).uniform(-30, 30, (60, 3, 3))
    triangles[:10, :, 2] = triangles[:10, :1, 2]
    triangles[10:20, :, 0] = triangles[10:20, :1, 0]
    return triangles


def test_points_spread_over_triangles_are_inside_their_triangles(soup):
    soup = soup[::4]
    points = spread_points(soup, SPACING_MM)
    a, b, c = soup[points.face].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.abs(((points.position_mm - a) * normal).sum(axis=1)).max() < 1e-9
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        inward = np.cross(normal, side) / np.linalg.norm(side, axis=1)[:, None]
        # Points are shifted from their nodes by up to a thousandth of a step.
        assert ((points.position_mm - start) * inward).sum(axis=1).min() > -2e-3 * SPACING_MM
