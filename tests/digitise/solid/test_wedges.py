"""Tilted walls: closed forms, an angle for each wall, and the space that an undercut needs."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from digitise.geometry.mesh_topology import examine_mesh
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Solid
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

STONE_MM = np.array([(39.0, -0.8), (39.0, 0.8), (41.0, 0.8), (41.0, -0.8)])
RING = arc_slot(8.0, 300.0, 3.0, CLOSED)  # Nearly a ring: a neck joins the sample inside
STONY = replace(straight_slot(80.0, 5.0, CUT), islands_mm=(STONE_MM,))
NARROW = replace(straight_slot(40.0, 3.0, CLOSED), face_mm=(-5.0, -5.0, 45.0, 5.0))


def build(outline: Outline, angle_deg: Any, tilt: str = "undercut", depth_mm: Any = 16.0) -> Solid:
    settings = {"depth_mm": depth_mm, "tilt": tilt, "wall_angle_deg": angle_deg}
    solid = build_solid(outline, CrackShape.model_validate(settings))
    assert examine_mesh(solid.vertices_mm, solid.faces, expected_euler=2)[0] == []
    return solid


@pytest.mark.parametrize(("outline", "angle_deg"), [(closed_crack(1, 20.0), (4.0, 9.0)), (oblique_slot(), 7.0)])
def test_an_undercut_has_the_volume_of_a_flare_with_the_same_angles(outline, angle_deg):
    """Both have the same walls about another level. Tolerance: rounding and the tidied mesh, 1e-6."""
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
def test_an_undercut_angle_too_large_for_the_crack_is_refused(outline, largest_deg, fault):
    build(outline, largest_deg - 0.1)
    with pytest.raises(InputError, match=fault) as refusal:
        build(outline, largest_deg + 0.1)
    assert "Reduce wall_angle_deg" in str(refusal.value)


def test_a_tooth_of_the_wall_is_accepted_if_it_ends_above_the_floor():
    """The tooth is a head on a thin neck. Both end above the floor, so that no part of the sample hangs free.

    With an even angle from both sides a neck of 0.4 mm ends at 0.2 mm of the walls' move, a head of 1.2 mm at 0.6 mm.
    """
    tooth = np.array([(38.0, -2.5), (38.0, -0.9), (37.6, -0.9), (37.6, 0.3), (38.8, 0.3), (38.8, -0.9), (38.4, -0.9)])
    slot = straight_slot(80.0, 5.0, CUT)
    ring = np.vstack([[(0.0, -2.5)], tooth, [(38.4, -2.5), (80.0, -2.5), (80.0, 2.5), (0.0, 2.5)]])
    assert build(with_ring(slot, ring), 5.0)
    # In a shallow crack the head reaches the floor and makes a bridge.
    with pytest.raises(InputError, match="parts of the crack meet"):
        build(with_ring(slot, ring), 5.0, depth_mm=4.0)


DEPTH_MM = 12.0
SLOPES = {angle_deg: np.tan(np.radians(angle_deg)) for angle_deg in (0.0, 4.0, 5.0, 6.0, 8.0, 14.0, 20.0)}


@pytest.mark.parametrize(
    ("tilt", "left_deg", "right_deg"), [("flare", 8.0, 14.0), ("flare", 0.0, 14.0), ("undercut", 8.0, 14.0)]
)
def test_both_wall_angles_widen_a_slot_as_in_the_closed_form(tilt, left_deg, right_deg):
    solid = build(straight_slot(80.0, 3.1, CUT), (left_deg, right_deg), tilt, DEPTH_MM)
    opening_mm = (SLOPES[left_deg] + SLOPES[right_deg]) * DEPTH_MM
    assert solid.cavity_volume_mm3 == pytest.approx(80.0 * DEPTH_MM * (3.1 + opening_mm / 2), rel=1e-6)
    assert solid.wall_angles_deg == (left_deg, right_deg)
    widths_mm = [solid.figures.mouth_width_mm, solid.figures.floor_width_mm]
    assert widths_mm == pytest.approx([3.1 + opening_mm, 3.1] if tilt == "flare" else [3.1, 3.1 + opening_mm])


def test_a_wall_angle_of_0_gives_the_volume_of_a_nearly_upright_wall():
    """An angle of exactly 0 leaves no flat remainder at the tip; the nearly upright wall has 0.001 degrees."""
    slot = straight_slot(20.0, 4.0, CLOSED)
    outlines = [closed_crack(1, 20.0), slot, reversed_path(slot)]
    for outline, tilt in itertools.product(outlines, ("flare", "funnel", "undercut")):
        solid, nearly = (build(outline, (left_deg, 8.0), tilt, DEPTH_MM) for left_deg in (0.0, 1e-3))
        assert solid.figures.jitter_mm == 0.0
        assert solid.cavity_volume_mm3 == pytest.approx(nearly.cavity_volume_mm3, rel=2e-4)
