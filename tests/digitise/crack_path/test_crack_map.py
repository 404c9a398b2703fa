"""The map of all cracks: thin and wide ones in grain, their growth, straight lines among them, plain ground."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from digitise.crack_path.crack_map import cracks_on, grown, straight_lines
from digitise.crack_path.darkness import map_darkness
from digitise.crack_path.find_path import find_path
from sealtwin.core.errors import InputError
from tests.pictures import evenly_scaled, mortar, with_crack, write_png

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


def near(cells, truth, tolerance_px):
    return float(np.mean(np.asarray(distance_transform_edt(~truth))[cells] <= tolerance_px))


def test_a_thin_crack_and_its_side_crack_are_found_in_grain(tmp_path):
    """3 px wide, 6 times the grain's own contrast; within 3 px, of which the drawn truth is one to either side."""
    picture = with_crack(with_crack(mortar(), CRACK, width_px=3), SIDE, width_px=3)
    mask, truth = cracks_in(photo_from(picture, tmp_path)).mask, drawn(CRACK, SIDE)
    assert near(mask, truth, 3) > 0.9
    assert near(truth, mask, 3) > 0.9


def test_plain_grain_has_no_cracks_to_speak_of(tmp_path):
    photo = photo_from(mortar(seed=0), tmp_path)
    crack_map = cracks_in(photo)
    assert all(np.ptp(crack.line_px, axis=0).max() < 40 for crack in crack_map.cracks)
    assert crack_map.mask.mean() < 0.002
    with pytest.raises(InputError, match="no crack found"):
        find_path(photo, None)


ALLOWED = np.ones((120, 300), dtype=bool)


def middle_line():
    cells = np.zeros((120, 300), dtype=bool)
    cells[60, 20:280] = True
    return cells


def shown_dark(width, level=0.8):
    picture = np.full((120, 300), level / 2, dtype=np.float32)  # ground is dark as well, if less
    low = 60 - width // 2
    picture[low : low + width, 20:280] = level
    return picture


@pytest.mark.parametrize("width", [1, 5, 21, 35])
@pytest.mark.parametrize("level", [0.2, 0.9])
def test_a_crack_grows_to_its_walls_however_dark_it_is(width, level):
    """A line is three cells wide at least."""
    cells = grown(middle_line(), shown_dark(width, level), ALLOWED)
    assert cells[:, 150].sum() == max(width, 3)


def test_a_stain_that_the_crack_runs_through_is_no_crack():
    """40 cells across, where the crack has 7: it may swell to three times that."""
    picture = shown_dark(7)
    picture[40:100, 130:170] = 0.8
    cells = grown(middle_line(), picture, ALLOWED)
    assert cells[:, 150].sum() < 26
    assert cells[:, 100].sum() == 7


BONES = (300, 400)


def bones(points):
    cells = np.zeros(BONES, dtype=np.uint8)
    cv2.polylines(cells, [np.rint(points).astype(np.int32)], False, 1)
    return cells > 0


def wandering(rms):
    """Over 380 cells, with two and a half waves."""
    x = np.linspace(10, 390, 100)
    return np.column_stack([x, 150 + rms * np.sqrt(2) * np.sin(x / 25)])


def test_a_joint_is_straight_long_and_nearly_whole():
    """A crack strays by 1 % of its length, a joint by 0.2 %; a chip hides a twentieth of it, dashes half."""
    joint, dashed = bones(wandering(0.5)), bones(np.array([(10.0, 100.0), (390.0, 100.0)]))
    assert straight_lines(joint)
    joint[:, 180:195] = False
    assert straight_lines(joint)
    dashed[:, (np.arange(400) - 10) // 8 % 2 == 0] = False
    for cells in (dashed, bones(wandering(4)), bones(np.array([(100, 100), (250, 130)]))):
        assert straight_lines(cells) == []
