"""The path of a crack: between clicks, in a painted mask, and in photos with several cracks."""

from contextlib import nullcontext

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import CrackSearch, LiveWire, RivalCracksError, find_path
from digitise.crack_path.line_verdict import TAKEN
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from fixtures.generate.specimen import Recipe, make_specimen
from sealtwin.core.errors import InputError
from tests.support.paths import FIXTURE
from tests.support.photos import (
    SMALL_FACE,
    distance_to,
    evenly_scaled,
    mortar,
    photo_of,
    photo_of_light,
    wandering,
    with_crack,
    with_paint,
    write_png,
)

SIZE_PX = (500, 300)
CRACK = [(40.0, 150.0), (250.0, 120.0), (460.0, 170.0)]
SCRATCH = [(50.0, 270.0), (200.0, 270.0)]


def photo_of_lines(folder, *lines, size_px=SIZE_PX, width_px=14):
    picture = mortar(size_px)
    for points in lines:
        picture = with_crack(picture, points, width_px)
    return photo_of_light(folder, picture)


@pytest.fixture(scope="module")
def specimen():
    return make_specimen(1, Recipe(**SMALL_FACE))


@pytest.fixture(scope="module")
def photo(specimen, tmp_path_factory):
    return photo_of(specimen, tmp_path_factory.mktemp("photo"))


def test_the_path_follows_the_crack_from_the_first_clicked_end_to_the_second(specimen, photo):
    path = find_path(photo, specimen.ends_px)
    assert distance_to(photo.to_mm(path.points_px), specimen.centreline_mm).max() < 0.9
    assert np.linalg.norm(path.points_px[[0, -1]] - np.array(specimen.ends_px), axis=1).max() < 15
    assert (path.source, path.width_px) == ("ends", pytest.approx(31, rel=0.15))


@pytest.mark.parametrize(
    ("off_px", "says"), [((0, 55), r"5\.\d mm outside the face"), ((-100, -60), "not on a crack: .* away")]
)
def test_the_error_for_an_end_off_the_crack_gives_the_distance(specimen, photo, off_px, says):
    (x, y), other = specimen.ends_px
    with pytest.raises(InputError, match=says):
        find_path(photo, ((x + off_px[0], y + off_px[1]), other))


TURN = np.linspace(0, 2 * np.pi * (1 - 4 / 360), 100)
RIM = np.column_stack([250 + 30 * np.cos(TURN), 150 + 30 * np.sin(TURN)]).astype(int).tolist()
ALIKE = [wandering([(30, 60), (470, 80)]), wandering([(30, 240), (470, 220)])]


@pytest.mark.parametrize(
    ("lines", "ends_px", "says"),
    [
        ([], ((-5.0, 100.0), (400.0, 100.0)), r"end \(-5, 100\) is outside the photo of 500 x 300 px"),
        ([], ((100.0, 100.0), (111.0, 100.0)), r"11 px apart. .* 15 px"),
        ([], ((50.0, 60.0), (450.0, 250.0)), "no crack between the ends"),
        ([], None, "no crack found"),
        # The rim of a stain comes back to where it begins: "only 9 px apart" would name ends that were not given.
        ([RIM], None, "no crack found: .*[gG]ive ends_px"),
        (ALIKE, None, r"which line is the crack\?"),
    ],
)
def test_a_photo_without_a_clear_crack_or_with_invalid_ends_is_refused(tmp_path, lines, ends_px, says):
    with pytest.raises(InputError, match=says):
        find_path(photo_of_lines(tmp_path, *lines, width_px=6 if lines == [RIM] else 14), ends_px)


def test_the_crack_is_offered_before_the_shadow_around_the_sample():
    """The shadow's edge is the longest dark line in the photo. Tolerance: one width of the crack, 31 px."""
    photo = load_photo(PhotoInput(file=FIXTURE / "photo.jpg", data="synthetic", mm_per_px=0.1), FIXTURE)
    path, truth_px = find_path(photo, None, crack=1), np.asarray(make_specimen(1).truth()["centreline_px"])
    assert distance_to(path.points_px, truth_px).max() < 31
    outline = trace_outline(photo, path)
    assert outline.mean_width_mm == pytest.approx(3.1, rel=0.02)
    # The found line ends before the shade of the face's edge.
    assert 0 < 80 - outline.length_mm < 15


def strokes(*lines, width_px=14):
    mask = np.zeros(SIZE_PX[::-1], dtype=np.uint8)
    for line in lines:
        cv2.polylines(mask, [np.array(line, dtype=np.int32)], False, 1, width_px)
    return mask > 0


@pytest.fixture
def plain(tmp_path):
    """A photo without a crack."""
    return photo_of_lines(tmp_path)


def test_the_path_follows_the_middle_of_the_painted_stroke(plain):
    """Tolerance: two cells of the skeleton of a stroke drawn on whole pixels, and one width at the ends."""
    path = find_path(with_paint(plain, strokes(CRACK)), None)
    assert (path.source, path.warnings, path.width_px) == ("mask", (), pytest.approx(14, abs=2))
    assert path.points_px[0, 0] < path.points_px[-1, 0]
    assert distance_to(path.points_px, np.array(CRACK)).max() < 2.5
    assert np.linalg.norm(path.points_px[[0, -1]] - np.array(CRACK)[[0, -1]], axis=1).max() < 14


