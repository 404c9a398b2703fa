"""Walls drawn by hand: the wall follows the line, and the rest stays."""

import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from sealtwin.core.errors import InputError
from tests.support.photos import evenly_scaled, how_traced, mortar, with_crack, write_png

ENDS = ((60.0, 151.0), (440.0, 151.0))


def crack(folder, width_px=15):
    picture = with_crack(mortar(), [(50, 150), (450, 150)], width_px=width_px)
    photo = evenly_scaled(write_png(folder / "crack.png", picture))
    return photo, find_path(photo, ENDS)


@pytest.mark.parametrize("step", [1, -1])
@pytest.mark.parametrize("aside_px", [6.0, -4.0])
def test_a_wall_is_where_it_was_drawn_whichever_way_and_says_so(tmp_path, step, aside_px):
    photo, path = crack(tmp_path)
    before = trace_outline(photo, path)
    wall = before.left_wall_px
    part = wall[(wall[:, 0] > 200) & (wall[:, 0] < 260)][::8]
    outward = np.sign(part[0, 1] - 150.0)
    line = part + np.array([0.0, aside_px * outward]) * np.sin(np.linspace(0, np.pi, len(part)))[:, None]
    after = trace_outline(photo, path, how_traced(walls_px=[line[::step]]))
    moved = (np.interp(wall[:, 0], *after.left_wall_px.T) - wall[:, 1]) * outward
    drawn = np.interp(wall[:, 0], *line.T, left=np.nan, right=np.nan) - wall[:, 1]
    between = (wall[:, 0] > 206) & (wall[:, 0] < line[-1, 0])
    # A sharp corner is rounded, as walls are smoothed along the crack.
    assert moved[between] == pytest.approx(drawn[between] * outward, abs=1.5)
    assert np.abs(moved[(wall[:, 0] < 190) | (wall[:, 0] > 270)]).max() < 0.35
    s_mm = after.s_mm[np.argmin(np.abs(after.left_wall_px[:, 0] - 230))]
    left, right = {each.side: each for each in after.walls if each.s_from_mm <= s_mm <= each.s_to_mm}.values()
    assert (left.method, right.method) == ("drawn", "edge")
    assert any("drawn by hand" in warning.text for warning in after.warnings)
    assert not any("drawn by hand" in warning.text for warning in before.warnings)


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        ([[(200.0, 142.0), (260.0, 10.0)]], "walls_px, line 1, is not on this crack"),
        ([[(200.0, 142.0), (260.0, 142.0)], [(220.0, 140.0), (240.0, 160.0)]], "walls_px, line 2, crosses the crack"),
    ],
)
def test_a_line_off_the_crack_or_across_it_is_refused(tmp_path, lines, named):
    with pytest.raises(InputError, match=named):
        trace_outline(*crack(tmp_path), how_traced(walls_px=lines))


def test_walls_are_drawn_where_there_are_walls_only(tmp_path):
    photo, path = crack(tmp_path)
    line = [(200.0, 140.0), (260.0, 140.0)]
    for beside in ({"path_only": True}, {"width_mm": np.array([[0.0, 1.0], [40.0, 1.0]])}):
        with pytest.raises(InputError, match="walls_px cannot be combined with"):
            trace_outline(photo, path, how_traced(walls_px=[line], **beside))
    with pytest.raises(InputError, match="too thin"):
        trace_outline(*crack(tmp_path, width_px=4), how_traced(walls_px=[[(200.0, 147.0), (210.0, 147.0)]]))
