"""Volumes of shapes that are known by formula: mouths of scans, thin gaps, steps, shelves and floors that rise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold

from digitise.mesh_import.import_mesh import ImportedSample, import_sample
from digitise.settings import CrackShape, MeshInput
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Outline, Profile, Solid
from tests.support.meshes import block, mesh_of
from tests.support.shapes import CUT, straight_slot
from validate.metrics.volumes import balance_profile, fill_volumes

FROM_MM, TO_MM, WIDTH_MM, DEPTH_MM = 20.0, 80.0, 4.0, 10.0
LENGTH_MM = TO_MM - FROM_MM
RIGHT_MM, LEFT_MM = 18.0, 22.0


def along_x(corners_mm: list[tuple[float, float]]) -> Manifold:
    """A prism over a polygon of y and z."""
    prism = CrossSection([np.array(corners_mm, dtype=float)]).extrude(LENGTH_MM)
    return prism.transform(np.array([(0, 0, 1, FROM_MM), (1, 0, 0, 0), (0, 1, 0, 0)], dtype=float))


def slot(right_mm: float = 0.0, left_mm: float = 0.0) -> Manifold:
    """A slot with a chamfer at each side, up to 1 mm over the face."""
    floor = [(RIGHT_MM, -DEPTH_MM), (LEFT_MM, -DEPTH_MM)]
    left = [(LEFT_MM, -left_mm), (LEFT_MM + left_mm, 0.0), (LEFT_MM + left_mm, 1.0)]
    right = [(RIGHT_MM - right_mm, 1.0), (RIGHT_MM - right_mm, 0.0), (RIGHT_MM, -right_mm)]
    return along_x([*floor, *left, *right])


def brought(folder: Path, room: Manifold, rough_mm: float = 0.0) -> ImportedSample:
    """The block less a room, with noise on the face and 2.5 mm below it, as an import has it."""
    vertices_mm, faces = mesh_of(block() - room)
    if rough_mm:
        vertices_mm, faces = mesh_of((block() - room).refine_to_length(1.2))
        x, y, z = vertices_mm.T
        free = (z > -2.5) & (x > 0.01) & (x < 99.99) & (y > 0.01) & (y < 39.99)
        vertices_mm[free, 2] += rough_mm * np.random.default_rng(0).standard_normal(free.sum())
    trimesh.Trimesh(vertices_mm, faces, process=False).export(folder / "scan.stl")
    table = {"file": Path("scan.stl"), "data": "synthetic", "units": "mm"}
    return import_sample(MeshInput.model_validate(table), folder)


def built(outline: Outline, depth_mm: object) -> Solid:
    return build_solid(outline, CrackShape.model_validate({"depth_mm": depth_mm, "tilt": "vertical"}))


def at(level_mm: float) -> Profile:
    return Profile(np.array([0.0, 100.0]), np.full(2, level_mm))


@pytest.mark.parametrize(
    ("right_mm", "left_mm", "rough_mm", "tolerance"),
    [(0.0, 0.0, 0.0, 1e-4), (2.0, 0.0, 0.0, 2e-3), (0.0, 0.0, 0.2, 2e-3)],
)
def test_a_chamfer_is_of_the_mouth_and_hollows_of_a_scanned_face_are_not(
    tmp_path, right_mm, left_mm, rough_mm, tolerance
):
    """The tolerance is that of the mouth's area, half a standard deviation of the noise at a chamfer; 0.1 % of room."""
    sample = brought(tmp_path, slot(right_mm, left_mm), rough_mm)
    volumes = fill_volumes(at(1.0), sample.outline, sample.solid, 0.0, sample.outline.length_mm)
    heap_mm3 = LENGTH_MM * (WIDTH_MM + right_mm + left_mm)
    room_mm3 = LENGTH_MM * (WIDTH_MM * DEPTH_MM + (right_mm**2 + left_mm**2) / 2)
    assert volumes.overfill_mm3 == pytest.approx(heap_mm3, rel=tolerance)
    assert volumes.sealant_mm3 - volumes.overfill_mm3 == pytest.approx(room_mm3, rel=1e-3)
    flat = balance_profile(room_mm3 + heap_mm3, sample.outline, sample.solid)
    assert flat.level_mm == pytest.approx(np.full(len(flat.s_mm), 1.0), abs=tolerance + 0.01)


