"""Walls drawn by hand: what a line replaces, and which lines are refused."""

from pathlib import Path

import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import Photo, given_scale
from digitise.walls.drawn import Drawn, with_drawn
from sealtwin.core.errors import InputError
from tests.pictures import evenly_scaled, how_traced, mortar, with_crack, write_png

S_MM = np.linspace(0.0, 40.0, 161)
LINE = np.column_stack([S_MM + 4.0, np.full(len(S_MM), 15.0)])
OUT = np.array([0.0, 1.5])
PIXELS = {"image": np.zeros((300, 500, 3), np.uint8), "brightness": np.zeros((300, 500), np.float32)}
PHOTO = Photo(file=Path("photo.png"), **PIXELS, **vars(given_scale(0.1, False, (500, 300))))
LEFT, RIGHT = LINE + OUT, LINE - OUT
HUMP = np.array([[10.0, 1.6], [12.0, 2.5], [18.0, 2.5], [20.0, 1.4]])  # From the beginning of the line


def drawn(*lines, kinds=("open", "open"), left=LEFT):
    """Centreline and walls, the drawn share of each wall at each station, and warnings."""
    in_px = tuple(("wall", PHOTO.to_px(np.asarray(line) + LINE[0])) for line in lines)
    return with_drawn(PHOTO, (LINE, left, RIGHT), Drawn(in_px), kinds)


def area_mm2(stations):
    left, right = (np.trapezoid(wall[:, 1], wall[:, 0]) for wall in stations[1:])
    return float(left - right)


@pytest.mark.parametrize("backward", [False, True])
def test_a_line_replaces_the_wall_beside_it_whichever_way_it_was_drawn(backward):
    """The area grows by what lies between the line and the old wall; the other wall and the rest stay."""
    stations, share, _ = drawn(HUMP[::-1] if backward else HUMP)
    centreline_mm, left_mm, right_mm = stations
    grown = np.trapezoid(HUMP[:, 1] - 1.5, HUMP[:, 0])
    assert area_mm2(stations) == pytest.approx(3.0 * 40 + grown, abs=0.1)
    assert np.allclose(right_mm, RIGHT)
    beside = (S_MM < 9.8) | (S_MM > 20.2)
    assert np.allclose(left_mm[beside], LEFT[beside])
    assert np.abs(centreline_mm - (left_mm + right_mm) / 2).max() < 0.1
    assert share.mean() == pytest.approx(10 / 40 / 2, abs=0.01)


def test_a_later_line_replaces_an_earlier_one_and_nothing_drawn_changes_nothing():
    again = np.column_stack([HUMP[:, 0], np.full(len(HUMP), 1.5)])
    assert area_mm2(drawn(HUMP, again)[0]) == pytest.approx(120.0, abs=0.1)
    (_, left_mm, _), share, _ = drawn()
    assert np.array_equal(left_mm, LEFT)
    assert not share.any()


def test_tips_stay_where_they_are():
    left = LEFT.copy()
    left[0] = RIGHT[0] = LINE[0]
    try:
        whole = np.array([[-0.2, 0.3], [5.0, 2.0], [10.0, 1.5]])
        (_, left_mm, _), *_ = drawn(whole, kinds=("closed", "open"), left=left)
        assert np.allclose(left_mm[0], LINE[0])
        assert left_mm[20, 1] - LINE[20, 1] > 1.8
    finally:
        RIGHT[0] = LINE[0] - OUT


@pytest.mark.parametrize(
    "line", [[[10.0, 6.0], [20.0, 1.5]], [[10.0, 1.5], [14.0, 9.0], [10.05, 1.6]], [[10.0, 9.0], [20.0, 9.0]]]
)
def test_a_line_from_nowhere_or_without_length_along_the_wall_is_refused(line):
    with pytest.raises(InputError, match=r"photo\.png: photo\.walls_px, line 2"):
        drawn(HUMP, np.array(line))


def test_a_photo_with_a_drawn_wall_has_it_and_says_so(tmp_path):
    photo = evenly_scaled(write_png(tmp_path / "crack.png", with_crack(mortar(), [(50, 150), (450, 150)])))
    path = find_path(photo, ((60.0, 151.0), (440.0, 151.0)))
    before = trace_outline(photo, path)
    wall = before.left_wall_px
    part = wall[(wall[:, 0] > 200) & (wall[:, 0] < 260)]
    aside = np.sign(part[0, 1] - 150.0)
    line = part[::8] + np.array([0.0, 6.0 * aside]) * np.sin(np.linspace(0, np.pi, len(part[::8])))[:, None]
    after = trace_outline(photo, path, how_traced(walls_px=[line]))
    assert after.left_wall_mm.shape == before.left_wall_mm.shape
    moved = np.abs(after.left_wall_px - before.left_wall_px).max(axis=1)
    assert moved.max() == pytest.approx(6.0 * np.sin(np.pi / 3), abs=0.3)
    assert moved[(wall[:, 0] < 190) | (wall[:, 0] > 270)].max() == 0
    assert any("drawn by hand" in warning for warning in after.warnings)
    assert not any("drawn by hand" in warning for warning in before.warnings)


def test_walls_are_drawn_where_there_are_walls_only(tmp_path):
    photo = evenly_scaled(write_png(tmp_path / "crack.png", with_crack(mortar(), [(50, 150), (450, 150)])))
    path = find_path(photo, ((60.0, 151.0), (440.0, 151.0)))
    line = [(200.0, 140.0), (260.0, 140.0)]
    for beside in ({"path_only": True}, {"width_mm": np.array([[0.0, 1.0], [40.0, 1.0]])}):
        with pytest.raises(InputError, match="walls_px cannot be combined with"):
            trace_outline(photo, path, how_traced(walls_px=[line], **beside))
    thin = evenly_scaled(write_png(tmp_path / "thin.png", with_crack(mortar(), [(50, 150), (450, 150)], width_px=4)))
    with pytest.raises(InputError, match="too thin"):
        trace_outline(thin, find_path(thin, ((60.0, 151.0), (440.0, 151.0))), how_traced(walls_px=[line]))
