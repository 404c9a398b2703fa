"""Sections of the fast model, compared with their solid and with their numerical derivative."""

from dataclasses import replace

import numpy as np
import pytest

from sealtwin.core.records import Sections
from simulate.slot.sections import Trapezoids, sections_of
from tests.support.small_fluids import slot

WAYS = {"flare": 5.5, "lean": 11.0, "vertical": 0.0, "funnel": 3.0, "undercut": 4.84}


def made(tilt: str, angle_deg: float, reach_per_mm: float = 0.5) -> Trapezoids:
    solid, outline = slot(20.0, 3.1, 16.0, tilt, angle_deg)
    return sections_of(outline, solid, 40, reach_per_mm=reach_per_mm)


@pytest.mark.parametrize("tilt", WAYS)
def test_the_height_area_and_width_of_a_section_are_consistent(tilt: str):
    """Height inverts area, and width is its derivative. Seen to fail with the other root of the quadratic."""
    sections = made(tilt, WAYS[tilt])
    for height_mm in np.outer([-0.1, 0.0, 0.01, 0.5, 5.0, 8.0, 15.9, 16.5, 17.0, 19.0, 22.0, 30.0, 60.0], np.ones(40)):
        area_mm2, width_mm = sections.area_mm2(height_mm)
        np.testing.assert_allclose(sections.height_mm(area_mm2), height_mm, atol=1e-9)
        if height_mm[0] in (0.5, 8.0, 17.0, 22.0, 30.0):
            low, high = (sections.area_mm2(height_mm + off)[0] for off in (-1e-4, 1e-4))
            np.testing.assert_allclose(width_mm, (high - low) / 2e-4, rtol=1e-6)


def test_the_plug_radius_in_a_square_duct_follows_from_cheegers_constant():
    """Cheeger's constant of a square of side 1 is 2 + sqrt(pi); the section is its lower half."""
    radius_mm = Trapezoids.holding_mm(np.array([0.5]), np.array([2.0]))
    assert radius_mm[0] == pytest.approx(1 / (2 + np.sqrt(np.pi)), rel=1e-12)
    # Between plates corners do not matter.
    assert Trapezoids.holding_mm(np.array([1e4]), np.array([2e4]))[0] == pytest.approx(0.5, rel=1e-4)


def of_a_mesh(width_mm: np.ndarray) -> Trapezoids:
    """Sections of walls as wide as given, from the floor evenly up to a mouth of 3.1 mm."""
    solid, outline = slot(20.0, 3.1, 16.0, "vertical", 0.0)
    levels_mm = np.linspace(-16.0, 0.0, len(width_mm))
    layers_mm2 = (width_mm[1:] + width_mm[:-1]) / 2 * np.diff(levels_mm)
    below_mm2 = np.concatenate([[0.0], np.cumsum(layers_mm2)])
    ends = np.array([0.0, 20.0])
    table = Sections(ends, np.full(2, 16.0), np.full(2, below_mm2[-1]), levels_mm, np.tile(below_mm2, (2, 1)))
    modelled = replace(solid, tilt="modelled", sections=table)
    return sections_of(outline, modelled, 40, reach_per_mm=0.5)


@pytest.mark.parametrize("floor_mm", [6.2, 3.1, 1.0])
def test_sections_of_a_mesh_with_straight_walls_are_trapezoids(floor_mm: float):
    """Undercut walls are included. Areas are interpolated linearly over 0.5 mm, an error of 0.1 %."""
    sections = of_a_mesh(np.linspace(floor_mm, 3.1, 33))
    assert sections.floor_mm == pytest.approx(np.full(40, floor_mm))
