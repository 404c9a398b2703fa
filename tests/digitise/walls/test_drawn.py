"""Walls from painted masks, and from lines that are drawn by hand."""

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import signed_area
from digitise.outline import trace_outline
from digitise.settings import MAX_WALL_POINTS, MAX_WALLS
from digitise.walls.doubts import PLAUSIBLE
from sealtwin.core.errors import InputError
from sealtwin.core.facts import of_keys, texts
from tests.support.photos import how_traced, mortar, photo_of_light, with_crack, with_paint


def strokes(folder, *boxes, hole=((0, 0), (0, 0))):
    """A plain photo on which boxes of rows and columns are painted, less a hole."""
    photo = photo_of_light(folder, mortar())
    drawn = np.zeros(photo.brightness.shape, dtype=bool)
    for rows, columns in (*boxes, hole):
        drawn[slice(*rows), slice(*columns)] = (rows, columns) != hole
    return with_paint(photo, drawn)


def test_a_narrow_painted_side_crack_is_included_if_side_cracks_are_kept(tmp_path):
    """A painted stroke of 5 px has an exact width; in a photo, 5 px would be too narrow to measure."""
    photo = strokes(tmp_path, ((140, 164), (30, 470)), ((60, 140), (250, 255)))
    main, whole = (trace_outline(photo, find_path(photo, None), how_traced(branches=it)) for it in ("drop", "keep"))
    assert texts(main.warnings) == (
        '1 side crack (9 mm) is left out. Set photo.branches = "keep" to include side cracks',
    )
    # 80 x 5 px of paint; a pixel of its length for the corners, which the blur of the picture rounds.
    assert signed_area(whole.outline_mm) - signed_area(main.outline_mm) == pytest.approx(4.0, abs=0.1)
    assert whole.warnings == ()


@pytest.mark.parametrize(("side_px", "count"), [(2, 0), (5, 1)])
def test_only_tiny_holes_in_the_paint_are_filled(tmp_path, side_px, count):
    """A solid leaves out an island of 0.04 mm² but not one of 0.25 mm². Walls are on the rim of the paint."""
    photo = strokes(tmp_path, ((135, 165), (30, 470)), hole=((148, 148 + side_px), (250, 250 + side_px)))
    outline = trace_outline(photo, find_path(photo, None))
    assert (len(outline.islands_mm), outline.path_source, outline.ends) == (count, "mask", ("closed", "closed"))
    assert outline.mean_width_mm == pytest.approx(3.0, abs=0.05)
    assert outline.left_wall_px[20:-20, 1] == pytest.approx(134.5, abs=0.5)
    assert outline.right_wall_px[20:-20, 1] == pytest.approx(164.5, abs=0.5)


def test_a_second_painted_piece_does_not_change_the_cracks_outline(tmp_path):
    """The setting edge_fraction is for light in photos and does not change painted walls either."""
    crack, ends = ((140, 160), (30, 470)), ((40.0, 150.0), (460.0, 150.0))
    both, alone = (strokes(tmp_path, *boxes) for boxes in ((crack, ((163, 175), (100, 400))), (crack,)))
    traced = trace_outline(both, find_path(both, ends), how_traced(edge_fraction=0.7))
    exact = trace_outline(alone, find_path(alone, ends))
    assert np.array_equal(traced.outline_mm, exact.outline_mm)


ENDS = ((60.0, 151.0), (440.0, 151.0))


def crack(folder, width_px=15):
    picture = with_crack(mortar(), [(50, 150), (450, 150)], width_px=width_px)
    photo = photo_of_light(folder, picture)
    return photo, find_path(photo, ENDS)


@pytest.mark.parametrize(("aside_px", "step"), [(6.0, 1), (-4.0, -1)])
def test_a_wall_follows_a_line_drawn_in_either_direction(tmp_path, step, aside_px):
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
        ([[(200.0, 142.0), (260.0, 10.0)]], "walls_px, line 1, is not on"),
        ([[(200.0, 142.0), (260.0, 142.0)], [(220.0, 140.0), (240.0, 160.0)]], "walls_px, line 2, crosses"),
        ([[(200.0, 142.0), (260.0, 999.0)]], "walls_px, line 1, leaves the photo"),
    ],
)
def test_a_drawn_wall_line_off_or_across_the_crack_is_refused(tmp_path, lines, named):
    with pytest.raises(InputError, match=named):
        trace_outline(*crack(tmp_path), how_traced(walls_px=lines))


def test_wall_lines_for_a_crack_without_traced_walls_are_refused(tmp_path):
    photo, path = crack(tmp_path)
    line = [(200.0, 140.0), (260.0, 140.0)]
    for beside in ({"path_only": True}, {"width_mm": np.array([[0.0, 1.0], [40.0, 1.0]])}):
        with pytest.raises(InputError, match="walls_px cannot be combined with"):
            trace_outline(photo, path, how_traced(walls_px=[line], **beside))
    with pytest.raises(InputError, match="too thin"):
        trace_outline(*crack(tmp_path, width_px=4), how_traced(walls_px=[[(200.0, 147.0), (210.0, 147.0)]]))


STROKED_ENDS = ((30.0, 150.0), (470.0, 150.0))
CORE_PX, BAND_PX = 14, 12
LOWER_PX = {"ground": 157.0, "crack": 169.0}
"""The lower wall if the band below the core is ground, and if it is crack."""


def banded_photo(folder, share):
    light = with_crack(mortar(), STROKED_ENDS, CORE_PX)
    light[157:169, 150:350] *= share
    photo = photo_of_light(folder, soft(light, 0.8))
    return photo, find_path(photo, STROKED_ENDS)


