"""The crack from above: cleaned without moving its walls, run out, and dammed where it leaves the block."""

import dataclasses

import numpy as np
import pytest

from digitise.footprint import dams, lay_out
from digitise.readings import section
from digitise.settings import CrackShape
from digitise.wedges import tilted_by_mm
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline
from tests.shapes import CLOSED, CUT, OPEN, oblique_slot, straight_slot, wandering_crack, with_ring

VERTICAL = CrackShape(depth_mm=16.0, tilt="vertical")


def ring_of(points: list[tuple[float, float]]) -> Outline:
    return with_ring(straight_slot(20.0, 3.0, CLOSED), np.array(points))


@pytest.mark.parametrize("seed", range(3))
def test_cleaning_keeps_the_area(seed):
    """Within 0.02 %: simplifying to 0.01 mm loses 0.06 % of a pinched crack."""
    outline = wandering_crack(seed, rough_mm=0.05)
    footprint = lay_out(outline, VERTICAL, 0.0)
    assert section(footprint, VERTICAL, 0.0).area() == pytest.approx(signed_area(outline.outline_mm), rel=2e-4)


def test_an_oblique_end_is_the_same_wherever_its_walls_stop():
    """Stations lie square to the centreline: at the end one wall stops short of the block's side, one passes it."""
    outline = oblique_slot()
    square = np.array([0.5, -np.sqrt(0.75)])
    walls = []
    for wall, half in ((outline.left_wall_mm, -1.55), (outline.right_wall_mm, 1.55)):
        stations = wall.copy()
        stations[0], stations[-1] = (outline.centreline_mm[i] + half * square for i in (0, -1))
        walls.append(stations)
    stationed = dataclasses.replace(outline, left_wall_mm=walls[0], right_wall_mm=walls[1])
    given, by_stations = (section(lay_out(o, VERTICAL, 0.0), VERTICAL, 0.0) for o in (outline, stationed))
    assert (given - by_stations).area() + (by_stations - given).area() < 1e-6


def test_dams_stand_on_the_side_that_the_crack_leaves_by():
    footprint = lay_out(oblique_slot(), VERTICAL, 0.0)
    first, second = dams(footprint, [section(footprint, VERTICAL, 0.0)])
    opening = 3.1 / np.sin(np.radians(30))
    assert (first.end, first.side, second.end, second.side) == (0, 1, 1, 3)
    assert first.box_mm[1::2] == (-4.0, 0.0)
    assert second.box_mm[1::2] == (40.0, 44.0)
    for dam in (first, second):
        assert dam.box_mm[2] - dam.box_mm[0] == pytest.approx(opening + 8.0, abs=0.01)


@pytest.mark.parametrize(("tilt", "reaches"), [("lean", 3.11), ("flare", 3.11)])
def test_dams_cover_what_the_tilt_opens(tilt, reaches):
    """Lean moves the opening's foot along the side, flare widens its top."""
    shape = CrackShape(depth_mm=16.0, tilt=tilt)
    footprint = lay_out(straight_slot(80.0, 3.1, OPEN), shape, tilted_by_mm(shape))
    first, _ = dams(footprint, [section(footprint, shape, depth_mm) for depth_mm in (0.0, 16.0)])
    assert first.box_mm[3] == pytest.approx(1.55 + reaches + 4.0, abs=0.01)
    assert first.box_mm[1] == pytest.approx(-1.55 - 4.0 - (reaches if tilt == "flare" else 0.0), abs=0.01)


def test_a_crack_out_of_a_corner_is_refused():
    """A dam covers one side; a cavity that leaves by two would leak round the corner."""
    slot = straight_slot(80.0, 3.1, OPEN)
    cornered = dataclasses.replace(slot, face_mm=(0.0, -1.0, 80.0, 20.0))
    footprint = lay_out(cornered, VERTICAL, 0.0)
    with pytest.raises(InputError, match="within 0 mm of the block side"):
        dams(footprint, [section(footprint, VERTICAL, 0.0)])


def test_specks_are_dropped_and_islands_filled_and_both_are_named():
    thread = ring_of([(0, 0), (9, 0), (9, 1.0), (9.004, 1.0), (9.004, 0), (20, 0), (20, 3), (0, 3)])
    kept = lay_out(thread, VERTICAL, 0.0)
    assert kept.crack.area() == pytest.approx(60.0, rel=1e-3)
    necked = ring_of([(0, 0), (10, 0), (10, 1.498), (10.5, 1.498), (10.5, 0), (20, 0), (20, 3), (10.5, 3)])
    neck = [(10.5, 1.502), (10.0, 1.502), (10.0, 3.0), (0.0, 3.0)]
    necked = with_ring(necked, np.vstack([necked.outline_mm, neck]))
    apart = lay_out(necked, VERTICAL, 0.0)
    assert apart.crack.num_contour() == 2
    assert any("in 2 pieces" in warning for warning in apart.warnings)
    speck = ring_of([(0, 0), (10, 0), (10, 1.498), (10.5, 1.498), (10.5, 1.4), (10.7, 1.4), (10.7, 1.6), (10.5, 1.6)])
    speck = with_ring(speck, np.vstack([speck.outline_mm, [(10.5, 1.502), (10.0, 1.502), (10.0, 3.0), (0.0, 3.0)]]))
    dropped = lay_out(speck, VERTICAL, 0.0)
    assert dropped.crack.num_contour() == 1
    assert any("piece of 0.040 mm² dropped" in warning for warning in dropped.warnings)


def test_a_small_loop_is_left_out_and_named():
    """0.02 mm² where the trace turned back on itself; a loop of 0.05 mm² is the user's to mend."""
    looped = ring_of([(0, 0), (10.2, 0), (10.0, -0.2), (10.0, 0.2), (10.2, 0.0001), (20, 0), (20, 3), (0, 3)])
    footprint = lay_out(looped, VERTICAL, 0.0)
    assert any("crosses itself near (10.0" in warning for warning in footprint.warnings)


def test_a_crack_that_comes_back_past_its_cut_end_is_refused():
    """A hairpin whose second leg runs on beyond the cut of the first."""
    hairpin = straight_slot(20.0, 3.0, CUT)
    ring = np.array(
        [(0, -1.5), (24, -1.5), (24, 6.5), (-9, 6.5), (-9, 3.5), (20, 3.5), (20, 1.5), (0, 1.5)], dtype=float
    )
    with pytest.raises(InputError, match="comes back past one of its own cut ends"):
        lay_out(with_ring(hairpin, ring), VERTICAL, 0.0)


def test_clockwise_rings_are_the_same_crack():
    outline = wandering_crack(1)
    turned = with_ring(outline, outline.outline_mm[::-1])
    one, other = (lay_out(o, VERTICAL, 0.0).crack.area() for o in (outline, turned))
    assert other == pytest.approx(one, rel=1e-6)


def signed_area(ring: Floats) -> float:
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
