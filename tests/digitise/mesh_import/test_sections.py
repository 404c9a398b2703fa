"""Sections of a modelled cavity: of the crack at that station, and all of it there."""

from dataclasses import replace

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from digitise.mesh_import.cavity import cavity_sections
from tests.support.meshes import box
from tests.support.shapes import CLOSED, straight_slot


def test_a_section_is_square_to_the_crack_and_as_deep_as_it_is():
    """A wedge of a floor, from 4 mm deep at one end to 12 mm at the other."""
    length_mm, width_mm = 60.0, 3.0
    wedge = Manifold.hull_points(
        np.array(
            [[x, y, z] for x, depth in ((0.0, 4.0), (length_mm, 12.0)) for y in (-1.5, 1.5) for z in (0.0, -depth)]
        )
    )
    sections = cavity_sections(wedge, straight_slot(length_mm, width_mm, CLOSED))
    expected_mm = 4.0 + 8.0 * sections.s_mm / length_mm
    # The first and last cut of the floor are 0.01 mm from the ends, and a layer of the cavity is 0.25 mm thick.
    assert sections.depth_mm == pytest.approx(expected_mm, abs=2e-3)
    assert sections.area_mm2 == pytest.approx(width_mm * expected_mm, rel=0.02)
    assert np.trapezoid(sections.area_mm2, sections.s_mm) == pytest.approx(width_mm * 60.0 * 8.0, rel=1e-3)


def test_other_parts_of_the_crack_are_left_out_and_undercuts_are_not():
    """A hairpin's other leg stands beside this one; a pocket under the face's edge belongs to it."""
    leg, other_leg = box((0, -1.5, -5), (40, 1.5, 0)), box((0, 8.5, -5), (40, 11.5, 0))
    pocket = box((0, 1.5, -5), (40, 4, -3))
    cavity = Manifold.batch_boolean([leg, other_leg, box((40, -1.5, -5), (43, 11.5, 0)), pocket], OpType.Add)
    ring_mm = np.array([[0, -1.5], [43, -1.5], [43, 11.5], [0, 11.5], [0, 8.5], [40, 8.5], [40, 1.5], [0, 1.5]])
    sections = cavity_sections(cavity, replace(straight_slot(40.0, 3.0, CLOSED), outline_mm=ring_mm))
    assert sections.area_mm2[1:-3] == pytest.approx(3 * 5 + 2.5 * 2, rel=0.01)