@pytest.mark.parametrize("tapered", [False, True])
def test_a_gap_thinner_than_the_raster_counts_where_it_is(tapered):
    """A stone from s = 10 to 20 mm, a rectangle or a diamond, leaves gaps at both sides of a slot 4 mm wide."""
    half_mm = WIDTH_MM / 2 - 0.02
    ends = [(10.0, 0.0)] if tapered else [(10.0, -half_mm), (10.0, half_mm)]
    other = [(20.0, 0.0)] if tapered else [(20.0, half_mm), (20.0, -half_mm)]
    middle = ([(15.0, half_mm)], [(15.0, -half_mm)]) if tapered else ([], [])
    stone_mm = np.array([*ends, *middle[0], *other, *middle[1]])
    crack = replace(straight_slot(40.0, WIDTH_MM, CUT), islands_mm=(stone_mm,))
    volumes = fill_volumes(at(0.0), crack, built(crack, 12.0), 11.0, 19.0)
    # A diamond is as wide as 0.6 of its middle, from 11 to 19 mm.
    of_stone_mm = half_mm * (0.6 if tapered else 1.0)
    assert volumes.sealant_mm3 == pytest.approx(8.0 * 2 * (WIDTH_MM / 2 - of_stone_mm) * 12.0, rel=1e-3)
    assert volumes.fill_ratio == pytest.approx(1.0)


def test_a_step_of_depth_parts_the_crack_where_it_is():
    """From 12 to 3 mm, in a slot 6 mm wide: within the 0.03 mm of a quarter of a cell."""
    crack, at_mm = straight_slot(40.0, 6.0, CUT), 20.3
    solid = built(crack, ((0.0, 12.0), (at_mm, 12.0), (at_mm + 1e-3, 3.0), (40.0, 3.0)))
    for from_mm, to_mm, depth_mm in ((at_mm, 40.0, 3.0), (at_mm, at_mm + 4, 3.0), (at_mm - 2, at_mm, 12.0)):
        held_mm3 = fill_volumes(at(0.0), crack, solid, from_mm, to_mm).sealant_mm3
        assert held_mm3 == pytest.approx((to_mm - from_mm) * 6.0 * depth_mm, abs=0.035 * 6.0 * 9.0)


def test_a_shelf_under_a_roof_counts_from_its_floor_to_its_roof(tmp_path):
    floor_mm, roof_mm, width_mm = -6.1, -5.9, 6.0
    shelf = [(21.9, floor_mm), (LEFT_MM + width_mm, floor_mm), (LEFT_MM + width_mm, roof_mm), (21.9, roof_mm)]
    sample = brought(tmp_path, slot() + along_x(shelf))
    for level_mm in (0.0, -6.0):
        shelf_mm = max(min(roof_mm, level_mm) - floor_mm, 0.0)
        expected_mm3 = LENGTH_MM * (WIDTH_MM * (DEPTH_MM + level_mm) + width_mm * shelf_mm)
        volumes = fill_volumes(at(level_mm), sample.outline, sample.solid, 0.0, sample.outline.length_mm)
        assert volumes.sealant_mm3 == pytest.approx(expected_mm3, rel=2e-4)


@pytest.mark.parametrize(("shallow_mm", "deep_mm", "level_mm"), [(2, 12, -6.0), (11, 12, -11.5)])
def test_a_level_that_follows_a_rising_floor_holds_nothing_there(shallow_mm, deep_mm, level_mm):
    """The wet part of a slot 3 mm wide is a wedge; 0.1 % is what its end within a bin leaves."""
    crack = straight_slot(40.0, 3.0, CUT)
    solid = built(crack, ((0.0, shallow_mm), (40.0, deep_mm)))
    wet_mm = 40.0 * (deep_mm + level_mm) / (deep_mm - shallow_mm)
    s_mm = np.array([0.0, 40.0 - wet_mm, 40.0])
    expected_mm3 = 3.0 * wet_mm * (deep_mm + level_mm) / 2
    profile = Profile(s_mm, np.maximum(level_mm, -np.interp(s_mm, [0.0, 40.0], [shallow_mm, deep_mm])))
    assert fill_volumes(profile, crack, solid, 0.0, 40.0).sealant_mm3 == pytest.approx(expected_mm3, rel=1e-3)
    assert balance_profile(expected_mm3, crack, solid).level_mm[-1] == pytest.approx(level_mm, abs=2e-3)
