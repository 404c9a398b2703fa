"""Paths between clicks that are refused or doubted, with the position of the fault."""

import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from tests.support.photos import mortar, photo_of_light, with_crack

WAVE = [(x, round(150 + 25 * np.sin(x / 40) + 9 * np.sin(x / 11))) for x in range(40, 461, 6)]
ENDS = (WAVE[0], WAVE[-1])


def path_in(folder, picture, ends_px=ENDS):
    return find_path(photo_of_light(folder, picture), ends_px)


def broken(gap_px):
    picture = with_crack(mortar(), WAVE, 5)
    picture[:, 250 : 250 + gap_px] = mortar()[:, 250 : 250 + gap_px]
    return picture


def light_line(picture, width_px):
    return picture + (picture - with_crack(picture, WAVE, width_px)) * 0.7


@pytest.mark.parametrize(
    ("picture", "doubt"),
    [
        (broken(45), "hardly any crack"),
        (light_line(with_crack(mortar(), [(x, y + 5) for x, y in WAVE], 3), 6), "times as bright as the ground"),
    ],
    ids=["a short stretch as bright as the ground", "the shade of a light crack"],
)
def test_a_path_over_bare_ground_or_along_a_shadow_gives_a_warning(tmp_path, picture, doubt):
    assert any(doubt in text for text in texts(path_in(tmp_path, picture).warnings))


def test_the_error_for_a_long_stretch_as_bright_as_the_ground_gives_its_position(tmp_path):
    with pytest.raises(InputError, match=r"plain ground: \d+ px from \(2\d\d, .*via_px"):
        path_in(tmp_path, broken(110))


@pytest.mark.parametrize("width_px", [6, 16])
def test_the_message_for_a_light_crack_without_a_shade_advises_painting_a_mask(tmp_path, width_px):
    """The darkest way between the clicks is a rim of the light line, or bare ground beside it."""
    try:
        answer = " ".join(texts(path_in(tmp_path, light_line(mortar(seed=2), width_px)).warnings))
    except InputError as refusal:
        answer = str(refusal)
    assert "light crust, paint it in photo.mask" in answer


def test_a_path_along_two_joints_gives_a_warning(tmp_path):
    tiled = with_crack(with_crack(mortar(), [(60, -10), (60, 310)], 4), [(-10, 200), (510, 200)], 4)
    (doubt,) = path_in(tmp_path, tiled, ((60.0, 40.0), (430.0, 200.0))).warnings
    assert "as straight as a joint" in doubt.text
