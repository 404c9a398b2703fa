"""The path of a crack: in paint, and in photos that have several cracks, of which a few are offered."""

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import CrackSearch, RivalCracksError, find_path
from sealtwin.core.errors import InputError
from tests.support.photos import distance_to, evenly_scaled, mortar, with_crack, with_paint, write_png

SIZE_PX = (500, 300)
CRACK = [(40.0, 150.0), (250.0, 120.0), (460.0, 170.0)]


def strokes(*lines, width_px=14):
    mask = np.zeros(SIZE_PX[::-1], dtype=np.uint8)
    for line in lines:
        cv2.polylines(mask, [np.array(line, dtype=np.int32)], False, 1, width_px)
    return mask > 0


@pytest.fixture
def plain(tmp_path):
    """A photo in which nothing could be found."""
    return evenly_scaled(write_png(tmp_path / "photo.png", mortar(SIZE_PX)))


def test_the_path_is_the_middle_of_the_paint(plain):
    """Within two cells of the skeleton of a stroke that is drawn on whole pixels."""
    path = find_path(with_paint(plain, strokes(CRACK)), None)
    assert path.source == "mask"
    assert path.points_px[0, 0] < path.points_px[-1, 0]
    assert distance_to(path.points_px, np.array(CRACK)).max() < 2.5
    assert np.linalg.norm(path.points_px[[0, -1]] - np.array(CRACK)[[0, -1]], axis=1).max() < 14  # a width
    assert path.width_px == pytest.approx(14, abs=2)
    assert path.warnings == ()


def test_side_cracks_of_the_paint_and_places_that_the_brush_missed_turn_no_path(plain):
    missed = strokes(CRACK, width_px=20)
    missed[118:124, 248:254] = False
    for drawn in (missed, strokes(CRACK) | strokes([(250, 120), (300, 30)], width_px=6)):
        path = find_path(with_paint(plain, drawn), None)
        assert distance_to(path.points_px, np.array(CRACK)).max() < 4


def test_of_several_pieces_the_largest_is_taken_or_that_of_the_ends_and_it_is_said(plain):
    scratch = [(50.0, 270.0), (200.0, 270.0)]
    photo = with_paint(plain, strokes(CRACK) | strokes(scratch, width_px=5))
    largest = find_path(photo, None)
    assert distance_to(largest.points_px, np.array(CRACK)).max() < 4
    assert "the mask has 2 pieces; " in largest.warnings[0].text
    other = find_path(photo, ((55.0, 270.0), (190.0, 271.0)))
    assert distance_to(other.points_px, np.array(scratch)).max() < 3
    assert other.warnings


@pytest.mark.parametrize(
    ("ends_px", "says"),
    [
        (((60.0, 200.0), (450.0, 168.0)), r"end \(60, 200\) is not on the crack that the mask paints"),
        (((45.0, 150.0), (180.0, 270.0)), "different pieces of the mask"),
    ],
)
def test_ends_off_the_paint_are_refused(plain, ends_px, says):
    drawn = strokes(CRACK) | strokes([(50, 270), (200, 270)], width_px=5)
    with pytest.raises(InputError, match=says):
        find_path(with_paint(plain, drawn), ends_px)


def photo_of_lines(folder, lines, size_px=(1000, 700)):
    """Each line is its places and its width."""
    picture = mortar(size_px)
    for points, width_px in lines:
        picture = with_crack(picture, points, width_px)
    return evenly_scaled(write_png(folder / "photo.png", picture))


def wave(y, bend=20):
    return [(x, round(y + bend * np.sin(x / 90 + y))) for x in range(40, 961, 20)]


@pytest.mark.slow
def test_a_wide_crack_is_one_and_not_its_two_walls(tmp_path):
    """On the fine map it is two lines 70 px apart, and one of them was taken."""
    photo = photo_of_lines(tmp_path, [(wave(350), 70)])
    (only,) = CrackSearch.of(photo).cracks
    assert only.width_px == pytest.approx(70, rel=0.2)
    inner = only.line_px[(only.line_px[:, 0] > 100) & (only.line_px[:, 0] < 900)]
    assert distance_to(inner, np.array(wave(350), dtype=float)).max() < 15
    assert find_path(photo, None).width_px == pytest.approx(70, rel=0.1)


def test_a_number_takes_the_crack_of_that_rank(tmp_path):
    upper = [(30, 60), (110, 80), (180, 62), (250, 75), (330, 50), (400, 66), (470, 55)]
    lower = [(30, 240), (100, 222), (180, 241), (250, 225), (320, 250), (400, 231), (470, 245)]
    photo = photo_of_lines(tmp_path, [(upper, 14), (lower, 14)], size_px=(500, 300))
    search = CrackSearch.of(photo)
    with pytest.raises(RivalCracksError, match="2 cracks compete"):
        search.path()
    assert search.cracks[0].score >= search.cracks[1].score
    for number, crack in enumerate(search.cracks, 1):
        path = search.path(number)
        assert path.source == "choice"
        assert distance_to(path.points_px, crack.line_px).max() < 9
    with pytest.raises(InputError, match=r"photo\.crack = 3, but only 2 .*: 1\. .*; 2\. "):
        search.path(3)
