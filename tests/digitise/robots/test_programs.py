"""G-code and URScript programs, read back by parsers of these languages."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from digitise.robots.programs import gcode_text, urscript_text
from digitise.robots.robot_path import place_path
from sealtwin.core.errors import InputError
from tests.support.robot_cells import cell, in_cell, placed, random_paths, trajectory
from tests.support.robot_readers import read_gcode, read_urscript

AREA_MM2 = np.pi * 10.0**2
HIGH = {"reach": {"high_mm": (800.0, 800.0, 120.0)}}


@settings(max_examples=15, deadline=None)
@given(it=random_paths(), turn=st.floats(-180, 180))
def test_a_gcode_program_follows_the_planned_path_speed_and_volume(it, turn):
    """Tolerances: four decimals of a position, and 1e-5 mm of E, which is 3e-3 mm³ of a 20 mm syringe."""
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
    # Tolerance: the decimals of the feed rate, and the four decimals of each step.
    took_s = np.linalg.norm(np.diff(places, axis=0), axis=1) / [motion.speed for motion in along[1:]]
    assert took_s.sum() == pytest.approx(it.duration_s, rel=1e-3)


def test_the_nozzle_descends_and_rises_square_to_the_face_without_flow():
    path = placed()
    motions = read_gcode(gcode_text(path))
    for over, tip in ((motions[1], motions[2]), (motions[-1], motions[-2])):
        # 50 mm above the face, 47 above the tip, square to the face.
        assert np.array(over.place) - tip.place == pytest.approx(47.0 * path.frame.normal, abs=2e-4)
        assert (over.given, over.speed) == (0, 20.0)
    # The nozzle rises before it moves sideways.
    assert motions[0].place == (0, 0, motions[1].place[2])


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"plunger": {"travel_mm": 15.2}},
            r"cell.toml: the path needs 15\.3 mm .* plunger.travel_mm allows at most 15\.2",
        ),
        ({"plunger": {"largest_speed_mm_s": 0.9}}, r"0\.999 mm/s, but plunger.largest_speed_mm_s allows at most 0"),
        ({"tip_deg": 6.0}, r"6\.0 degrees.* motion.largest_tilt_deg allows at most 5"),
        (HIGH, r"1\d\.\d mm out of the reach box, .* 13\d\.\d\) mm"),
    ],
)
def test_a_path_beyond_the_limits_of_a_gantry_is_refused(changes, says):
    with pytest.raises(InputError, match=says):
        gcode_text(placed(**changes))


DIGITAL = {"dispenser": "digital", "port": 3, "full_flow_mm3_s": None}


@settings(max_examples=15, deadline=None)
@given(it=random_paths(), turn=st.floats(-180, 180))
def test_a_urscript_program_follows_the_planned_path_speed_and_flow(it, turn):
    """Tolerances: metres have seven decimals, 1e-4 mm; output levels have five, 0.02 mm³/s of 4000."""
    path = place_path(it, cell(turn, urscript={"blend_mm": 0.05}), "cell.toml")
    script = read_urscript(urscript_text(path))
    assert [motion.how for motion in script.motions] == ["movej", "movel", *["movep"] * (len(it.t_s) - 1), "movel"]
    along = script.motions[1:-1]
    places = np.array([motion.place for motion in along])
    assert np.abs(places - in_cell(it.position_mm, turn)).max() < 6e-5
    assert [motion.speed for motion in along[1:]] == pytest.approx(it.speed_mm_s[:-1], abs=6e-5)
    took_s = np.linalg.norm(np.diff(places, axis=0), axis=1) / [motion.speed for motion in along[1:]]
    flow_mm3_s = 4000 * np.array([motion.given for motion in along[1:]])
    assert flow_mm3_s == pytest.approx(it.flow_mm3_s[:-1], abs=0.021)
    # Tolerance: 1e-4 mm of a step of 0.5 mm.
    assert flow_mm3_s @ took_s == pytest.approx(600.0, rel=5e-4, abs=0.021 * it.duration_s)
    # The arm rounds every waypoint but the last, where it stops with the dispenser off.
    assert [motion.blend for motion in along[1:]] == pytest.approx([0.05] * (len(along) - 2) + [0.0])
    assert script.motions[0].given == script.motions[1].given == script.motions[-1].given == script.level_at_end == 0


def test_an_arm_descends_and_rises_slowly_and_square_to_the_face():
    path = placed()
    script = read_urscript(urscript_text(path))
    for over, tip in ((script.motions[0], script.motions[1]), (script.motions[-1], script.motions[-2])):
        assert np.array(over.place) - tip.place == pytest.approx(47.0 * path.frame.normal, abs=2e-4)
    assert script.motions[1].speed == script.motions[-1].speed == 20.0
    assert script.accelerations == {2000.0}


@pytest.mark.parametrize("turn_deg", [0.0, -35.0])
def test_the_tool_points_into_the_face_with_the_set_rotation(turn_deg):
    """The tool's z is opposite to the face's normal; its x is the robot's x in the face, turned about the nozzle."""
    path = placed(tip_deg=4.0, urscript={"tool_turn_deg": turn_deg})
    (rotation,) = read_urscript(urscript_text(path)).rotations
    axes = Rotation.from_rotvec(rotation).as_matrix()
    # Tolerance: six decimals of a radian.
    assert axes[:, 2] == pytest.approx(-path.frame.normal, abs=2e-6)
    x = np.array([1.0, 0, 0]) - path.frame.normal[0] * path.frame.normal
    x /= np.linalg.norm(x)
    seen_deg = np.degrees(np.arctan2(np.cross(x, axes[:, 0]) @ axes[:, 2], x @ axes[:, 0]))
    assert seen_deg == pytest.approx(turn_deg, abs=1e-3)


def test_a_digital_output_is_on_only_during_motions_with_flow():
    planned = trajectory(lead_in_mm=8.0, lead_out_mm=5.0)
    script = read_urscript(urscript_text(placed(planned, urscript=DIGITAL)))
    assert script.outputs == {("set_standard_digital_out", 3)}
    levels = np.array([motion.given for motion in script.motions[2:-1]])
    assert (levels > 0).tolist() == (planned.flow_mm3_s[:-1] > 0).tolist()


@pytest.mark.parametrize(
    ("path", "changes", "says"),
    [
        ({}, {"urscript": {"blend_mm": 0.5}}, r"blend_mm is 0\.5, .*0\.98\d+ mm.* than 0\.49"),
        ({"ramp_mm": 5.0}, {"urscript": DIGITAL}, r"one flow or none, .* to 31\d\.\d mm³/s"),
        ({}, {"urscript": {"full_flow_mm3_s": 300.0}}, r"313\.9 mm³/s, .* urscript.full_flow_mm3_s = 300"),
        # The approach over the sample.
        ({}, HIGH, r"the way to the path or from it leads 1\d\.\d mm out of the reach box"),
    ],
)
def test_a_path_beyond_the_limits_of_an_arm_or_dispenser_is_refused(path, changes, says):
    with pytest.raises(InputError, match="cell.toml: .*" + says):
        urscript_text(placed(trajectory(**path), **changes))
