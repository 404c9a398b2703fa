"""The crack in a block, what is none, the path that somebody brings along, and sections of the cavity."""

from dataclasses import replace

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from digitise.mesh_import.block import cut_block
from digitise.mesh_import.cavity import Cavity, cavity_sections, find_cavity, in_mouth, read_path
from sealtwin.core.errors import InputError
from tests.support.meshes import SLOT_MM3, block, box, slotted
from tests.support.shapes import CLOSED, straight_slot

BELOW_MM = 0.05


def cavity_in(body: Manifold, line_mm: np.ndarray | None = None) -> Cavity:
    return find_cavity(cut_block(body, BELOW_MM), BELOW_MM, line_mm)


FUNNEL = [[x, y, z] for x in (20.0, 80.0) for y, z in ((19.0, -5.0), (21.0, -5.0), (14.0, 0.0), (26.0, 0.0))]


@pytest.mark.parametrize(
    ("body", "volume_mm3", "depth_mm"),
    [
        (slotted(), SLOT_MM3, 10.0),
        # At 45 degrees the mouth is 0.1 mm wider than where it is seen; without its rim, 6 mm³ would be missing.
        (block() - Manifold.hull_points(np.array(FUNNEL)), 60 * (2 + 12) / 2 * 5, 5.0),
        # Undercut, and reached from the slot's floor alone.
        (slotted(box((30.0, 10.0, -14.0), (50.0, 30.0, -9.0))), SLOT_MM3 + 20 * 20 * 5 - 20 * 4 * 1, 14.0),
        (slotted(box((-1.0, 18.0, -10.0), (101.0, 22.0, 1.0))), 100 * 4 * 10, 10.0),
    ],
    ids=["slot", "funnel", "room below", "open at both ends"],
)
def test_the_cavity_is_all_of_the_block_that_the_mouth_leads_to(body, volume_mm3, depth_mm):
    cavity = cavity_in(body)
    assert cavity.volume_mm3 == pytest.approx(volume_mm3)
    assert cavity.depth_mm == pytest.approx(depth_mm)
    assert cavity.warnings == ()


def test_two_cracks_compete_until_a_path_chooses():
    two = slotted(box((20.0, 5.0, -6.0), (70.0, 9.0, 1.0)))
    with pytest.raises(InputError, match=r"240 mm² .*\(50, 20\) and 200 mm² .*\(45, 7\)"):
        cavity_in(two)
    line_mm = np.column_stack([np.linspace(10, 75, 30), np.full(30, 7.0)])
    assert cavity_in(two, line_mm).volume_mm3 == pytest.approx(50 * 4 * 6)


@pytest.mark.parametrize(
    ("body", "says"),
    [
        # A crack through the underside holds nothing.
        (slotted(box((40.0, 19.0, -25.0), (45.0, 21.0, -5.0))), "underside"),
        (block() - box((10.0, 5.0, -3.0), (10.9, 5.9, 1.0)), "No crack opens in the face"),
    ],
    ids=["through", "pore"],
)
def test_what_is_no_crack_is_refused(body, says):
    with pytest.raises(InputError, match=says):
        cavity_in(body)


@pytest.mark.parametrize("text", ["z_mm,x_mm,y_mm\r\n0,1,2\r\n0,3,4.5\r\n", "\ufeffy_mm,x_mm\n2,1\n4.5,3"])
def test_x_and_y_are_read_by_their_columns(tmp_path, text):
    (tmp_path / "path.csv").write_text(text, encoding="utf-8")
    assert np.array_equal(read_path(tmp_path / "path.csv"), [[1.0, 2.0], [3.0, 4.5]])


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "path.csv, row 1: no column x_mm"),
        (b"x_mm,y_mm\n1,2\n1,2\n", "1 different point"),
        (b"x_mm,y_mm\n1,2\n3\n", "row 3: the row has 1 cells"),
        (b"x_inch,y_inch\n1,2\n3,4\n", "row 1: column 'x_inch'"),
        (b"x_mm,y_mm\n1,nan\n3,4\n", "row 2, column y_mm: nan"),
    ],
)
def test_what_is_no_path_is_refused_with_its_row(tmp_path, content, says):
    (tmp_path / "path.csv").write_bytes(content)
    with pytest.raises(InputError, match=says):
        read_path(tmp_path / "path.csv")


def test_a_path_beside_the_crack_is_refused():
    with pytest.raises(InputError, match=r"outside the crack on 100% of its length"):
        in_mouth(cavity_in(slotted()).mouth, np.array([[10.0, 35.0], [90.0, 35.0]]))


def test_a_section_is_square_to_the_crack_and_as_deep_as_it_is():
    """A wedge of a floor, from 4 mm deep at one end to 12 mm at the other."""
    length_mm, width_mm = 60.0, 3.0
    ends = ((0.0, 4.0), (length_mm, 12.0))
    wedge = Manifold.hull_points(np.array([[x, y, z] for x, depth in ends for y in (-1.5, 1.5) for z in (0.0, -depth)]))
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
