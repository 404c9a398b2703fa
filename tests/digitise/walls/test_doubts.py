"""Warnings about a mean width: hairlines, narrow stretches, joints, and clicked ends beyond the crack."""

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.crack_path.hints import CrackPath
from digitise.outline import trace_outline
from digitise.walls.centreline_and_walls import TooThinError, trace
from digitise.walls.doubts import judge_reach, judge_stretches
from sealtwin.core.errors import InputError
from sealtwin.core.facts import of_keys
from tests.support.photos import evenly_scaled, mortar, photo_of_light, with_crack, with_paint, write_png

MAIN = [(300, 205), (480, 190), (640, 215), (960, 205)]
ENDS = ((40.0, 200.0), (960.0, 205.0))


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    return evenly_scaled(write_png(tmp_path_factory.mktemp("stretches") / "photo.png", mortar((600, 100))))


def straight(*parts):
    """Centreline and width in mm, at 0.1 mm/px, of a crack of parts: a length and a width in px each."""
    width_px = np.concatenate([np.full(round(length / 2.5), width) for length, width in parts])
    x_mm = 0.25 * np.arange(len(width_px))
    return np.column_stack([x_mm, np.full(len(x_mm), 5.0)]), 0.1 * width_px


def test_a_narrow_stretch_gives_a_warning_with_its_position(photo):
    """Narrow tips of 30 px each give no warning."""
    (warning,) = judge_stretches(photo, *straight((30, 5.0), (170, 12.0), (80, 6.0), (190, 12.0), (30, 5.0)))
    assert "20 to 28 mm along the crack, from (200, 49) to (278, 49) px, about 6.0 px wide" in warning.text


def test_a_wide_crack_that_continues_as_a_hairline_is_refused(tmp_path):
    """On a lab's photo half of the crack was 11 px wide and half 3 px; the mean, 7 px, was used."""
    picture = with_crack(mortar((1000, 400)), [(40, 200), (300, 210), (500, 195)], 11)
    picture = np.minimum(picture, with_crack(mortar((1000, 400)), [(500, 195), (700, 210), (960, 205)], 3))
    photo = photo_of_light(tmp_path, picture)
    with pytest.raises(InputError, match="under 6 px wide, so its width and volume are uncertain"):
        trace_outline(photo, find_path(photo, ENDS))


def test_a_crack_with_a_long_narrow_stretch_is_too_thin_for_walls(photo):
    with pytest.raises(TooThinError):
        judge_stretches(photo, *straight((150, 5.0), (350, 9.0)))


def test_a_shade_along_the_whole_of_one_side_widens_the_interval(tmp_path):
    """The crack is 20 px wide, the shade beside it 9 px. Before, the crack was 27 px wide without a word."""
    line = [(x, round(200 + 12 * np.sin(x / 90))) for x in range(40, 961, 10)]
    light = with_crack(mortar((1000, 400)), [(x, y + 10) for x, y in line], 18) ** 0.45 * mortar((1000, 400)) ** 0.55
    photo = photo_of_light(tmp_path, np.minimum(light, with_crack(mortar((1000, 400)), line, 20)))
    outline = trace_outline(photo, find_path(photo, (line[0], line[-1])))
    assert of_keys(outline.warnings, "walls.plausible.band")
    assert outline.width_95_mm is not None
    assert outline.width_95_mm[0] < 20 * photo.mm_per_px * 1.05


def test_missing_walls_are_refused_with_a_stretch_of_them(tmp_path):
    """The crack is interrupted from x = 450 to 700 px."""
    picture = with_crack(mortar((1000, 400)), MAIN, 14)
    picture[:, 450:700] = mortar((1000, 400))[:, 450:700]
    photo, path_px = photo_of_light(tmp_path, picture), np.array(MAIN, float)
    with pytest.raises(
        InputError, match=r"walls were not found along \d+% .*from \(4[45]\d, \d+\) to \((69|70)\d, \d+\)"
    ):
        trace(photo, CrackPath(path_px, 14.0, "ends"), 0.5, np.zeros((400, 1000), np.uint8))


