"""Regions of interest by two corners or a polygon, and their refusals."""

import numpy as np
import pytest

from digitise.crack_path.hints import region_px
from sealtwin.core.errors import InputError
from tests.support.photos import mortar, photo_of_light


def photo_of_width(folder, width_px=500):
    return photo_of_light(folder, mortar((width_px, 300)))


@pytest.mark.parametrize("corners", [((10.0, 20.0), (400.0, 200.0)), ((400.0, 20.0), (10.0, 200.0))])
def test_two_opposite_corners_define_a_rectangular_region_of_interest(tmp_path, corners):
    box_px = np.array([[10.0, 20.0], [400.0, 20.0], [400.0, 200.0], [10.0, 200.0]])
    assert region_px(photo_of_width(tmp_path), corners) == pytest.approx(box_px)


@pytest.mark.parametrize(
    ("corners", "says"),
    [
        # A ring that crosses itself is ambiguous: a bow tie, a corner beyond the first side, a closing side.
        (((0.0, 0.0), (499.0, 299.0), (499.0, 0.0), (0.0, 299.0)), r"\(0, 0\) to \(499, 299\)"),
        (((0, 0), (400, 0), (400, 290), (200, -50), (0, 290)), r"\(0, 0\) to \(400, 0\)"),
        (((0.0, 0.0), (200.0, 200.0), (300.0, 0.0), (400.0, 150.0)), r"\(400, 150\) to \(0, 0\)"),
        (((600.0, 600.0), (900.0, 900.0)), "covers"),
    ],
)
def test_a_region_that_crosses_itself_or_is_outside_the_photo_is_refused(tmp_path, corners, says):
    with pytest.raises(InputError, match=r"photo\.png: roi_px .*" + says):
        region_px(photo_of_width(tmp_path), corners)
