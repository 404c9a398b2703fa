"""The map of all cracks: thin and wide ones in grain, and nothing where there is none."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from digitise.crack_path.crack_map import cracks_on
from digitise.crack_path.darkness import map_darkness
from digitise.crack_path.find_path import find_path
from sealtwin.core.errors import InputError
from tests.pictures import distance_to, evenly_scaled, mortar, with_crack, write_png

CRACK = [(10.0, 200.0), (90, 170), (160, 190), (250, 140), (330, 150), (420, 90), (490, 110)]
SIDE = [(250.0, 140.0), (290, 200), (285, 280)]


def photo_from(brightness, folder):
    return evenly_scaled(write_png(folder / "photo.png", brightness))


def cracks_in(photo):
    """On photos this small a cell of the search map is a pixel."""
    return cracks_on(map_darkness(photo))


def drawn(*lines, size_px=(500, 300), width_px=3):
    mask = np.zeros(size_px[::-1], dtype=np.uint8)
    for line in lines:
        cv2.polylines(mask, [np.array(line, dtype=np.int32)], False, 1, width_px)
    return mask > 0


def near(found, truth, tolerance_px):
    return float(np.mean(np.asarray(distance_transform_edt(~truth))[found] <= tolerance_px))


@pytest.mark.parametrize("seed", range(2))
def test_a_thin_crack_and_its_side_crack_are_found_in_grain(tmp_path, seed):
    """3 px wide, 6 times the grain's own contrast; within 3 px, of which the drawn truth is one to either side."""
    picture = with_crack(with_crack(mortar(seed=seed), CRACK, width_px=3), SIDE, width_px=3)
    found, truth = cracks_in(photo_from(picture, tmp_path)).mask, drawn(CRACK, SIDE)
    assert near(found, truth, 3) > 0.9
    assert near(truth, found, 3) > 0.9


@pytest.mark.parametrize("seed", range(4))
def test_plain_grain_has_no_cracks_to_speak_of(tmp_path, seed):
    """One row of grains in four pictures looks like a crack for 34 px, which is far from what may be meant by one."""
    photo = photo_from(mortar(seed=seed), tmp_path)
    found = cracks_in(photo)
    assert all(np.ptp(crack.line_px, axis=0).max() < 40 for crack in found.cracks)
    assert found.mask.mean() < 0.002
    with pytest.raises(InputError, match="no crack found"):
        find_path(photo, None)


def test_a_joint_is_told_from_a_crack(tmp_path):
    picture = with_crack(with_crack(mortar(), CRACK, width_px=4), [(300, 0), (310, 299)], width_px=6)
    photo = photo_from(picture, tmp_path)
    found = cracks_in(photo)
    assert near(found.mask, drawn(CRACK), 4) > 0.85  # the two cross
    for line_px in found.straight_px:
        assert distance_to(line_px, np.array([(300.0, 0.0), (310.0, 299.0)])).max() < 6
    assert found.straight_px
    both = cracks_on(map_darkness(photo), joints_px=())
    assert near(drawn([(300, 20), (310, 280)]), both.mask, 4) > 0.9


def test_a_crack_goes_on_over_a_gap(tmp_path):
    """Ten pixels of mortar, as a coarse grain leaves; over a longer way it would be two."""
    parts = [(10, 150), (100, 160), (235, 140)], [(245, 139), (380, 150), (490, 135)]
    picture = with_crack(with_crack(mortar(), parts[0], width_px=3), parts[1], width_px=3)
    (crack,) = cracks_in(photo_from(picture, tmp_path)).cracks
    assert np.ptp(crack.line_px[:, 0]) > 450


def test_a_wide_crack_is_one_with_its_line_in_the_middle(tmp_path):
    """As wide as the filters see at most; each of its walls looks like a line of its own."""
    line = [(20.0, 150.0), (160, 130), (300, 170), (480, 140)]
    (crack,) = cracks_in(photo_from(with_crack(mortar(), line, width_px=36), tmp_path)).cracks
    assert crack.width_px == pytest.approx(36, rel=0.2)
    inner = crack.line_px[(crack.line_px[:, 0] > 60) & (crack.line_px[:, 0] < 440)]
    assert distance_to(inner, np.array(line)).max() < 6


def test_cracks_come_best_first(tmp_path):
    """A faint one above a clear one: the order is not that in which they lie in the picture."""
    clear = [(x, y + 90) for x, y in CRACK]
    faint = [(x, y - 60) for x, y in CRACK]
    picture = with_crack((with_crack(mortar(), faint, width_px=3) + mortar()) / 2, clear, width_px=5)
    found = cracks_in(photo_from(picture, tmp_path))
    first, second = found.cracks[:2]
    assert first.score > 1.5 * second.score
    assert distance_to(first.line_px, np.array(clear)).max() < 6
    assert distance_to(second.line_px, np.array(faint)).max() < 6


def test_on_a_photo_larger_than_the_search_map_lines_are_in_its_own_pixels(tmp_path):
    """Three times as large: a cell's error is three pixels."""
    large = [(3 * x, 3 * y) for x, y in CRACK]
    picture = with_crack(mortar(size_px=(1500, 900)), large, width_px=14)
    (crack,) = cracks_in(photo_from(picture, tmp_path)).cracks
    assert np.ptp(crack.line_px[:, 0]) > 1400
    assert distance_to(crack.line_px, np.array(large)).max() < 8
