import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from digitise.crack_path.medial_axis import distance_outside


def painted(*strokes, width_px=9, size_px=(300, 200)):
    picture = np.zeros(size_px[::-1], dtype=np.uint8)
    for points in strokes:
        cv2.polylines(picture, [np.array(points, dtype=np.int32)], False, 1, width_px)
    return picture > 0


@pytest.mark.parametrize("size_px", [(150, 100), (300, 200)])
def test_distances_to_a_mask_are_bit_exact_in_small_and_large_maps(size_px):
    """OpenCV's own distances are inexact in maps of fewer than 2**14 cells and differ between processes."""
    mask = painted([(10, 50), (75, 40), (140, 60)], size_px=size_px)
    exact = np.asarray(distance_transform_edt(~mask), dtype=np.float32)
    assert np.array_equal(distance_outside(mask), exact)
