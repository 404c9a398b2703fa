"""Where particles lie along and across a crack."""

import numpy as np
import pytest
import trimesh

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from tests.shapes import straight_slot
from validate.figures.particles import AlongCrack, cut_rings


def test_places_along_a_crack_run_on_past_its_ends_and_left_is_above_zero(evidence):
    """The slot of this trial runs along x from the origin, so s is x, and left of it is y."""
    points_mm = np.array([[-7.0, 1.0], [0.0, 0.5], [13.0, -1.2], [47.0, 2.0]])
    s_mm, aside_mm = AlongCrack(evidence.outline).of(points_mm)
    assert s_mm == pytest.approx(points_mm[:, 0], abs=0.06)
    assert aside_mm == pytest.approx(points_mm[:, 1], abs=0.01)


def area(ring) -> float:
    x, y = ring.T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


@pytest.mark.parametrize("angle_deg", [0, 33, 90])
def test_a_cylinder_is_cut_into_one_rectangle_and_a_ring_into_two(angle_deg):
    angle = np.radians(angle_deg)
    across = np.array([np.cos(angle), np.sin(angle)])
    cylinder = trimesh.creation.cylinder(radius=5, height=4, sections=64)
    (ring,) = cut_rings(cylinder.vertices, cylinder.faces, np.zeros(2), across)
    assert area(ring) == pytest.approx(40, rel=0.01)
    assert np.ptp(ring[:, 1]) == pytest.approx(4)
    assert cut_rings(cylinder.vertices, cylinder.faces, 9 * across, across) == [], "beside it there is nothing"
    annulus = trimesh.creation.annulus(r_min=3, r_max=5, height=2)
    rings = cut_rings(annulus.vertices, annulus.faces, np.zeros(2), across + np.array([0.0, 0.01]))
    assert sorted(map(area, rings)) == pytest.approx([4, 4], rel=0.05)


def test_a_leaning_crack_is_seen_from_its_start():
    """Right of the path is right in the picture; the section lacks exactly the cavity."""
    outline = straight_slot(length_mm=30.0)
    solid = build_solid(outline, CrackShape(depth_mm=10.0, tilt="lean", wall_angle_deg=10.0, lean_to="left"))
    (ring,) = cut_rings(solid.vertices_mm, solid.faces, np.array([15.3, 0.0]), np.array([1.0, 0.0]))
    whole = np.ptp(ring[:, 0]) * np.ptp(ring[:, 1])
    assert area(ring) == pytest.approx(whole - 3.1 * 10.0, rel=1e-3)
    floor = ring[np.isclose(ring[:, 1], -10.0, atol=1e-6)]
    # The floor of a crack that leans to the left lies left of its mouth.
    assert (floor[:, 0].min() + floor[:, 0].max()) / 2 == pytest.approx(-10 * np.tan(np.radians(10)), abs=0.01)
