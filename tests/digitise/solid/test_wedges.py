"""Wedges: fans, mitres and tips against cones and pyramids."""

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.footprint import Footprint, lay_out
from digitise.solid.wedges import MITRE_DEG, carve, wall_shifts_mm
from sealtwin.core.records import Floats
from tests.support.shapes import CLOSED, straight_slot, with_ring

SLOPE = np.tan(np.radians(11.0))


def polygon(sides: int, radius_mm: float) -> Floats:
    turn = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    return radius_mm * np.column_stack([np.cos(turn), np.sin(turn)])


def cavity_mm3(ring: Floats, shape: CrackShape) -> float:
    footprint: Footprint = lay_out(with_ring(straight_slot(8.0, 4.0, CLOSED), ring), shape, max(wall_shifts_mm(shape)))
    block_mm3 = footprint.block.area() * (shape.deepest_mm + shape.floor_thickness_mm)
    return block_mm3 - carve(footprint, shape, ()).volume()


@pytest.mark.parametrize("sides", [3, 4, 6])
def test_a_flare_over_a_regular_polygon_has_rounded_corners(sides):
    """Prism, a slanted slab on each side, and a whole cone shared among the corners, which facets slightly exceed."""
    ring = polygon(sides, 2.0)
    inner_mm = 2.0 * np.cos(np.pi / sides)
    area, perimeter = sides * inner_mm**2 * np.tan(np.pi / sides), 2 * sides * inner_mm * np.tan(np.pi / sides)
    spread = 16.0 * SLOPE
    cone = np.pi * spread**2 * 16.0 / 3
    most = np.tan(np.radians(MITRE_DEG / 2)) / np.radians(MITRE_DEG / 2)
    straight = area * 16.0 + perimeter * spread * 16.0 / 2
    volume = cavity_mm3(ring, CrackShape(depth_mm=16.0, tilt="flare"))
    assert straight + cone < volume < straight + most * cone * (1 + 1e-6)


def test_a_nose_between_two_branches_keeps_its_distance():
    """An L-shaped funnel: at its inner corner walls part, and a quarter of a cone of sample stands there."""
    depth_mm = 4.0
    spread = depth_mm * SLOPE
    ring = np.array([(0, 0), (20, 0), (20, 4), (4, 4), (4, 20), (0, 20)], dtype=float)
    area, perimeter = 4 * 20 + 4 * 16, 80.0
    # Sides overlap in a square at each of five corners; at the sixth they part.
    inset = area * depth_mm - perimeter * spread * depth_mm / 2 + 5 * spread**2 * depth_mm / 3
    nose = np.pi / 4 * spread**2 * depth_mm / 3
    volume = cavity_mm3(ring, CrackShape(depth_mm=depth_mm, tilt="funnel"))
    assert volume == pytest.approx(inset - nose, rel=1e-5)
