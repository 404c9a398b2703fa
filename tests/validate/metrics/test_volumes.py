"""Volumes below a level, and the level of a volume, compared with prisms."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold

from digitise.mesh_import.import_mesh import ImportedSample, import_sample
from digitise.settings import CrackShape, MeshInput
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats, Outline, Profile, Run, Solid
from sealtwin.core.run_figures import RunHealth
from tests.support.meshes import block, mesh_of
from tests.support.shapes import CUT, closed_crack, straight_slot, with_ring
from validate.comparison import MassBalance
from validate.metrics.volumes import CavityByLevel, balance_profile, cavity_by_level, fill_volumes, mass_balance
from validate.settings import Readings

LENGTH_MM, WIDTH_MM, DEPTH_MM = 80.0, 3.0, 16.0
OUTLINE = straight_slot(LENGTH_MM, WIDTH_MM)
TANGENT = np.tan(np.radians(5.5))


@cache
def solid(tilt: str = "vertical", angle_deg: float = 0.0) -> Solid:
    return built(OUTLINE, tilt=tilt, angle_deg=angle_deg)


def flat(level_mm: float) -> Profile:
    return Profile(np.array([0.0, 100.0]), np.full(2, level_mm))


def built(outline: Outline, depth_mm: object = DEPTH_MM, tilt: str = "vertical", angle_deg: float = 0.0) -> Solid:
    shape = {"depth_mm": depth_mm, "tilt": tilt, "wall_angle_deg": angle_deg}
    return build_solid(outline, CrackShape.model_validate(shape))


@pytest.mark.parametrize(
    ("tilt", "angle_deg", "level_mm", "air_mm2", "sealant_mm2"),
    [
        ("vertical", 0.0, -8, 24.0, 24.0),
        ("flare", 5.5, -8, 8 * (3 + 2 * 12 * TANGENT), 8 * (3 + 2 * 4 * TANGENT)),
        ("undercut", 5.5, -8, 8 * (3 + 2 * 4 * TANGENT), 8 * (3 + 2 * 12 * TANGENT)),
        # Its walls meet between two levels.
        ("funnel", 11.0, -16, 3**2 / (4 * np.tan(np.radians(11))), 0.0),
        ("lean", 11.0, 2, 0.0, 3 * 16 + 3 * 2.0),
    ],
)
def test_volumes_below_and_above_a_level_agree_with_prisms(tilt, angle_deg, level_mm, air_mm2, sealant_mm2):
    volumes = fill_volumes(flat(level_mm), OUTLINE, solid(tilt, angle_deg), 0, 80)
    assert volumes.underfill_mm3 == pytest.approx(80 * air_mm2, rel=1e-3 if tilt == "funnel" else 1e-6, abs=1e-9)
    assert volumes.sealant_mm3 == pytest.approx(80 * sealant_mm2, rel=1e-6, abs=1e-9)
    assert volumes.overfill_mm3 == pytest.approx(80 * 3 * max(level_mm, 0), abs=1e-9)
    filled_mm3 = volumes.sealant_mm3 - volumes.overfill_mm3
    assert volumes.fill_ratio == pytest.approx(filled_mm3 / (filled_mm3 + volumes.underfill_mm3))


@pytest.mark.parametrize(
    ("tilt", "angle_deg", "volume_mm3", "level_mm"),
    [
        ("vertical", 0.0, 80 * 3 * 10, -6.0),
        ("vertical", 0.0, 80 * 3 * 20, 4.0),  # 80 x 3 x 16 below the face, the rest above its mouth
        ("flare", 5.5, 80 * (3 + 8 * TANGENT) * 8, -8.0),
        ("undercut", 5.5, 80 * (3 + 24 * TANGENT) * 8, -8.0),
    ],
)
def test_the_flat_level_of_a_volume_agrees_with_a_prism(tilt, angle_deg, volume_mm3, level_mm):
    sample = solid(tilt, angle_deg)
    baseline = balance_profile(volume_mm3, OUTLINE, sample)
    assert baseline.level_mm == pytest.approx(np.full(len(baseline.s_mm), level_mm), abs=1e-6)
    assert (baseline.s_mm[0], baseline.s_mm[-1]) == pytest.approx((0.0, LENGTH_MM))
    assert fill_volumes(baseline, OUTLINE, sample, 0, LENGTH_MM).sealant_mm3 == pytest.approx(volume_mm3, rel=1e-5)


RADIUS_MM = 0.4
WET = Readings(file=Path("P.csv"), data="measured", role="held-out", state="wet")


def run(position_mm, spilled=()) -> Run:
    position_mm = np.array(position_mm, dtype=float)
    over = np.isin(np.arange(len(position_mm)), spilled)
    zero = np.zeros_like(position_mm)
    return Run(position_mm, zero, over, RADIUS_MM, 2.0, {}, zero[:, 0], 0, "cpu", RunHealth())


def balance(sealant: Run, ratio: float = 1.0, settings: Readings = WET) -> MassBalance:
    """The mass balance of a run in the vertical slot, beside readings of 90 mm3."""
    return mass_balance(sealant, solid(), ratio, 90.0, settings)


def test_the_parts_of_the_mass_balance_add_up_to_the_dispensed_volume():
    """Ten particles of 2 mm³: five below the face, three above, two over the edge; the settled ones fill 15 mm³."""
    heights_mm = [-8.0, -6, -4, -2, -1, 0.5, 0.6, 0.7, -90, -90]
    parts = balance(run([[10.0 * i, 0, z] for i, z in enumerate(heights_mm)], spilled=(8, 9)), 0.75)
    assert (parts.dispensed_mm3, parts.spilled_mm3, parts.lost_mm3) == (20.0, 4.0, 1.0)
    assert parts.in_crack_mm3 == pytest.approx(15 * 5 / 8)
    assert parts.in_crack_mm3 + parts.above_mm3 + parts.spilled_mm3 + parts.lost_mm3 == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("position_mm", "spilled", "footprint_mm2"),
    [
        # Its disc reaches over the edge of the mouth, at 1.5 mm; its middle does not.
        ([[40.0, 1.25, 0.3]], (), 0.0),
        ([[40.0, 6.0, 0.3]], (), pytest.approx(np.pi * 0.16, rel=1 / 3)),
        ([[x, 6.0, 0.3] for x in np.arange(20, 60, 0.4)], (), pytest.approx(40 * 0.8, rel=0.15)),
        ([[40.0, 6.0, -40.0]], (0,), 0.0),
    ],
    ids=["heap", "disc", "film", "spilled"],
)
def test_the_footprint_includes_films_beside_the_mouth_but_no_heaps(position_mm, spilled, footprint_mm2):
    """A disc of 0.4 mm covers 0.50 mm²; cells of 0.2 mm measure it to a third, and a row of discs to 10 %."""
    assert balance(run(position_mm, spilled)).footprint_mm2 == footprint_mm2


SIDE_CRACK = np.array([(0, -3), (40, -3), (40, 3), (22, 3), (22, 20), (18, 20), (18, 3), (0, 3)], dtype=float)
SLOT = straight_slot(40.0, 6.0, CUT)
RISING = ((0.0, 12.0), (15.0, 6.0), (25.0, 6.0), (30.0, 10.0))
STONE = np.array([(12.0, -1.5), (12.0, 1.5), (28.0, 1.5), (28.0, -1.5)])


def whole_mm3(cavity: CavityByLevel, level_mm: float = 0.0) -> Floats:
    return cavity.below_mm3(np.full(len(cavity.ends_mm) - 1, level_mm))


@pytest.mark.parametrize(
    ("outline", "tilt", "angle_deg", "depth_mm"),
    [
        (closed_crack(4, 30.0, 8.0), "flare", 30.0, RISING),
        (replace(SLOT, islands_mm=(STONE,)), "vertical", 0.0, RISING),
        (with_ring(SLOT, SIDE_CRACK), "vertical", 0.0, RISING),
    ],
    ids=["flare with tips", "stone", "side crack"],
)
def test_volumes_of_stretches_add_up_to_the_volume_of_the_cavity(outline, tilt, angle_deg, depth_mm):
    """The tolerance is 0.2 %, since rising floors cross layers of 0.25 mm."""
    solid = built(outline, depth_mm, tilt, angle_deg)
    assert whole_mm3(cavity_by_level(outline, solid)).sum() == pytest.approx(solid.cavity_volume_mm3, rel=2e-3)


FROM_MM, TO_MM, SLOT_MM, DEEP_MM = 20.0, 80.0, 4.0, 10.0
ROOM_MM = TO_MM - FROM_MM
RIGHT_MM, LEFT_MM = 18.0, 22.0


def along_x(corners_mm: list[tuple[float, float]]) -> Manifold:
    """A prism over a polygon of y and z."""
    prism = CrossSection([np.array(corners_mm, dtype=float)]).extrude(ROOM_MM)
    return prism.transform(np.array([(0, 0, 1, FROM_MM), (1, 0, 0, 0), (0, 1, 0, 0)], dtype=float))


def slot(right_mm: float = 0.0, left_mm: float = 0.0) -> Manifold:
    """A slot with a chamfer at each side, up to 1 mm over the face."""
    floor = [(RIGHT_MM, -DEEP_MM), (LEFT_MM, -DEEP_MM)]
    left = [(LEFT_MM, -left_mm), (LEFT_MM + left_mm, 0.0), (LEFT_MM + left_mm, 1.0)]
    right = [(RIGHT_MM - right_mm, 1.0), (RIGHT_MM - right_mm, 0.0), (RIGHT_MM, -right_mm)]
    return along_x([*floor, *left, *right])


def brought(folder: Path, room: Manifold, rough_mm: float = 0.0) -> ImportedSample:
    """An imported block less a cavity, with noise on the face and to 2.5 mm below it."""
    vertices_mm, faces = mesh_of(block() - room)
    if rough_mm:
        vertices_mm, faces = mesh_of((block() - room).refine_to_length(1.2))
        x, y, z = vertices_mm.T
        free = (z > -2.5) & (x > 0.01) & (x < 99.99) & (y > 0.01) & (y < 39.99)
        vertices_mm[free, 2] += rough_mm * np.random.default_rng(0).standard_normal(free.sum())
    trimesh.Trimesh(vertices_mm, faces, process=False).export(folder / "scan.stl")
    table = {"file": Path("scan.stl"), "data": "synthetic", "units": "mm"}
    return import_sample(MeshInput.model_validate(table), folder)


@pytest.mark.parametrize(
    ("right_mm", "left_mm", "rough_mm", "tolerance"),
    [(0.0, 0.0, 0.0, 1e-4), (2.0, 0.0, 0.0, 2e-3), (0.0, 0.0, 0.2, 2e-3)],
)
def test_the_mouth_includes_chamfers_but_no_hollows_of_a_rough_face(tmp_path, right_mm, left_mm, rough_mm, tolerance):
    """The tolerance is that of the mouth's area, at a chamfer half the noise; 0.1 % for the volume below the face."""
    sample = brought(tmp_path, slot(right_mm, left_mm), rough_mm)
    volumes = fill_volumes(flat(1.0), sample.outline, sample.solid, 0.0, sample.outline.length_mm)
    heap_mm3 = ROOM_MM * (SLOT_MM + right_mm + left_mm)
    room_mm3 = ROOM_MM * (SLOT_MM * DEEP_MM + (right_mm**2 + left_mm**2) / 2)
    assert volumes.overfill_mm3 == pytest.approx(heap_mm3, rel=tolerance)
    assert volumes.sealant_mm3 - volumes.overfill_mm3 == pytest.approx(room_mm3, rel=1e-3)
    baseline = balance_profile(room_mm3 + heap_mm3, sample.outline, sample.solid)
    assert baseline.level_mm == pytest.approx(np.full(len(baseline.s_mm), 1.0), abs=tolerance + 0.01)


def test_the_volume_in_a_side_cavity_is_measured_from_its_floor_to_its_roof(tmp_path):
    floor_mm, roof_mm, width_mm = -6.1, -5.9, 6.0
    shelf = [(21.9, floor_mm), (LEFT_MM + width_mm, floor_mm), (LEFT_MM + width_mm, roof_mm), (21.9, roof_mm)]
    sample = brought(tmp_path, slot() + along_x(shelf))
    for level_mm in (0.0, -6.0):
        shelf_mm = max(min(roof_mm, level_mm) - floor_mm, 0.0)
        expected_mm3 = ROOM_MM * (SLOT_MM * (DEEP_MM + level_mm) + width_mm * shelf_mm)
        volumes = fill_volumes(flat(level_mm), sample.outline, sample.solid, 0.0, sample.outline.length_mm)
        assert volumes.sealant_mm3 == pytest.approx(expected_mm3, rel=2e-4)
