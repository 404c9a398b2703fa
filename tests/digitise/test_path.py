import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.crack_path.standing_out import unlike_length_px
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.scale.face_scale import see_face
from digitise.settings import PhotoInput
from fixtures.generate.specimen import Recipe, Specimen, make_specimen
from sealtwin.core.errors import InputError
from tests.pictures import SMALL_FACE, distance_to, evenly_scaled, mortar, photo_of, with_crack, write_png
from tests.places import FIXTURE


@pytest.fixture(scope="module")
def specimen() -> Specimen:
    return make_specimen(1, Recipe(**SMALL_FACE))


@pytest.fixture(scope="module")
def photo(specimen, tmp_path_factory):
    return photo_of(specimen, tmp_path_factory.mktemp("photo"))


@pytest.fixture
def plain(tmp_path):
    return evenly_scaled(write_png(tmp_path / "plain.png", mortar()))


def test_the_path_runs_in_the_crack_from_the_first_end_to_the_second(specimen, photo):
    path = find_path(photo, specimen.ends_px)
    assert distance_to(photo.to_mm(path.points_px), specimen.centreline_mm).max() < 0.9
    assert np.linalg.norm(path.points_px[[0, -1]] - np.array(specimen.ends_px), axis=1).max() < 15
    assert path.width_px == pytest.approx(31, rel=0.15)
    assert path.source == "ends"


def test_swapped_ends_turn_the_path_round(specimen, photo):
    there, back = find_path(photo, specimen.ends_px), find_path(photo, specimen.ends_px[::-1])
    assert np.linalg.norm(there.points_px[0] - back.points_px[-1]) < 5
    assert distance_to(back.points_px, there.points_px).max() < 5


def test_without_ends_the_crack_is_found_and_said_to_be(specimen, photo):
    path = find_path(photo, None)
    assert path.source == "automatic"
    assert path.points_px[0, 0] < path.points_px[-1, 0]
    assert distance_to(photo.to_mm(path.points_px), specimen.centreline_mm).max() < 0.9
    for end_px in specimen.ends_px:
        assert distance_to(np.array([end_px]), path.points_px)[0] < 2 * path.width_px


def test_a_thin_branch_does_not_lead_away(tmp_path):
    main = [(20.0, 150.0), (250, 140), (480, 160)]
    picture = with_crack(with_crack(mortar(), main), [(250, 140), (330, 30)], width_px=4)
    path = find_path(evenly_scaled(write_png(tmp_path / "photo.png", picture)), (main[0], main[-1]))
    assert distance_to(path.points_px, np.array(main)).max() < 6


@pytest.mark.parametrize(
    ("ends_px", "says"),
    [
        (((-5.0, 100.0), (400.0, 100.0)), r"end \(-5, 100\) is outside the photo of 500 x 300 px"),
        (((5.0, 100.0), (400.0, 300.0)), r"end \(400, 300\) is outside the photo"),
        (((100.0, 100.0), (100.0, 100.0)), "same place"),
        (((100.0, 100.0), (111.0, 100.0)), r"only 11 px apart; .* 15 px beside its crack, .* farther apart than that"),
        (((50.0, 60.0), (450.0, 250.0)), "no crack between the ends"),
    ],
)
def test_ends_that_no_crack_can_have_are_refused(plain, ends_px, says):
    with pytest.raises(InputError, match=says):
        find_path(plain, ends_px)


def test_an_end_outside_the_face_is_refused_with_its_distance(specimen, photo):
    x, y = specimen.ends_px[0]
    with pytest.raises(InputError, match=r"is 5\.\d mm outside the face"):
        find_path(photo, ((x, y + 55), specimen.ends_px[1]))


def test_an_end_beside_the_crack_is_refused_with_its_distance(specimen, photo):
    x, y = specimen.ends_px[0]
    with pytest.raises(InputError, match="is not on a crack: the nearest one is"):
        find_path(photo, ((x - 100, y - 60), specimen.ends_px[1]))


def test_a_click_beside_the_crack_is_forgiven_within_its_width(specimen, photo):
    """10 px off, as a hand may be, in four directions."""
    for turn in np.linspace(0, 2 * np.pi, 4, endpoint=False):
        clicked = np.array(specimen.ends_px) + 10 * np.array([np.cos(turn), np.sin(turn)])
        path = find_path(photo, ((clicked[0, 0], clicked[0, 1]), (clicked[1, 0], clicked[1, 1])))
        assert distance_to(photo.to_mm(path.points_px), specimen.centreline_mm).max() < 1.5


def test_a_photo_without_a_crack_is_refused(plain):
    with pytest.raises(InputError, match="no crack found"):
        find_path(plain, None)


