"""Points on planes: as many as their area asks for, inside their triangles, and the same however a plane is cut up."""

from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from sealtwin.core.records import Floats
from simulate.setup.wall_particles import spread_points

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


def test_no_place_is_far_from_a_point_and_no_two_are_near(soup):
    """A square lattice: its points a step apart, its widest hole 0.71 of a step."""
    points = spread_points(soup[:1], SPACING_MM).position_mm
    near = KDTree(points)
    assert near.query(points, k=2)[0][:, 1].min() > 0.99 * SPACING_MM
    inner = soup[0].mean(axis=0) + 0.9 * (
        np.random.default_rng(1).dirichlet([1, 1, 1], 2000) @ soup[0] - soup[0].mean(axis=0)
    )
    assert near.query(inner)[0].max() < 0.72 * SPACING_MM


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


def test_needles_get_none():
    assert len(spread_points(np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]]), SPACING_MM).position_mm) == 0
    assert len(spread_points(np.zeros((0, 3, 3)), SPACING_MM).position_mm) == 0


def test_lots_have_no_pattern():
    """As evenly spread as chance has them, and those of neighbours in a row unlike each other."""
    points = spread_points(np.array([[[0.0, 0, 0], [60, 0, 0], [0, 60, 0]]]), SPACING_MM)
    chance = points.lot / 2.0**64
    counts, _ = np.histogram(chance, bins=20)
    assert counts == pytest.approx(np.full(20, len(chance) / 20), rel=0.08)
    assert abs(np.corrcoef(chance[:-1], chance[1:])[0, 1]) < 0.02
