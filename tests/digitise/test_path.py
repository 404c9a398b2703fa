import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from fixtures.generate.specimen import Recipe, Specimen, make_specimen
from sealtwin.core.errors import InputError
from tests.support.paths import FIXTURE
from tests.support.photos import (
    SMALL_FACE,
    distance_to,
    evenly_scaled,
    mortar,
    photo_of,
    wandering,
    with_crack,
    write_png,
)


@pytest.fixture(scope="module")
def specimen() -> Specimen:
    return make_specimen(1, Recipe(**SMALL_FACE))


@pytest.fixture(scope="module")
def photo(specimen, tmp_path_factory):
    return photo_of(specimen, tmp_path_factory.mktemp("photo"))


def plain(folder, picture):
    """At 0.1 mm per pixel."""
    return evenly_scaled(write_png(folder / "photo.png", picture))


def test_the_path_runs_in_the_crack_from_the_first_end_to_the_second(specimen, photo):
    path = find_path(photo, specimen.ends_px)
    assert distance_to(photo.to_mm(path.points_px), specimen.centreline_mm).max() < 0.9
    assert np.linalg.norm(path.points_px[[0, -1]] - np.array(specimen.ends_px), axis=1).max() < 15
    assert path.width_px == pytest.approx(31, rel=0.15)
    assert path.source == "ends"


@pytest.mark.parametrize(
    ("ends_px", "says"),
    [
        (((-5.0, 100.0), (400.0, 100.0)), r"end \(-5, 100\) is outside the photo of 500 x 300 px"),
        (((5.0, 100.0), (400.0, 300.0)), r"end \(400, 300\) is outside the photo"),
        (((100.0, 100.0), (100.0, 100.0)), "only 0 px apart"),
        (((100.0, 100.0), (111.0, 100.0)), r"only 11 px apart; .* 15 px beside its crack, .* farther apart than that"),
        (((50.0, 60.0), (450.0, 250.0)), "no crack between the ends"),
    ],
)
def test_ends_that_no_crack_can_have_are_refused(tmp_path, ends_px, says):
    with pytest.raises(InputError, match=says):
        find_path(plain(tmp_path, mortar()), ends_px)


@pytest.mark.parametrize(
    ("off_px", "says"),
    [((0, 55), r"is 5\.\d mm outside the face"), ((-100, -60), "is not on a crack: the nearest one is")],
)
def test_an_end_off_the_crack_is_refused_with_its_distance(specimen, photo, off_px, says):
    (x, y), other = specimen.ends_px
    with pytest.raises(InputError, match=says):
        find_path(photo, ((x + off_px[0], y + off_px[1]), other))


def test_a_search_without_ends_blames_no_ends(tmp_path):
    """The rim of a stain comes back to where it begins: "the two ends are only 9 px apart" names what nobody gave."""
    turn = np.linspace(0, 2 * np.pi * (1 - 4 / 360), 100)
    rim = np.column_stack([250 + 30 * np.cos(turn), 150 + 30 * np.sin(turn)]).astype(int)
    picture = with_crack(mortar(), [(x, y) for x, y in rim.tolist()], width_px=6)
    with pytest.raises(InputError, match=r"no crack found: nothing dark, thin and long stands out; give ends_px"):
        find_path(plain(tmp_path, picture), None)


@pytest.mark.parametrize(
    ("lines", "ends_px", "says"),
    [
        ([], None, "no crack found"),
        # A wide gap between two cracks is no crack.
        ([[(20, 150), (170, 150)], [(330, 150), (480, 150)]], ((30.0, 150.0), (470.0, 150.0)), "plain ground"),
        # Two of like strength are the user's choice.
        ([wandering([(30, 60), (470, 80)]), wandering([(30, 240), (470, 220)])], None, r"\d cracks compete"),
    ],
)
def test_a_photo_without_one_crack_is_refused(tmp_path, lines, ends_px, says):
    picture = mortar()
    for line in lines:
        picture = with_crack(picture, line)
    with pytest.raises(InputError, match=r"photo\.png: .*" + says):
        find_path(plain(tmp_path, picture), ends_px)


def test_without_markers_and_ends_the_shadow_around_the_sample_is_not_taken_for_a_crack():
    """Its edge is the longest dark line in the photo; a nozzle would drive along it. Within one width of the ends."""
    photo = load_photo(PhotoInput(file=FIXTURE / "photo.jpg", data="synthetic", mm_per_px=0.1), FIXTURE)
    truth = make_specimen(1)
    path = find_path(photo, None)
    truth_px = np.asarray(truth.truth()["centreline_px"])
    assert distance_to(path.points_px, truth_px).max() < 31
    assert np.linalg.norm(path.points_px[[0, -1]] - truth_px[[0, -1]], axis=1).max() < 31
    outline = trace_outline(photo, path)
    assert outline.mean_width_mm == pytest.approx(3.1, rel=0.02)
    assert outline.length_mm == pytest.approx(80, abs=2)
    assert any("searched for only inside" in warning.text for warning in outline.warnings)


def test_a_crack_is_not_followed_along_a_straight_edge(tmp_path):
    """The same with an edge that was sawn: 14 px of shadow, whose two rims are no cracks either."""
    picture = mortar()
    picture[200:] *= 2.7
    picture = with_crack(with_crack(picture, [(60, 10), (200, 200)]), [(200, 200), (480, 200)])
    path = find_path(plain(tmp_path, picture), None, crack=1)
    assert distance_to(path.points_px, np.array([(60.0, 10.0), (200.0, 200.0)])).max() < 7
