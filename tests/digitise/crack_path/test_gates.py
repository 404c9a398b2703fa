"""What a path between clicks is refused or doubted for, with its place, and sound paths that are not."""

import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from tests.support.photos import distance_to, evenly_scaled, mortar, with_crack, write_png

WAVE = [(x, round(150 + 25 * np.sin(x / 40) + 9 * np.sin(x / 11))) for x in range(40, 461, 6)]


def path_in(folder, picture, ends_px, via_px=()):
    return find_path(evenly_scaled(write_png(folder / "photo.png", picture)), ends_px, via_px)


def light_line(picture, points, width_px, times=1.7):
    return picture + (picture - with_crack(picture, points, width_px)) * (times - 1)


def broken(gap_px):
    picture = with_crack(mortar(), WAVE, 5)
    picture[:, 250 : 250 + gap_px] = mortar()[:, 250 : 250 + gap_px]
    return picture


def test_a_long_stretch_as_bright_as_the_ground_is_refused_with_its_place(tmp_path):
    with pytest.raises(InputError, match=r"plain ground: \d+ px from \(2\d\d, .*via_px"):
        path_in(tmp_path, broken(110), (WAVE[0], WAVE[-1]))


def test_a_short_one_is_doubted(tmp_path):
    (doubt,) = path_in(tmp_path, broken(45), (WAVE[0], WAVE[-1])).warnings
    assert "hardly any crack" in doubt.text


def test_a_path_in_the_shade_of_a_light_crack_is_doubted(tmp_path):
    shade = with_crack(mortar(), [(x, y + 5) for x, y in WAVE], 3)
    path = path_in(tmp_path, light_line(shade, WAVE, 6), (WAVE[0], WAVE[-1]))
    assert any("times as bright as the ground" in warning.text for warning in path.warnings)


@pytest.mark.parametrize("width_px", [6, 16])
def test_a_light_crack_without_a_shade_is_refused_or_doubted_by_name(tmp_path, width_px):
    """The darkest way between the clicks is a rim of the light line, or bare ground beside it."""
    try:
        path = path_in(tmp_path, light_line(mortar(seed=2), WAVE, width_px), (WAVE[0], WAVE[-1]))
        answer = " ".join(texts(path.warnings))
    except InputError as refusal:
        answer = str(refusal)
    assert "light crust, paint it in photo.mask" in answer


@pytest.fixture
def tiled():
    """Joints right across."""
    return with_crack(with_crack(mortar(), [(60, -10), (60, 310)], 4), [(-10, 200), (510, 200)], 4)


def test_a_way_round_by_two_joints_is_doubted_with_its_place(tmp_path, tiled):
    path = path_in(tmp_path, tiled, ((60.0, 40.0), (430.0, 200.0)))
    (doubt,) = path.warnings
    assert "as straight as a joint" in doubt.text


def test_a_crack_with_corners_but_no_line_beyond_them_is_not(tmp_path):
    rng = np.random.default_rng(1)
    x = np.arange(40, 460, 20.0)
    crack = [(float(a), float(b)) for a, b in zip(x, 150 + rng.normal(0, 12, len(x)), strict=True)]
    assert path_in(tmp_path, with_crack(mortar(), crack, 8), (crack[0], crack[-1])).warnings == ()


def test_a_click_on_a_faint_crack_that_is_moved_to_a_line_beside_it_is_named(tmp_path):
    joint = with_crack(mortar(), [(-10, 140), (510, 140)], 7)
    faint = 0.85 * joint + 0.15 * with_crack(joint, [(x, y) for x, y in [(60, 152), (250, 153), (440, 152)]], 2)
    path = path_in(tmp_path, faint, ((60.0, 152.0), (440.0, 152.0)))
    assert any("moved" in warning.text or "joint" in warning.text for warning in path.warnings)


@pytest.mark.parametrize("ahead_px", [0.0, 14.0])
def test_a_sound_crack_is_taken_without_a_word(tmp_path, ahead_px):
    path = path_in(tmp_path, with_crack(mortar(), WAVE, 7), ((42.0 - ahead_px, WAVE[0][1] + 2.0), WAVE[-1]))
    assert path.warnings == ()
    assert distance_to(path.points_px, np.array(WAVE, dtype=float)).max() < 5
