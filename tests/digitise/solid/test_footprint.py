"""The crack from above: run out past its flat ends, which are the same however its walls were measured."""

import dataclasses

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.footprint import lay_out
from digitise.solid.tilt_variants import Slicer
from sealtwin.core.errors import InputError
from tests.shapes import CUT, oblique_slot, straight_slot, with_ring

VERTICAL = CrackShape(depth_mm=16.0, tilt="vertical")


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
    given, by_stations = (Slicer(lay_out(o, VERTICAL, 0.0), VERTICAL).cavity(0.0) for o in (outline, stationed))
    assert (given - by_stations).area() + (by_stations - given).area() < 1e-6


def test_a_crack_that_comes_back_past_its_cut_end_is_refused():
    """A hairpin whose second leg runs on beyond the cut of the first."""
    hairpin = straight_slot(20.0, 3.0, CUT)
    ring = np.array(
        [(0, -1.5), (24, -1.5), (24, 6.5), (-9, 6.5), (-9, 3.5), (20, 3.5), (20, 1.5), (0, 1.5)], dtype=float
    )
    with pytest.raises(InputError, match=r"One end of the crack is cut, .* Move the end along the crack"):
        lay_out(with_ring(hairpin, ring), VERTICAL, 0.0)
