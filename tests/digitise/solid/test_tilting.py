"""Walls at their own angles, left and right, against closed forms."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from digitise.geometry.mesh_topology import check_mesh
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import FaceLabel, Floats, Outline, Solid
from tests.support.shapes import CLOSED, CUT, closed_crack, reversed_path, straight_slot

DEPTH_MM = 12.0
SLOPE = {angle_deg: np.tan(np.radians(angle_deg)) for angle_deg in (0.0, 4.0, 5.0, 6.0, 8.0, 14.0, 20.0)}


def build(outline: Outline, tilt: str, left_deg: float, right_deg: float) -> Solid:
    settings = {"depth_mm": DEPTH_MM, "tilt": tilt, "wall_angle_deg": (left_deg, right_deg)}
    return build_solid(outline, CrackShape.model_validate(settings))


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
    solid = build(straight_slot(80.0, 3.1, CUT), tilt, left_deg, right_deg)
    opening_mm = (SLOPE[left_deg] + SLOPE[right_deg]) * DEPTH_MM
    assert solid.cavity_volume_mm3 == pytest.approx(80.0 * DEPTH_MM * (3.1 + opening_mm / 2), rel=1e-6)
    assert solid.wall_angles_deg == (left_deg, right_deg)
    widths_mm = [solid.figures.mouth_width_mm, solid.figures.floor_width_mm]
    assert widths_mm == pytest.approx([3.1 + opening_mm, 3.1] if tilt == "flare" else [3.1, 3.1 + opening_mm])


def test_a_slot_closes_by_both_its_angles():
    """Walls that meet below the middle of neither: w / (tan left + tan right) down."""
    solid = build(straight_slot(80.0, 3.1, CUT), "funnel", 6.0, 14.0)
    closing = SLOPE[6.0] + SLOPE[14.0]
    assert solid.cavity_volume_mm3 == pytest.approx(80.0 * 3.1**2 / (2 * closing), rel=1e-6)
    assert solid.figures.closing_depth_mm is not None
    assert solid.figures.closing_depth_mm.mean == pytest.approx(3.1 / closing)
    assert solid.figures.closing_depth_mm.share_above_floor == 1.0
    assert solid.figures.floor_width_mm == 0.0
    assert "At 6° left and 14° right the walls meet" in solid.figures.warnings[0].text
    assert "8.7 mm" in solid.figures.warnings[0].text


def test_a_wall_without_an_angle_stands_upright_up_to_the_tip():
    """A shift that begins at none leaves no flat piece behind, and holds as much as one that begins at hardly any."""
    slot = straight_slot(20.0, 4.0, CLOSED)
    outlines = [closed_crack(1, 20.0), slot, reversed_path(slot)]
    for outline, tilt in itertools.product(outlines, ("flare", "funnel", "undercut")):
        solid, nearly = (build(outline, tilt, left_deg, 8.0) for left_deg in (0.0, 1e-3))
        assert solid.figures.jitter_mm == 0.0
        assert check_mesh(solid.vertices_mm, solid.faces, expected_euler=2) == []
        assert solid.cavity_volume_mm3 == pytest.approx(nearly.cavity_volume_mm3, rel=2e-4)


def test_an_island_tilts_like_the_wall_on_its_side_of_the_walk():
    """Left of the centreline 5 degrees, right of it 14, all around."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    stone = np.column_stack([np.cos(turn), -np.sin(turn)])
    places = {5.0: np.array([12.0, 3.0]), 14.0: np.array([28.0, -3.0])}
    outline = replace(straight_slot(40.0, 12.0, CUT), islands_mm=tuple(stone + at for at in places.values()))
    angle_deg, middle, area = wall_angles_deg(build(outline, "funnel", 5.0, 14.0))
    for expected_deg, centre_mm in places.items():
        stone_wall = (np.linalg.norm(middle[:, :2] - centre_mm, axis=1) < 2.2) & (area > 1e-3)
        assert stone_wall.sum() > 20
        assert np.average(angle_deg[stone_wall], weights=area[stone_wall]) == pytest.approx(expected_deg, abs=0.1)
