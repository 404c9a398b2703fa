"""The cavity of a crack in a block, its sections, and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from digitise.mesh_import.block import cut_block
from digitise.mesh_import.cavity import Cavity, cavity_sections, find_cavity
from sealtwin.core.errors import InputError
from tests.support.meshes import SLOT_MM3, block, box, slotted
from tests.support.shapes import CLOSED, straight_slot

BELOW_MM = 0.05


def cavity_in(body: Manifold) -> Cavity:
    return find_cavity(cut_block(body, BELOW_MM), BELOW_MM)


FUNNEL = [[x, y, z] for x in (20.0, 80.0) for y, z in ((19.0, -5.0), (21.0, -5.0), (14.0, 0.0), (26.0, 0.0))]


@pytest.mark.parametrize(
    ("body", "volume_mm3", "depth_mm"),
    [
        (slotted(), SLOT_MM3, 10.0),
        # At 45 degrees the mouth is 0.1 mm wider than where it is seen; without its rim, 6 mm³ would be missing.
        (block() - Manifold.hull_points(np.array(FUNNEL)), 60 * (2 + 12) / 2 * 5, 5.0),
        # The room is an undercut that opens only in the slot's floor.
        (slotted(box((30.0, 10.0, -14.0), (50.0, 30.0, -9.0))), SLOT_MM3 + 20 * 20 * 5 - 20 * 4 * 1, 14.0),
        (slotted(box((-1.0, 18.0, -10.0), (101.0, 22.0, 1.0))), 100 * 4 * 10, 10.0),
    ],
    ids=["slot", "funnel", "room below", "open at both ends"],
)
def test_the_cavity_has_the_volume_and_depth_of_the_modelled_crack(body, volume_mm3, depth_mm):
    cavity = cavity_in(body)
    assert cavity.volume_mm3 == pytest.approx(volume_mm3)
    assert cavity.depth_mm == pytest.approx(depth_mm)
    assert cavity.warnings == ()


def test_the_error_for_a_block_with_two_cracks_states_where_both_are():
    two = slotted(box((20.0, 5.0, -6.0), (70.0, 9.0, 1.0)))
    with pytest.raises(InputError, match=r"240 mm² .*\(50, 20\) and 200 mm² .*\(45, 7\)"):
        cavity_in(two)


@pytest.mark.parametrize(
    ("body", "says"),
    [
        # Sealant would run out through the underside.
        (slotted(box((40.0, 19.0, -25.0), (45.0, 21.0, -5.0))), "underside"),
        (block() - box((10.0, 5.0, -3.0), (10.9, 5.9, 1.0)), "No crack opens in the face"),
    ],
    ids=["through", "pore"],
)
def test_a_crack_through_the_underside_and_a_pore_are_refused(body, says):
    with pytest.raises(InputError, match=says):
        cavity_in(body)


def test_a_section_includes_undercuts_but_not_the_other_leg_of_a_hairpin_crack():
    """Each leg is 3 mm wide and 5 mm deep; a pocket of 2.5 x 2 mm is under the edge of the face."""
    leg, other_leg = box((0, -1.5, -5), (40, 1.5, 0)), box((0, 8.5, -5), (40, 11.5, 0))
    pocket = box((0, 1.5, -5), (40, 4, -3))
    cavity = Manifold.batch_boolean([leg, other_leg, box((40, -1.5, -5), (43, 11.5, 0)), pocket], OpType.Add)
    ring_mm = np.array([[0, -1.5], [43, -1.5], [43, 11.5], [0, 11.5], [0, 8.5], [40, 8.5], [40, 1.5], [0, 1.5]])
    sections = cavity_sections(cavity, replace(straight_slot(40.0, 3.0, CLOSED), outline_mm=ring_mm))
    assert sections.area_mm2[1:-3] == pytest.approx(3 * 5 + 2.5 * 2, rel=0.01)