def soft(light, sigma_px):
    return np.asarray(cv2.GaussianBlur(light, (0, 0), sigma_px), dtype=float)


@pytest.fixture(scope="module")
def banded(tmp_path_factory):
    """A crack of 14 px along y = 150 and, from x = 150 to 350, a band of 12 px below it, which its walls include."""
    return banded_photo(tmp_path_factory.mktemp("banded"), 0.35)


@pytest.fixture(scope="module")
def pale(tmp_path_factory):
    """The same crack with a paler band, which its walls leave out."""
    return banded_photo(tmp_path_factory.mktemp("pale"), 0.45)


def traced(banded, *walls):
    photo, path = banded
    return trace_outline(photo, path, how_traced(walls_px=walls or None))


def lower_px(outline, first, last):
    """Mean height of the lower wall from one column to another."""
    x, y = np.concatenate([outline.left_wall_px, outline.right_wall_px]).T
    return float(y[(x > first) & (x < last) & (y > 150)].mean())


@pytest.mark.parametrize(("photo", "before", "after"), [("pale", "ground", "crack"), ("banded", "crack", "ground")])
def test_a_drawn_wall_moves_the_lower_wall_across_a_band(request, photo, before, after):
    """Walls 100 px away do not move."""
    crack, wall = request.getfixturevalue(photo), ((230.0, LOWER_PX[after]), (270.0, LOWER_PX[after]))
    measured, drawn = traced(crack), traced(crack, wall)
    assert lower_px(measured, 235, 265) == pytest.approx(LOWER_PX[before], abs=1.5)
    assert lower_px(drawn, 235, 265) == pytest.approx(LOWER_PX[after], abs=1.5)
    assert lower_px(drawn, 40, 110) == pytest.approx(lower_px(measured, 40, 110), abs=0.05)
    assert any("lines drawn by hand" in warning.text for warning in drawn.warnings)


def test_a_band_that_may_be_crack_gives_a_warning_until_a_drawn_wall_decides(banded):
    outline = traced(banded)
    low_mm, high_mm = outline.width_95_mm or (9.0, 0.0)
    share = 200 / 440
    assert low_mm < 0.1 * (CORE_PX + 1)  # at the middle of a blurred edge
    assert high_mm > 0.1 * (CORE_PX + 0.9 * share * BAND_PX)
    assert len(outline.bands_mm) == 1
    assert [warning.key for warning in of_keys(outline.warnings, PLAUSIBLE)] == [f"{PLAUSIBLE}.band"]
    decided = traced(banded, ((145.0, 169.0), (355.0, 169.0)))
    assert not decided.bands_mm
    assert decided.width_95_mm is None


def test_a_faint_crack_among_stones_is_measured_with_an_interval_and_drawn_walls_keep_it(tmp_path):
    """The crack is 20 px wide, and the stones are as large."""
    rng = np.random.default_rng(4)
    stones = cv2.GaussianBlur(rng.standard_normal((300, 500)), (0, 0), 5)
    light = 0.35 * np.exp(0.25 * stones / stones.std())
    light[140:160] = 0.21 * np.exp(0.25 * stones[140:160] / stones.std())
    photo = photo_of_light(tmp_path, soft(light, 1.0))
    path = CrackPath(np.array([(20.0, 150.0), (480.0, 150.0)]), 20.0, "ends")
    low_mm, high_mm = trace_outline(photo, path).width_95_mm or (9.0, 0.0)
    assert low_mm < 2.0 < high_mm < 2.5
    walls = [[(22.0, y), (478.0, y)] for y in (140.0, 160.0)]
    assert trace_outline(photo, path, how_traced(walls_px=walls)).mean_width_mm == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize(
    ("walls", "named"),
    [
        ({"walls_px": [[(1.0, 1.0), (2.0, 2.0)]] * (MAX_WALLS + 1)}, "walls_px"),
        ({"walls_px": [[(1.0, 1.0)] * (MAX_WALL_POINTS + 1)]}, "walls_px"),
        ({"walls_px": [[]]}, "walls_px"),
        ({"walls_px": [[(1.0, 1.0), (2.0, 2.0)]], "mask": "mask.png"}, "mask cannot be combined with"),
    ],
)
def test_too_many_or_invalid_walls_are_refused(walls, named):
    with pytest.raises(InputError, match=named):
        how_traced(**walls)


@pytest.mark.parametrize(("wall", "height_px"), [(1, LOWER_PX["ground"]), (2, LOWER_PX["crack"])])
@pytest.mark.parametrize("photo", ["pale", "banded"])
def test_a_wall_chosen_by_its_number_leaves_the_band_out_or_includes_it(request, photo, wall, height_px):
    chosen = trace_outline(*request.getfixturevalue(photo), how_traced(wall=wall))
    assert lower_px(chosen, 200, 300) == pytest.approx(height_px, abs=2.0)
    assert lower_px(chosen, 40, 110) == pytest.approx(LOWER_PX["ground"], abs=1.0)
    assert not chosen.bands_mm
    assert chosen.width_95_mm is None
    assert [text for text in texts(chosen.warnings) if "chosen by number" in text]


def test_the_number_of_a_wall_changes_nothing_without_a_band(tmp_path):
    photo, path = crack(tmp_path)
    outlines = [trace_outline(photo, path, how_traced(wall=wall)) for wall in (None, 2)]
    assert np.array_equal(*(outline.outline_mm for outline in outlines))
    assert texts(outlines[0].warnings) == texts(outlines[1].warnings)
