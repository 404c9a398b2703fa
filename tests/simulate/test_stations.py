"""A place in the crack knows its arc length, also around a bend."""

import numpy as np
import pytest

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.records import Floats
from simulate.fluid.coarse_pressure import map_arc_length
from tests.shapes import arc_slot, straight_slot

SPACING_MM = 1.6
BEND_MM = 12.0


def read(centreline_mm: Floats, place_mm: Floats) -> tuple[Floats, Floats]:
    """Arc length and direction at each place, as kernels read them: nearest node, and straight on from there."""
    low, high = centreline_mm.min(axis=0) - 8.0, centreline_mm.max(axis=0) + 8.0
    stations, reach = map_arc_length(centreline_mm, low, high, SPACING_MM, "cpu")
    node = np.rint((place_mm - low) / SPACING_MM).astype(int)
    table = stations.at.numpy()[node[:, 0] * stations.count[1] + node[:, 1]]
    s_mm = table[:, 0] + ((place_mm - low - SPACING_MM * node) * table[:, 1:]).sum(axis=1)
    assert reach[0] - SPACING_MM <= s_mm.min()
    assert s_mm.max() <= reach[1] + SPACING_MM
    return s_mm, table[:, 1:]


def test_around_a_bend_of_four_widths_it_is_right_to_a_fraction_of_a_radius():
    """The map's nodes lie 1.6 mm apart and the crack turns by 8 degrees between two: 0.14 mm and 6 degrees off."""
    outline = arc_slot(BEND_MM, 80.0, 3.1)
    turn, away = np.random.default_rng(0).uniform((0, -1.5), (np.radians(80), 1.5), (500, 2)).T
    place_mm = (BEND_MM + away)[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    s_mm, along = read(outline.centreline_mm, place_mm)
    assert np.abs(s_mm - arc_length_at(place_mm, outline.centreline_mm)).max() < 0.2
    tangent = np.column_stack([-np.sin(turn), np.cos(turn)])
    assert (along * tangent).sum(axis=1).min() > np.cos(np.radians(10))
    assert np.linalg.norm(along, axis=1) == pytest.approx(1.0, abs=1e-5)


def test_beyond_its_ends_the_crack_runs_straight_on():
    """Sealant on the face beside an end, or against a dam."""
    place_mm = np.array([[-3.0, 0.5], [14.0, -2.0], [5.3, 1.2]])
    s_mm, along = read(straight_slot(10.0).centreline_mm, place_mm)
    assert s_mm == pytest.approx(place_mm[:, 0], abs=1e-5)
    assert along == pytest.approx(np.tile([1.0, 0.0], (3, 1)), abs=1e-6)
