"""Sections of a mesh across a crack."""

import numpy as np
import pytest
import trimesh

from validate.figures.particles import cut_rings


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