@pytest.mark.parametrize(
    ("ends_px", "line", "refusal"),
    [
        (None, CRACK, None),
        (((55.0, 270.0), (190.0, 271.0)), SCRATCH, None),
        (((60.0, 200.0), (450.0, 168.0)), None, r"end \(60, 200\) is more than 15 px beside"),
        (((45.0, 150.0), (180.0, 270.0)), None, "different pieces of the mask"),
    ],
)
def test_the_largest_painted_piece_is_followed_unless_the_ends_are_on_another_piece(plain, ends_px, line, refusal):
    photo = with_paint(plain, strokes(CRACK) | strokes(SCRATCH, width_px=5))
    with pytest.raises(InputError, match=refusal) if refusal else nullcontext():
        path = find_path(photo, ends_px)
        assert distance_to(path.points_px, np.array(line)).max() < 4
        assert "2 pieces" in path.warnings[0].text


def test_a_lone_crack_is_taken_without_clicks(tmp_path):
    path = find_path(photo_of_lines(tmp_path, UPPER, width_px=8), None)
    assert path.source == "found"
    assert distance_to(path.points_px, np.array(UPPER)).max() < 9
    assert path.verdict["probability"] >= TAKEN


def test_a_crack_number_selects_the_crack_of_that_rank(tmp_path):
    search = CrackSearch.of(photo_of_lines(tmp_path, UPPER, LOWER))
    with pytest.raises(RivalCracksError, match=r"which line is the crack\? .*: 1\. .*; 2\. "):
        search.path(None)
    assert search.cracks[0].score >= search.cracks[1].score
    for number, crack in enumerate(search.cracks, 1):
        path = search.path(number)
        assert path.source == "choice"
        assert distance_to(path.points_px, crack.line_px).max() < 9
    with pytest.raises(InputError, match=r"photo\.crack = 3, but only 2 .*: 1\. .*; 2\. "):
        search.path(3)


ENDS = ((30.0, 150.0), (470.0, 150.0))
LOW = [(30.0, 150.0), (120, 150), (250, 215), (380, 150), (470, 150)]
HIGH = [(120.0, 150.0), (250, 45), (380, 150)]
"""A crack that parts and meets again: the lower arm is shorter."""
BRANCH = [(250.0, 215.0), (260, 285)]


@pytest.fixture(scope="module")
def forked(tmp_path_factory):
    picture = with_crack(with_crack(with_crack(mortar(), LOW), HIGH, width_px=10), BRANCH, width_px=8)
    return evenly_scaled(write_png(tmp_path_factory.mktemp("forked") / "photo.png", picture))


@pytest.fixture(scope="module")
def wire(forked):
    return LiveWire(forked)


def test_a_via_point_a_little_beyond_the_end_is_passed_by(tmp_path):
    """The way there and back is left out of the first path. The second, which stays near it, once had no way there."""
    line = [(30.0, 150.0), (250, 150), (470, 150)]
    path = find_path(photo_of_lines(tmp_path, line, width_px=3), (line[0], (455.0, 150.0)), via_px=((468.0, 150.0),))
    assert distance_to(path.points_px, np.array(line)).max() < 4
    assert path.points_px[-1] == pytest.approx((455, 150), abs=4)


@pytest.mark.parametrize("via", [(250.0, 45.0), (244.0, 52.0)], ids=["on the arm", "9 px beside the arm"])
def test_a_via_point_selects_one_arm_of_a_forked_crack(wire, via):
    path = wire.path(ENDS, (via,))
    assert path.source == "via"
    assert distance_to(path.points_px, np.array([LOW[0], *HIGH, LOW[-1]])).max() < 7
    assert distance_to(np.array([HIGH[1]]), path.points_px)[0] < 9


@pytest.mark.parametrize(
    ("via", "says"),
    [
        (((380.0, 150.0), (120.0, 150.0)), r"via point \(\d+, 150\) the path runs back"),
        (((260.0, 280.0),), r"after the via point \(260, 280\) .* on a branch"),
        (((250.0, 120.0),), r"via point \(250, 120\) is not on a crack"),
        (((250.0, 301.0),), r"via point \(250, 301\) is outside the photo of 500 x 300 px"),
    ],
    ids=["in the wrong order", "on a branch", "beside the crack", "outside the photo"],
)
def test_via_points_in_the_wrong_order_or_off_the_crack_are_refused(wire, via, says):
    with pytest.raises(InputError, match=says):
        wire.path(ENDS, via)


UPPER = [(30.0, 60.0), (110, 80), (180, 62), (250, 75), (330, 50), (400, 66), (470, 55)]
LOWER = [(x, 290 - y) for x, y in UPPER]


def test_a_region_of_interest_selects_the_crack_inside_the_region(tmp_path):
    """Tolerance: the path ends within one width, 14 px, of the crack's tip."""
    photo = photo_of_lines(tmp_path, UPPER, LOWER)
    path = find_path(photo, None, roi_px=((5.0, 175.0), (495.0, 165.0), (495.0, 290.0), (5.0, 290.0)), crack=1)
    assert distance_to(path.points_px, np.array(LOWER)).max() < 14
