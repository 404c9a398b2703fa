"""The sample's solid, compared with closed forms and with its own files."""

import dataclasses
from functools import cache
from itertools import combinations
from typing import get_args

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold, Mesh64

from digitise.geometry.mesh_topology import examine_mesh
from digitise.geometry.polyline import signed_area
from digitise.settings import CrackShape, Tilt
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import read_solid, write_solid
from sealtwin.core.records import FaceLabel, Solid
from tests.support.meshes import labelled_mm2
from tests.support.shapes import (
    CLOSED,
    CUT,
    OPEN,
    arc_slot,
    cut_crack,
    oblique_slot,
    pinched_crack,
    straight_slot,
    wandering_crack,
    with_ring,
)

TILTS: tuple[Tilt, ...] = ("vertical", "lean", "flare", "funnel", "undercut")
DEPTH_MM, ANGLE_DEG = 16.0, 11.0
SLOPE = np.tan(np.radians(ANGLE_DEG))
L, W = 80.0, 3.1


def shape(tilt: Tilt = "lean", **changes) -> CrackShape:
    return CrackShape.model_validate({"depth_mm": DEPTH_MM, "tilt": tilt} | changes)


def manifold(solid: Solid) -> Manifold:
    return Manifold(Mesh64(solid.vertices_mm.copy(), solid.faces.astype(np.uint64)))


CRACKS = {
    "slot": straight_slot(L, W, CUT),
    "oblique": oblique_slot(W),
    "open": wandering_crack(1, rough_mm=0.05),
    "cut": cut_crack(2, rough_mm=0.05),
    "closed": pinched_crack(1),
}


@cache
def solid_of(crack: str, tilt: Tilt) -> Solid:
    return build_solid(CRACKS[crack], shape(tilt))


SLOT_VOLUMES = {
    "vertical": L * W * DEPTH_MM,
    "lean": L * W * DEPTH_MM,
    "flare": L * (W * DEPTH_MM + SLOPE * DEPTH_MM**2),
    "funnel": L * W**2 / (4 * SLOPE),
    "undercut": L * (W * DEPTH_MM + SLOPE * DEPTH_MM**2),
}


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize(("crack", "within"), [("slot", 1e-6), ("oblique", 1e-5)])
def test_the_volume_of_a_slot_is_its_section_times_its_length(crack, within, tilt):
    """The volumes are closed forms; the funnel's walls meet at 8.0 mm, half way down.

    Sections of the paper's oblique slot are parallelograms: ends cut obliquely by the block change no volume.
    """
    assert solid_of(crack, tilt).cavity_volume_mm3 == pytest.approx(SLOT_VOLUMES[tilt], rel=within)


def test_two_tilts_never_give_the_same_solid():
    """In a slot 5 mm deep, a wall moves by 0.97 mm, so that its place at the mouth or at the floor differs.

    With two equal rows in ``TILTS``, two tilts build the same walls, and this fails.
    """
    walls_mm = {}
    for tilt in get_args(Tilt):
        body = manifold(build_solid(straight_slot(10.0, W, CUT), shape(tilt, depth_mm=5.0)))
        block = CrossSection.square((20.0, 6.0), center=True).translate((5.0, 0.0))
        walls_mm[tilt] = np.ravel([(block - body.slice(z_mm)).bounds()[1::2] for z_mm in (-0.01, -4.99)])
    for first, second in combinations(walls_mm, 2):
        assert np.abs(walls_mm[first] - walls_mm[second]).max() > 0.9, (first, second)


@pytest.mark.parametrize(("crack", "tilt"), [("open", "undercut"), ("cut", "flare"), ("closed", "funnel")])
def test_a_solid_is_closed_and_unchanged_after_writing_and_reading(tmp_path, crack, tilt):
    """The solid is closed in memory and in a float32 STL, which merges vertices by their coordinates.

    The glTF is in metres with y up and z towards the viewer, so that +y of the photo points away from the viewer.
    """
    solid = solid_of(crack, tilt)
    assert examine_mesh(solid.vertices_mm, solid.faces, expected_euler=2)[0] == []
    write_solid(tmp_path, solid)
    stl = trimesh.load_mesh(tmp_path / "crack.stl")
    assert (stl.is_watertight, stl.is_winding_consistent, stl.euler_number) == (True, True, 2)
    assert stl.volume == pytest.approx(manifold(solid).volume(), rel=1e-6)
    gltf = trimesh.load_mesh(tmp_path / "crack.glb", process=False)
    x, y, z = 1000 * gltf.vertices.T
    assert np.abs(np.column_stack([x, -z, y]) - solid.vertices_mm).max() <= 1e-5  # float32 at 160 mm
    assert np.array_equal(gltf.faces, solid.faces)
    read_back = read_solid(tmp_path)
    for name in ("faces", "face_label", "cavity_volume_mm3", "wall_angles_deg"):
        assert np.array_equal(getattr(read_back, name), getattr(solid, name)), name
    for name in ("s_mm", "depth_mm", "area_mm2"):
        assert getattr(read_back.sections, name) == pytest.approx(getattr(solid.sections, name), abs=1e-5)


