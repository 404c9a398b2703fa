from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from digitise.geometry.polyline import rectangle
from digitise.image.raster import Map
from digitise.photo import darker_of_both, load_photo
from fixtures.generate.lighting import DIFFUSE, STRONG_LAMP
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import Specimen, make_specimen
from sealtwin.core.coverage import coverage
from sealtwin.core.errors import InputError
from tests.pictures import SMALL_FACE, mortar, with_crack, write_png

FILE = Path("second.png")
SIZE_PX = (900, 700)
MIDDLE_PX = (450, 350)
FACE_MM = (0.0, 0.0, *SMALL_FACE["face_mm"])


def lit(from_the_left: bool, noise_seed: int = 0, size_px=SIZE_PX, grain: float = 1.0, rim_px: int = 10) -> Map:
    """A dark band, 40 px wide, of which the wall across from the lamp is as bright as the mortar."""
    light = 0.35 + grain * (mortar(size_px) - 0.35)
    light[:, 430:470] = 0.02
    light[:, 470 - rim_px : 470 if from_the_left else 470 - rim_px] = 0.34
    light[:, 430 : 430 if from_the_left else 430 + rim_px] = 0.34
    noise = np.random.default_rng(noise_seed).standard_normal(light.shape)
    return (cv2.GaussianBlur(light, (0, 0), 1.0) + 0.005 * noise).astype(np.float32)


def width_px(light: Map) -> float:
    """Of what is darker than half the mortar."""
    return float(np.mean(np.sum(light < 0.18, axis=1)))


def moved(light: Map, shift_px=(0.0, 0.0), turn_deg: float = 0.0) -> Map:
    motion = cv2.getRotationMatrix2D(MIDDLE_PX, turn_deg, 1.0)
    motion[:, 2] += shift_px
    back = cv2.warpAffine(light, motion, SIZE_PX, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(back, dtype=np.float32)


def test_the_darker_of_both_has_neither_lit_wall():
    """Each photo alone shows three quarters of the crack."""
    first, second = lit(True, 1), lit(False, 2)
    assert width_px(first) == pytest.approx(30, abs=0.3)
    assert width_px(second) == pytest.approx(30, abs=0.3)
    both, warnings = darker_of_both(first, second, FILE)
    assert width_px(both) == pytest.approx(40, abs=0.3)
    assert warnings == ()


def test_a_brighter_exposure_is_brought_to_that_of_the_first():
    """A camera that exposes by itself; with the other way round, mortar would be halved and its noise with it."""
    both, _ = darker_of_both(lit(True, 1), 0.5 * lit(False, 2), FILE)
    assert np.median(both) == pytest.approx(np.median(lit(True)), rel=0.02)
    assert width_px(both) == pytest.approx(40, abs=0.3)


def test_a_small_shift_is_undone_and_told():
    """Left as it is, a shift of 1.5 px along the normal would widen the crack by as much."""
    both, (warning,) = darker_of_both(lit(True, 1), moved(lit(False, 2), (1.5, -0.4)), FILE)
    assert width_px(both) == pytest.approx(40, abs=0.4)
    assert "moved by 1.6 px onto the first" in warning


def test_a_camera_that_stood_still_has_not_moved():
    """Of this size, tiles are transformed in an odd length, half a pixel off in x and in y."""
    both, warnings = darker_of_both(lit(True, 1, (1215, 670)), lit(False, 2, (1215, 670)), FILE)
    assert warnings == ()
    assert width_px(both) == pytest.approx(40, abs=0.3)


def test_a_crack_lit_from_either_side_is_no_camera_that_moved():
    """Walls 20 px broad on mortar of faint grain: a tile that holds the crack seems to have moved by 21 px."""
    both, warnings = darker_of_both(lit(True, 1, grain=0.15, rim_px=20), lit(False, 2, grain=0.15, rim_px=20), FILE)
    assert width_px(both) == pytest.approx(40, abs=0.3)
    assert not any("moved" in warning for warning in warnings)


@pytest.mark.parametrize(
    ("second", "says"),
    [
        (moved(lit(False, 2), (3.0, 0.0)), r"camera has moved by 3\.[0-2] px"),
        (moved(lit(False, 2), (40.0, 25.0)), r"camera has moved by 47\.\d px"),
        (moved(lit(False, 2), turn_deg=0.3), r"camera has moved by \d\.\d px"),
        (with_crack(mortar(SIZE_PX, seed=2), [(100, 100), (700, 500)]).astype(np.float32), r"second\.png: the second"),
        (lit(False)[:, 20:], "second photo is 880 x 700 px, the first 900 x 700"),
    ],
    ids=["a little", "far", "turned", "another scene", "another size"],
)
def test_a_camera_that_moved_and_another_scene_are_refused(second, says):
    with pytest.raises(InputError, match=says):
        darker_of_both(lit(True, 1), second, FILE)


def test_another_sample_in_the_same_frame_is_remarked_on():
    first, second = lit(True, 1), lit(False, 2)
    second[240:460, 310:590] = mortar((280, 220), seed=5).astype(np.float32)
    _, (warning,) = darker_of_both(first, second, FILE)
    assert warning.startswith("in 1 of 9 parts, the second photo does not show")


@pytest.fixture(scope="module")
def lamplit() -> Specimen:
    recipe = Recipe(**SMALL_FACE, mm_per_px=0.15, look=replace(DIFFUSE, lamp=STRONG_LAMP), second_photo=True)
    return make_specimen(1, recipe)


def test_a_second_photo_of_a_trial_is_read_beside_it(lamplit, tmp_path):
    """The lamp hides 7 % of the crack; in both photos none of it, and the markers lie where they lay."""
    lamplit.write(tmp_path)
    settings = lamplit.photo_input()
    alone = load_photo(settings, tmp_path)
    both = load_photo(settings.model_copy(update={"second_photo": Path("second.jpg")}), tmp_path)
    crack, face = (
        coverage(lamplit.to_px(ring_mm), alone.size_px) > 0.99 for ring_mm in (lamplit.outline_mm, rectangle(FACE_MM))
    )
    seen_alone, seen_in_both = (
        np.mean(photo.brightness[crack] < 0.5 * np.median(photo.brightness[face])) for photo in (alone, both)
    )
    assert seen_alone < 0.95
    assert seen_in_both > 0.99
    corners_mm = rectangle(FACE_MM)
    assert np.abs(both.to_mm(lamplit.to_px(corners_mm)) - corners_mm).max() < 0.01
    assert both.warnings == ()


@pytest.mark.parametrize(
    ("second", "says"),
    [
        ("black.png", r"black\.png: the photo is black"),
        # Nor is a copy of the first another photo: it shows no other light.
        ("photo.jpg", "shows the same pixels"),
        ("copy.jpg", "shows the same pixels"),
    ],
)
def test_a_second_photo_that_shows_no_other_light_is_refused(lamplit, tmp_path, second, says):
    lamplit.write(tmp_path)
    write_png(tmp_path / "black.png", np.zeros((300, 500)))
    (tmp_path / "copy.jpg").write_bytes((tmp_path / "photo.jpg").read_bytes())
    with pytest.raises(InputError, match=says):
        load_photo(lamplit.photo_input().model_copy(update={"second_photo": Path(second)}), tmp_path)
