"""Walls that tilt: closed forms, an angle for each wall, and the room that an undercut needs."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from digitise.geometry.mesh_topology import examine_mesh
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError
from sealtwin.core.records import FaceLabel, Floats, Outline, Solid
from tests.support.shapes import (
    CLOSED,
    CUT,
    arc_slot,
    closed_crack,
    oblique_slot,
    reversed_path,
    straight_slot,
    with_ring,
)

SLOPE = np.tan(np.radians(11.0))


def test_a_nose_between_two_branches_keeps_its_distance():
    """An L-shaped funnel: at its inner corner walls part, and a quarter of a cone of sample stands there."""
    depth_mm = 4.0
    spread = depth_mm * SLOPE
    ring = np.array([(0, 0), (20, 0), (20, 4), (4, 4), (4, 20), (0, 20)], dtype=float)
    area, perimeter = 4 * 20 + 4 * 16, 80.0
    # Sides overlap in a square at each of five corners; at the sixth they part.
    inset = area * depth_mm - perimeter * spread * depth_mm / 2 + 5 * spread**2 * depth_mm / 3
    nose = np.pi / 4 * spread**2 * depth_mm / 3
    solid = build_solid(with_ring(straight_slot(8.0, 4.0, CLOSED), ring), CrackShape(depth_mm=depth_mm, tilt="funnel"))
    assert solid.cavity_volume_mm3 == pytest.approx(inset - nose, rel=1e-5)


STONE_MM = np.array([(39.0, -0.8), (39.0, 0.8), (41.0, 0.8), (41.0, -0.8)])
RING = arc_slot(8.0, 300.0, 3.0, CLOSED)  # Nearly a ring: the sample inside hangs on a neck
STONY = replace(straight_slot(80.0, 5.0, CUT), islands_mm=(STONE_MM,))
NARROW = replace(straight_slot(40.0, 3.0, CLOSED), face_mm=(-5.0, -5.0, 45.0, 5.0))


def build(outline: Outline, angle_deg: Any, tilt: str = "undercut", depth_mm: Any = 16.0) -> Solid:
    settings = {"depth_mm": depth_mm, "tilt": tilt, "wall_angle_deg": angle_deg}
    solid = build_solid(outline, CrackShape.model_validate(settings))
    assert examine_mesh(solid.vertices_mm, solid.faces, expected_euler=2)[0] == []
    return solid


@pytest.mark.parametrize(("outline", "angle_deg"), [(closed_crack(1, 20.0), (4.0, 9.0)), (oblique_slot(), 7.0)])
def test_an_undercut_is_a_flare_upside_down(outline, angle_deg):
    """The same walls about another level, so that both solids hold the same: 1e-6 is rounding and the tidied mesh."""
    undercut, flare = (build(outline, angle_deg, tilt) for tilt in ("undercut", "flare"))
    assert undercut.cavity_volume_mm3 == pytest.approx(flare.cavity_volume_mm3, rel=1e-6)
    assert undercut.figures.mouth_width_mm == flare.figures.floor_width_mm == undercut.figures.photo_width_mm
    assert undercut.figures.floor_width_mm == flare.figures.mouth_width_mm


@pytest.mark.parametrize(
    ("outline", "largest_deg", "fault"),
    [
        # A neck of 8 mm by 60 degrees less the tips' half widths.
        (RING, 11.4, "parts of the crack meet"),
        # A stone 1.6 mm wide ends at a depth of 16 mm with tan a = 0.8 / 16.
        (STONY, np.degrees(np.arctan(0.8 / 16)), "parts of the crack meet"),
        # From the wall at 1.5 mm to half a millimetre off the side at 5 mm.
        (NARROW, np.degrees(np.arctan(3.0 / 16)), "within 0.5 mm of the block's side"),
    ],
    ids=["ring", "stone", "side"],
)
def test_an_angle_without_room_is_refused(outline, largest_deg, fault):
    build(outline, largest_deg - 0.1)
    with pytest.raises(InputError, match=fault) as refusal:
        build(outline, largest_deg + 0.1)
    assert "Reduce wall_angle_deg" in str(refusal.value)


def test_a_tooth_of_the_wall_may_end_as_a_spike():
    """A head on a thin neck: the neck ends first, and then the head, above the floor. No part of the sample hangs free.

    With an even angle from both sides a neck of 0.4 mm ends at 0.2 mm of the walls' move, a head of 1.2 mm at 0.6 mm.
    """
    tooth = np.array([(38.0, -2.5), (38.0, -0.9), (37.6, -0.9), (37.6, 0.3), (38.8, 0.3), (38.8, -0.9), (38.4, -0.9)])
    slot = straight_slot(80.0, 5.0, CUT)
    ring = np.vstack([[(0.0, -2.5)], tooth, [(38.4, -2.5), (80.0, -2.5), (80.0, 2.5), (0.0, 2.5)]])
    assert build(with_ring(slot, ring), 5.0)
    # Of a shallow crack the head reaches the floor: a bridge.
    with pytest.raises(InputError, match="parts of the crack meet"):
        build(with_ring(slot, ring), 5.0, depth_mm=4.0)


DEPTH_MM = 12.0
SLOPES = {angle_deg: np.tan(np.radians(angle_deg)) for angle_deg in (0.0, 4.0, 5.0, 6.0, 8.0, 14.0, 20.0)}


def wall_angles_deg(solid: Solid) -> tuple[Floats, Floats, Floats]:
    """Of the facets of the walls: their angles from vertical, middles and areas."""
    corners = solid.vertices_mm[solid.faces[solid.face_label == FaceLabel.WALL]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    return np.degrees(np.arcsin(normal[:, 2] / (2 * area))), corners.mean(axis=1), area


@pytest.mark.parametrize(
    ("tilt", "left_deg", "right_deg"), [("flare", 8.0, 14.0), ("flare", 0.0, 14.0), ("undercut", 8.0, 14.0)]
)
def test_a_slot_opens_by_both_its_angles(tilt, left_deg, right_deg):
    solid = build(straight_slot(80.0, 3.1, CUT), (left_deg, right_deg), tilt, DEPTH_MM)
    opening_mm = (SLOPES[left_deg] + SLOPES[right_deg]) * DEPTH_MM
    assert solid.cavity_volume_mm3 == pytest.approx(80.0 * DEPTH_MM * (3.1 + opening_mm / 2), rel=1e-6)
    assert solid.wall_angles_deg == (left_deg, right_deg)
    widths_mm = [solid.figures.mouth_width_mm, solid.figures.floor_width_mm]
    assert widths_mm == pytest.approx([3.1 + opening_mm, 3.1] if tilt == "flare" else [3.1, 3.1 + opening_mm])


def test_a_slot_closes_by_both_its_angles():
    """Walls that meet below the middle of neither: w / (tan left + tan right) down."""
    solid = build(straight_slot(80.0, 3.1, CUT), (6.0, 14.0), "funnel", DEPTH_MM)
    closing = SLOPES[6.0] + SLOPES[14.0]
    assert solid.cavity_volume_mm3 == pytest.approx(80.0 * 3.1**2 / (2 * closing), rel=1e-6)
    depth = solid.figures.closing_depth_mm
    assert depth is not None
    assert (depth.mean, depth.share_above_floor, solid.figures.floor_width_mm) == pytest.approx((3.1 / closing, 1.0, 0))
    assert all(words in solid.figures.warnings[0].text for words in ("6° left and 14° right", "8.7 mm"))


def test_a_wall_without_an_angle_stands_upright_up_to_the_tip():
    """A shift that begins at none leaves no flat piece behind, and holds as much as one that begins at hardly any."""
    slot = straight_slot(20.0, 4.0, CLOSED)
    outlines = [closed_crack(1, 20.0), slot, reversed_path(slot)]
    for outline, tilt in itertools.product(outlines, ("flare", "funnel", "undercut")):
        solid, nearly = (build(outline, (left_deg, 8.0), tilt, DEPTH_MM) for left_deg in (0.0, 1e-3))
        assert solid.figures.jitter_mm == 0.0
        assert solid.cavity_volume_mm3 == pytest.approx(nearly.cavity_volume_mm3, rel=2e-4)


def test_an_island_tilts_like_the_wall_on_its_side_of_the_walk():
    """Left of the centreline 5 degrees, right of it 14, all around."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    stone = np.column_stack([np.cos(turn), -np.sin(turn)])
    places = {5.0: np.array([12.0, 3.0]), 14.0: np.array([28.0, -3.0])}
    outline = replace(straight_slot(40.0, 12.0, CUT), islands_mm=tuple(stone + centre for centre in places.values()))
    angle_deg, middle, area = wall_angles_deg(build(outline, (5.0, 14.0), "funnel", DEPTH_MM))
    for expected_deg, centre_mm in places.items():
        stone_wall = (np.linalg.norm(middle[:, :2] - centre_mm, axis=1) < 2.2) & (area > 1e-3)
        assert stone_wall.sum() > 20
        assert np.average(angle_deg[stone_wall], weights=area[stone_wall]) == pytest.approx(expected_deg, abs=0.1)
