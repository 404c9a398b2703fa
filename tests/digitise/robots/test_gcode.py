"""G-code, read back by a reader of the language."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from digitise.robots.programs import gcode_text
from digitise.robots.robot_path import place_path
from sealtwin.core.errors import InputError
from tests.support.robot_cells import cell, in_cell, placed, random_paths
from tests.support.robot_readers import read_gcode

AREA_MM2 = np.pi * 10.0**2


@settings(max_examples=15, deadline=None)
@given(it=random_paths(), turn=st.floats(-180, 180))
def test_a_gantry_goes_where_and_gives_what_was_planned(it, turn):
    """Four decimals of a place; E to 1e-5 mm, 3e-3 mm³ of a 20 mm syringe."""
    path = place_path(it, cell(turn), "cell.toml")
    motions = read_gcode(gcode_text(path))
    along = motions[2:-1]
    assert len(along) == len(it.t_s)
    places = np.array([motion.place for motion in along])
    assert np.abs(places - in_cell(it.position_mm, turn)).max() < 6e-5
    assert [motion.speed for motion in along[1:]] == pytest.approx(it.speed_mm_s[:-1], abs=1e-5)
    given_mm3 = AREA_MM2 * np.array([motion.given for motion in along])
    assert given_mm3[1:] == pytest.approx(it.given_mm3, abs=1.1e-5 * AREA_MM2)
    assert given_mm3.sum() == pytest.approx(600.0, abs=0.6e-5 * AREA_MM2)
    # Half a thousandth of a second of a minute's feed, and four decimals of each step.
    took_s = np.linalg.norm(np.diff(places, axis=0), axis=1) / [motion.speed for motion in along[1:]]
    assert took_s.sum() == pytest.approx(it.duration_s, rel=1e-3)


def test_the_nozzle_comes_from_above_and_leaves_upward_giving_nothing():
    path = placed()
    motions = read_gcode(gcode_text(path))
    for over, tip in ((motions[1], motions[2]), (motions[-1], motions[-2])):
        lift = np.array(over.place) - tip.place
        # 50 mm above the face, 47 above the tip, square to the face.
        assert lift == pytest.approx(47.0 * path.frame.normal, abs=2e-4)
        assert over.given == 0
        assert over.speed == 20.0
    # Up before across.
    assert motions[0].place[:2] == (0, 0)
    assert motions[0].place[2] == motions[1].place[2]


def test_what_the_cell_asks_for_stands_before_the_first_move():
    plain, cold = (gcode_text(placed(gcode={"cold_extrusion": on})) for on in (False, True))
    assert "M302" not in plain
    assert cold.index("M302 P1") < cold.index("G1 ")


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"plunger": {"travel_mm": 15.2}}, r"cell.toml: the path needs 15\.3 mm .*; plunger.travel_mm allows 15\.2"),
        ({"plunger": {"largest_speed_mm_s": 0.9}}, r"0\.999 mm/s of the plunger; plunger.largest_speed_mm_s allows 0"),
        ({"tip_deg": 6.0}, r"the face is tilted by 6\.0 degrees.* motion.largest_tilt_deg allows 5"),
        (
            {"reach": {"high_mm": (800.0, 800.0, 120.0)}},
            r"leads 1\d\.\d mm out of the reach box, .* 13\d\.\d\) mm",
        ),
    ],
)
def test_what_a_gantry_cannot_do_is_refused(changes, says):
    with pytest.raises(InputError, match=says):
        gcode_text(placed(**changes))
