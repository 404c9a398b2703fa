"""The probability that a path follows a crack, and the reason against it with its place."""

import numpy as np
import pytest

from digitise.crack_path.find_path import CrackSearch, RivalCracksError, find_path
from digitise.crack_path.line_verdict import DOUBTED, WEIGHTS
from digitise.outline import trace_outline
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from tests.support.photos import how_traced, mortar, photo_of_light, with_crack

WAVE = [(x, round(150 + 25 * np.sin(x / 40) + 9 * np.sin(x / 11))) for x in range(40, 461, 6)]
ENDS = (WAVE[0], WAVE[-1])


def path_in(folder, picture, ends_px=ENDS):
    return find_path(photo_of_light(folder, picture), ends_px)


def broken(gap_px, from_px=250):
    picture = with_crack(mortar(), WAVE, 5)
    picture[:, from_px : from_px + gap_px] = mortar()[:, from_px : from_px + gap_px]
    return picture


def light_line(picture, width_px):
    return picture + (picture - with_crack(picture, WAVE, width_px)) * 0.7


STRAIGHT = ((60.0, 150.0), (440.0, 155.0))


@pytest.mark.parametrize(
    ("picture", "ends_px", "low", "high"),
    [
        (with_crack(mortar(), WAVE, 5), ENDS, 0.95, 1),
        (broken(45), ENDS, 0.9, 1),
        (broken(110), ENDS, 0.2, 0.55),
        (with_crack(mortar(), STRAIGHT, 6), STRAIGHT, 0.6, 0.8),
    ],
    ids=["a crack", "a short gap", "a long gap", "a straight line"],
)
def test_the_probability_falls_with_bare_stretches_and_straight_legs(tmp_path, picture, ends_px, low, high):
    path = path_in(tmp_path, picture, ends_px)
    assert low < path.verdict["probability"] < high
    assert [doubt.key for doubt in path.warnings] == ["path.doubtful"] * (path.verdict["probability"] < DOUBTED)
    assert path.verdict.keys() == {"probability", *WEIGHTS}


def test_a_path_over_bare_ground_is_refused_with_its_place_unless_a_via_point_confirms_it(tmp_path):
    photo = photo_of_light(tmp_path, broken(270, 120))
    with pytest.raises(InputError, match=r"no crack between the ends: from \(\d+, .*hardly darker .*via_px"):
        find_path(photo, ENDS)
    path = find_path(photo, ENDS, via_px=(WAVE[10],))
    assert path.doubtful
    assert "hardly darker than the ground" in path.warnings[0].text


def test_a_light_line_beside_a_clear_path_gives_a_caution_by_itself(tmp_path):
    """The crack is the light line, and the path its shade, which is as clear as a crack."""
    shaded = light_line(light_line(with_crack(mortar(), [(x, y + 5) for x, y in WAVE], 3), 6), 6)
    path = path_in(tmp_path, shaded)
    assert path.verdict["probability"] > DOUBTED
    (doubt,) = path.warnings
    assert "times as bright as the ground" in doubt.text


def test_a_short_way_over_the_ground_between_two_legs_of_a_crack_is_doubted(tmp_path):
    """The legs are 8 px wide and 40 px apart, and both clicks are in legs."""
    legs = [(60, 130), (380, 130), (420, 150), (380, 170), (60, 170)]
    (doubt,) = path_in(tmp_path, with_crack(mortar(), legs, 8), ((60.0, 130.0), (60.0, 170.0))).warnings
    assert doubt.key == "path.doubtful"


@pytest.mark.parametrize("width_px", [6, 16])
def test_the_message_for_a_light_crack_without_a_shade_advises_painting_a_mask(tmp_path, width_px):
    """The darkest way between the clicks is a rim of the light line, or bare ground beside it."""
    try:
        answer = " ".join(texts(path_in(tmp_path, light_line(mortar(seed=2), width_px)).warnings))
    except InputError as refusal:
        answer = str(refusal)
    assert "light crust, paint it in photo.mask" in answer


def test_a_path_along_two_joints_has_no_width_until_a_via_point_confirms_the_leg_that_the_caution_names(tmp_path):
    tiled = with_crack(with_crack(mortar(), [(60, -10), (60, 310)], 4), [(-10, 200), (510, 200)], 4)
    photo, ends_px = photo_of_light(tmp_path, tiled), ((60.0, 40.0), (430.0, 200.0))

    def traced(*via_px, **settings):
        path = find_path(photo, ends_px, via_px)
        assert path.doubtful == bool(path.warnings)
        return path, trace_outline(photo, path, how_traced(**settings))

    for elsewhere in ((), ((60.0, 100.0),)):
        path, outline = traced(*elsewhere)
        assert "as straight as a joint" in path.warnings[0].text
        assert outline.width_source == "none"
    path, outline = traced((250.0, 200.0))
    assert (path.warnings, outline.width_source) == ((), "fit")
    assert traced(width_mm=0.4)[1].width_source == "gauge"


def test_a_line_chosen_by_its_number_is_confirmed(tmp_path):
    photo = photo_of_light(
        tmp_path, light_line(light_line(with_crack(mortar(), [(x, y + 5) for x, y in WAVE], 3), 6), 6)
    )
    assert find_path(photo, ENDS).doubtful
    assert not find_path(photo, None, crack=1).doubtful


def test_two_clicks_off_a_crack_offer_the_lines_that_may_be_it(tmp_path):
    photo = photo_of_light(tmp_path, broken(270, 120))
    with pytest.raises(
        RivalCracksError, match=r"no crack between the ends.*Check ends_px, or choose a numbered"
    ) as refusal:
        find_path(photo, ENDS)
    offered, searched = refusal.value.cracks, CrackSearch.of(photo).cracks
    assert [len(crack.line_px) for crack in offered] == [len(crack.line_px) for crack in searched]
    assert len(offered) == 2
    # The rests of this crack are too short to be offered.
    with pytest.raises(RivalCracksError, match=r"no crack between the ends.*Check ends_px\.$") as refusal:
        find_path(photo_of_light(tmp_path, broken(330, 90)), ENDS)
    assert not refusal.value.cracks