@pytest.mark.parametrize("tilt", TILTS)
def test_dams_close_the_open_ends_of_a_crack(tilt):
    """Below the face the cavity is a hole in the sample, closed at its sides; above the face the dams are plates."""
    solid = solid_of("oblique", tilt)
    body = manifold(solid)
    # Inner contours run clockwise: one hole, whose whole rim is sample.
    assert sum(signed_area(ring) < 0 for ring in body.slice(-1.0).to_polygons()) == 1
    plates = np.array([np.ptp(plate, axis=0) for plate in body.slice(5.0).to_polygons()])
    assert len(plates) == 2
    assert plates[:, 0].min() > 8.0 + W
    assert plates[:, 1] == pytest.approx(4.0)
    assert body.slice(10.5).is_empty()
    assert {tuple(dam.box_mm)[2] for dam in solid.figures.dams} == {-20.0}


def test_labelled_areas_of_a_flared_slot_equal_the_closed_form():
    solid = solid_of("slot", "flare")
    length, width = np.subtract(solid.block_mm[2:], solid.block_mm[:2])
    mouth, block, sides = W + 2 * SLOPE * DEPTH_MM, length * width, 2 * 20.0 * (length + width)
    expected = {
        FaceLabel.TOP: block - L * mouth,
        FaceLabel.FLOOR: L * W,
        FaceLabel.WALL: 2 * L * DEPTH_MM / np.cos(np.radians(ANGLE_DEG)),
        FaceLabel.END: 2 * DEPTH_MM * (W + mouth) / 2,
        FaceLabel.OUTSIDE: block + sides,
    }
    for label, area in expected.items():
        assert labelled_mm2(solid, label) == pytest.approx(area, rel=1e-6), label.name


SHORT, NARROW = straight_slot(40.0, 3.0, CLOSED), straight_slot(10.0, 0.2, CLOSED)
BOW_TIE = with_ring(SHORT, np.array([[0.0, -1.5], [20.0, 1.5], [20.0, -1.5], [0.0, 1.5]]))


@pytest.mark.parametrize(
    ("outline", "changes", "says"),
    [
        (BOW_TIE, {}, r"crosses itself near \(10.0, -?0.0\) mm"),
        (dataclasses.replace(SHORT, face_mm=(-1.0, -1.6, 41.0, 20.0)), {}, "within 0.5 mm"),
        (dataclasses.replace(SHORT, face_mm=(50.0, 0.0, 90.0, 9.0)), {}, "No part of the crack is on the face"),
        (dataclasses.replace(SHORT, ends=OPEN, face_mm=(-9.0, -9.0, 49.0, 9.0)), {}, "End 1 is open, but"),
        (NARROW, {"tilt": "funnel", "wall_angle_deg": 50.0}, "nothing to fill"),
        (NARROW, {"depth_mm": 0.2}, "less than 1 mm³, .* depth_mm and the scale"),
        *((oblique_slot(W), {"depth_mm": 500.0, "tilt": tilt}, r"97\.2 mm sideways") for tilt in ("lean", "flare")),
        (with_ring(straight_slot(), np.zeros((2, 2))), {}, "2 points"),
        (with_ring(straight_slot(), np.full((4, 2), np.nan)), {}, "Give 3 or more points, and only finite numbers"),
        (arc_slot(10.0, 359.0, 3.0, CLOSED), {}, "no side to lean to"),
    ],
)
def test_a_crack_from_which_no_solid_can_be_built_is_refused_with_the_reason(outline, changes, says):
    with pytest.raises(InputError, match=says):
        build_solid(outline, shape(**changes))