def test_a_clicked_end_beyond_the_crack_gives_a_warning_with_its_position(tmp_path):
    """The click is on a pore, from which a faint line leads to the crack; there was no warning before."""
    picture = mortar((1000, 400))
    start = (210, 205)
    faint = with_crack(picture, [(40, 200), start], 1)
    picture = np.minimum(with_crack(picture, [start, *MAIN], 12), (2 * picture + faint) / 3)
    cv2.circle(picture, (41, 200), 6, 0.02, -1)
    photo = photo_of_light(tmp_path, picture)
    outline = trace_outline(photo, find_path(photo, ENDS))
    assert outline.centreline_px[0] == pytest.approx(start, abs=8)
    text = outline.warnings[0].text
    assert text.startswith("the end (40, 200) px is not reached")
    assert f"{outline.centreline_px[0, 0]:.0f}" in text


def test_a_clicked_end_far_beyond_a_closed_crack_is_refused(photo):
    path_px = np.column_stack([np.arange(10.0, 590), np.full(580, 50.0)])
    assert judge_reach(photo, path_px, path_px[8:], ("closed", "closed")) == []
    # An end that is cut does not close before the click.
    assert judge_reach(photo, path_px, path_px[150:], ("cut", "closed")) == []
    with pytest.raises(InputError, match=r"the end \(10, 50\) px is not reached.* \(150 px\) before it, at"):
        judge_reach(photo, path_px, path_px[150:], ("closed", "closed"))


def in_a_joint(folder, darkness=1.0):
    """The outline of a crack of 5 px in a grey joint of 38 px; a darkness of 0 is that of the joint."""
    ends = [(-20, 150), (520, 150)]
    picture = np.minimum(mortar(), np.where(with_crack(mortar(), ends, 38) < 0.1, 0.3 * mortar(), 1.0))
    picture = darkness * with_crack(picture, ends, 5) + (1 - darkness) * picture
    photo = photo_of_light(folder, picture)
    return trace_outline(photo, CrackPath(np.array([(40.0, 150.0), (460.0, 150.0)]), 38.0, "ends"))


def test_the_width_interval_is_wide_if_a_crack_in_a_joint_cannot_be_fitted(tmp_path, monkeypatch):
    """A wet strip of 20 px around a crack of 6 px was measured without a warning. Here no fit is thin enough."""
    monkeypatch.setattr("digitise.outline.FITTED_INSIDE", 0.0)
    outline = in_a_joint(tmp_path)
    low_mm, high_mm = outline.width_95_mm or (9.0, 0.0)
    assert outline.width_source == "walls"
    assert low_mm < 0.8
    assert high_mm == outline.mean_width_mm > 3.5
    assert any("between the walls" in warning.text for warning in outline.warnings)
    assert {wall.doubt_mm for wall in outline.walls} == {(low_mm / 2, high_mm / 2)}


@pytest.mark.parametrize(("darkness", "width_mm"), [(1.0, 0.7), (0.5, 0.4)])
def test_a_dark_crack_in_a_grey_joint_is_measured_with_a_warning(tmp_path, darkness, width_mm):
    """The walls of the joint, 38 px apart, were taken for those of the crack of 5 px in it."""
    outline = in_a_joint(tmp_path, darkness)
    low_mm, high_mm = outline.width_95_mm or (9.0, 0.0)
    assert outline.mean_width_mm == pytest.approx(width_mm, abs=0.1)
    assert low_mm < 0.8
    assert high_mm > 3.5
    assert any("a joint. The interval covers both" in warning.text for warning in outline.warnings)


def test_a_painted_light_crack_has_the_width_of_its_paint(tmp_path):
    """Before, the dark shade of 4 px beside the crack was measured."""
    picture = mortar()
    picture[148:153] *= 1.6
    picture[153:157] *= 0.3
    drawn = np.zeros(picture.shape, dtype=bool)
    drawn[148:153, 40:460] = True
    photo = with_paint(photo_of_light(tmp_path, picture), drawn)
    outline = trace_outline(photo, CrackPath(np.array([(42.0, 150.0), (458.0, 150.0)]), 5.0, "mask"))
    assert outline.mean_width_mm == pytest.approx(0.5, abs=0.1)
    assert any("width of the paint is used" in warning.text for warning in outline.warnings)
    assert {stretch.method for stretch in outline.walls} <= {"drawn", "bridged"}
