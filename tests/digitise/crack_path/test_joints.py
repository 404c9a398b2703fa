"""Straight lines among cracks."""

import cv2
import numpy as np
import pytest

from digitise.crack_path.crack_map import beside_straight, straight_lines
from tests.pictures import distance_to

SIZE = (300, 400)


def bones(points):
    cells = np.zeros(SIZE, dtype=np.uint8)
    cv2.polylines(cells, [np.rint(points).astype(np.int32)], False, 1)
    return cells > 0


def wandering(rms):
    """Over 380 cells, with two and a half waves."""
    x = np.linspace(10, 390, 100)
    return np.column_stack([x, 150 + rms * np.sqrt(2) * np.sin(x / 25)])


@pytest.mark.parametrize("ends", [((10, 20), (390, 80)), ((200, 5), (200, 295)), ((20, 290), (350, 10))])
def test_a_straight_line_is_found_where_it_is(ends):
    found = straight_lines(bones(np.array(ends)))
    assert found
    for line in found:
        assert distance_to(line, np.array(ends, dtype=float)).max() < 3
        assert np.linalg.norm(line[1] - line[0]) >= 0.4 * 500


def test_a_chipped_joint_is_straight_and_a_crack_is_not():
    """A crack strays by 1 % of its length; 0.2 % is a cell, and a chip hides a twentieth."""
    assert straight_lines(bones(wandering(0.5)))
    chipped = bones(wandering(0.5))
    chipped[:, 180:195] = False
    assert straight_lines(chipped)
    assert straight_lines(bones(wandering(4))) == []


def test_a_row_of_dashes_is_no_joint():
    """Half of it is missing; of a joint a fifth at most."""
    dashed = bones(np.array([(10.0, 100.0), (390.0, 100.0)]))
    for start in range(10, 390, 16):
        dashed[:, start : start + 8] = False
    assert straight_lines(dashed) == []


def test_a_short_straight_line_may_be_a_crack():
    assert straight_lines(bones(np.array([(100, 100), (250, 130)]))) == []


def test_what_lies_beside_a_straight_line_belongs_to_it():
    """And so does what lies beside its continuation, of which less may be seen."""
    beside = beside_straight(SIZE, [np.array([(150.0, 100.0), (390.0, 100.0)])])
    assert beside[[95, 107], 200].all()
    assert beside[[95, 107], 5].all()
    assert not beside[[80, 120], 200].any()