@pytest.mark.parametrize("radius_px", [30, 60])
def test_a_search_without_ends_blames_no_ends(radius_px, tmp_path):
    """The rim of a stain comes back to where it begins: "the two ends are only 9 px apart" would name what nobody gave.

    With the larger rim, a gap of 16 px would be traced in place of the rim.
    """
    turn = np.linspace(0, 2 * np.pi * (1 - 4 / 360), 100)
    rim = np.column_stack([250 + radius_px * np.cos(turn), 150 + radius_px * np.sin(turn)]).astype(int)
    picture = with_crack(mortar(), [(x, y) for x, y in rim.tolist()], width_px=6)
    with pytest.raises(InputError, match=r"no crack found: nothing dark, thin and long stands out; give ends_px"):
        find_path(evenly_scaled(write_png(tmp_path / "photo.png", picture)), None)


def test_a_wide_gap_between_two_cracks_is_no_crack(tmp_path):
    picture = with_crack(with_crack(mortar(), [(20, 150), (170, 150)]), [(330, 150), (480, 150)])
    photo = evenly_scaled(write_png(tmp_path / "photo.png", picture))
    with pytest.raises(InputError, match=r"photo.png: no crack on \d\d%"):
        find_path(photo, ((30.0, 150.0), (470.0, 150.0)))


def test_two_cracks_of_like_strength_are_the_user_s_choice(tmp_path):
    picture = with_crack(with_crack(mortar(), [(30, 60), (470, 80)]), [(30, 240), (470, 220)])
    with pytest.raises(InputError, match="2 cracks compete"):
        find_path(evenly_scaled(write_png(tmp_path / "photo.png", picture)), None)


@pytest.mark.parametrize("scale", [{"mm_per_px": 0.1}, {"face_mm": (160.0, 40.0)}], ids=["mm_per_px", "face_mm"])
def test_without_markers_and_ends_the_shadow_around_the_sample_is_not_taken_for_a_crack(scale):
    """Its edge is the longest dark line in the photo; a nozzle would drive along it. Within one width of the ends."""
    photo = load_photo(PhotoInput.model_validate({"file": FIXTURE / "photo.jpg", "data": "synthetic"} | scale), FIXTURE)
    truth = make_specimen(1)
    path = find_path(photo, None)
    truth_px = np.asarray(truth.truth()["centreline_px"])
    assert distance_to(path.points_px, truth_px).max() < 31
    assert np.linalg.norm(path.points_px[[0, -1]] - truth_px[[0, -1]], axis=1).max() < 31
    outline = trace_outline(photo, path)
    assert outline.mean_width_mm == pytest.approx(3.1, rel=0.02)
    assert outline.length_mm == pytest.approx(80, abs=2)
    assert any("inside the edges of the sample" in warning for warning in outline.warnings) == ("mm_per_px" in scale)


def test_a_line_that_turns_into_the_sample_s_edge_is_remarked_on(tmp_path):
    """A cropped photo: mortar above, a bright board below, a shadow between them into which the crack runs."""
    crack, edge = [(60, 10), (200, 200)], [(200, 200), (290, 214), (390, 190), (480, 204)]
    board = np.zeros((300, 500), dtype=np.uint8)
    cv2.fillPoly(board, [np.array([(0, 200), *edge, (500, 204), (500, 300), (0, 300)], dtype=np.int32)], [1])
    picture = mortar() * np.where(board, 2.7, 1.0)
    photo = evenly_scaled(write_png(tmp_path / "photo.png", with_crack(with_crack(picture, crack), edge)))
    turned = find_path(photo, None)
    assert any("one side is far brighter" in warning for warning in turned.warnings)
    along_edge_px = float(np.ptp(turned.points_px[turned.points_px[:, 1] > 184, 0]))
    assert along_edge_px > 100
    assert unlike_length_px(photo, turned.points_px, turned.width_px) == pytest.approx(along_edge_px, abs=30)
    straight = find_path(evenly_scaled(write_png(tmp_path / "plain.png", with_crack(mortar(), crack))), None)
    assert straight.warnings == ()


def test_a_crack_is_not_followed_along_a_straight_edge(tmp_path):
    """The same with an edge that was sawn: 14 px of shadow, whose two rims are no cracks either."""
    picture = mortar()
    picture[200:] *= 2.7
    picture = with_crack(with_crack(picture, [(60, 10), (200, 200)]), [(200, 200), (480, 200)])
    path = find_path(evenly_scaled(write_png(tmp_path / "photo.png", picture)), None)
    assert distance_to(path.points_px, np.array([(60.0, 10.0), (200.0, 200.0)])).max() < 7


@pytest.mark.parametrize("seed", range(3))
def test_plain_mortar_and_a_straight_crack_are_no_face(seed):
    assert see_face(mortar(seed=seed).astype(np.float32)) is None
    crossed = with_crack(mortar(seed=seed), [(20, 60), (480, 200)], width_px=40)
    assert see_face(crossed.astype(np.float32)) is None
