import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from digitise.crack_path.medial_axis import distance_outside, longest_line, side_lines
from tests.support.photos import distance_to


def painted(*strokes, width_px=9, size_px=(300, 200)):
    picture = np.zeros(size_px[::-1], dtype=np.uint8)
    for points in strokes:
        cv2.polylines(picture, [np.array(points, dtype=np.int32)], False, 1, width_px)
    return picture > 0


MAIN = [(20, 100), (150, 90), (280, 110)]
BRANCH = [(150, 90), (170, 30)]


@pytest.mark.parametrize("size_px", [(150, 100), (300, 200)])
def test_distances_are_exact_to_the_last_bit_in_small_maps_as_in_large_ones(size_px):
    """OpenCV's own are not in maps of fewer than 2**14 cells, and differ from process to process there."""
    mask = painted([(10, 50), (75, 40), (140, 60)], size_px=size_px)
    exact = np.asarray(distance_transform_edt(~mask), dtype=np.float32)
    assert np.array_equal(distance_outside(mask), exact)


def test_the_longest_line_of_a_fork_leaves_its_shortest_arm_out():
    line = longest_line(painted(MAIN, BRANCH))[:, ::-1].astype(float)
    assert distance_to(line, np.array(MAIN, dtype=float)).max() < 4
    # A skeleton ends about half a width before a blunt end.
    assert np.ptp(line[:, 0]) == pytest.approx(260, abs=10)


def test_side_lines_run_outward_and_roughness_is_none():
    region = painted(MAIN, BRANCH, [(220, 101), (223, 80)])
    ((cells, comes_back),) = side_lines(region, longest_line(region), least=18)
    outward = cells[:, ::-1].astype(float)
    # It begins at the wall, half of the stroke's width off the way, and ends short of the tip by as much.
    assert distance_to(outward[:1], np.array(MAIN, dtype=float)) == pytest.approx(4.5, abs=3)
    assert np.linalg.norm(outward[-1] - BRANCH[1]) < 9
    assert not comes_back
    assert len(side_lines(region, longest_line(region), least=6)) == 2
