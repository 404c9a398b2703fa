"""SPEL+ programs, read back by a parser of the language."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from digitise.robots.robot_path import place_path
from digitise.robots.spel import spel_text
from sealtwin.core.errors import InputError
from tests.support.robot_cells import cell, in_cell, placed, random_paths, trajectory
from tests.support.robot_readers import read_spel

AREA_MM2 = np.pi * 10.0**2
ADDED = {"motion": "move", "dispenser": "s", "output_bit": None, "axis_start_mm": 5.0, "axis_gives": "+"}
ON_Z = {"dispenser": "z", "output_bit": None, "axis_start_mm": -20.0}


@settings(max_examples=15, deadline=None)
@given(it=random_paths(), turn=st.floats(-180, 180), axis=st.sampled_from(["s", "t"]), gives=st.sampled_from("+-"))
def test_spel_moves_follow_the_planned_path_speed_and_plunger_travel(it, turn, axis, gives):
    """Tolerances: three decimals of a position, four of the plunger; 1e-4 mm of a 20 mm syringe is 0.03 mm³."""
    table = {**ADDED, "dispenser": axis, "axis_gives": gives}
    path = place_path(it, cell(turn, spel=table), "cell.toml")
    program = read_spel(spel_text(path))
    along = program.motions[1:-1]
    places = np.array([motion.place for motion in along])
    assert np.abs(places - in_cell(it.position_mm, turn)).max() < 6e-4
    assert [motion.speed for motion in along[1:]] == pytest.approx(it.speed_mm_s[:-1], abs=6e-4)
    # The arm stops at the last waypoint only.
    assert [motion.how for motion in along[1:]] == ["Move CP"] * (len(it.t_s) - 2) + ["Move"]
    gone_mm = np.array([motion.given for motion in along]) - 5.0
    planned_mm = np.concatenate([[0.0], np.cumsum(it.given_mm3)]) / AREA_MM2
    assert gone_mm * (1 if gives == "+" else -1) == pytest.approx(planned_mm, abs=6e-5)
    # The other added axis is left at 0, and above start and end the plunger does not move.
    point = next(iter(program.points.values()))
    assert (point[-1] if axis == "s" else point[-2]) == 0
    assert program.motions[0].given == along[0].given
    assert program.motions[-1].given == along[-1].given


@pytest.mark.parametrize("reverse", [False, True])
def test_a_spel_curve_passes_all_waypoints_over_the_crack_with_the_output_on(reverse):
    it = trajectory(lead_in_mm=10.0, lead_out_mm=6.0, ramp_mm=5.0, reverse=reverse)
    program = read_spel(spel_text(placed(it)))
    crack = it.position_mm[it.giving]
    assert program.curve == (4, 2, 1 + len(crack))
    on_curve = [motion for motion in program.motions if motion.how == "CVMove"]
    assert np.abs(np.array([m.place for m in on_curve]) - in_cell(crack)[1:]).max() < 6e-4
    assert {motion.speed for motion in on_curve} == {4.0}
    assert [motion.how for motion in program.motions[:3]] == ["Move", "Move", "Move CP"]
    # The output is on along the curve only: the leads are dry.
    assert program.switches == [(3, "On 8"), (3 + len(on_curve), "Off 8")]
    ends = program.motions[-2:]
    assert np.array(ends[0].place) == pytest.approx(in_cell(it.position_mm[-1:])[0], abs=6e-4)
    assert np.array(ends[1].place) - ends[0].place == pytest.approx(47.0 * placed(it).frame.normal, abs=2e-3)


@pytest.mark.parametrize("motion", ["curve", "move"])
def test_a_z_axis_that_drives_the_plunger_descends_with_the_dispensed_volume(motion):
    """This is the paper's arm: z begins at the plunger's position, and the nozzle is never lifted."""
    it = trajectory(lead_in_mm=10.0)
    path = placed(it, spel={**ON_Z, "motion": motion}, tip_deg=0.0)
    program = read_spel(spel_text(path))
    places = np.array([motion.place for motion in program.motions])
    assert places[0] == pytest.approx([*in_cell(it.position_mm[:1], tip_deg=0.0)[0, :2], -20.0], abs=6e-4)
    assert places[-1, 2] == pytest.approx(-20.0 - 4800 / AREA_MM2, abs=6e-4)
    assert np.diff(places[:, 2]).max() <= 0
    flown = np.linalg.norm(np.diff(places[-62:, :2], axis=0), axis=1)
    # SpeedS is the speed in space: across the face the nozzle must still move at the planned 4 mm/s.
    step_s = np.linalg.norm(np.diff(places[-62:], axis=0), axis=1) / [m.speed for m in program.motions[-61:]]
    assert flown / step_s == pytest.approx(np.full(61, 4.0), rel=2e-3)


LOW = {"spel": ON_Z, "tip_deg": 0.0, "reach": {"low_mm": (-800.0, -800.0, -10.0)}}


@pytest.mark.parametrize(
    ("path", "changes", "says"),
    [
        ({"spacing_mm": 0.25}, {}, r'the path has \d+ points .* 3 to 200\. Set spel\.motion = "move"'),
        ({"ramp_mm": 5.0}, {}, r'one speed, .* 0\.\d+ to 4 mm/s over the crack\. Set spel.motion = "move"'),
        ({"flow": "cross_section"}, {}, 'one flow, .* Set spel.motion = "move"'),
        ({"flow": "cross_section"}, {"spel": {"motion": "move"}}, "one flow or none, .* axis"),
        ({"speed_mm_s": 0.05}, {}, r"at least 0\.1 mm/s, but the path has 0\.05"),
        ({}, {"spel": {"first_point": 940}}, "65 points from P940 on, .* P999"),
        # The stroke of the plunger on z.
        ({}, LOW, r"25\.3 mm out of the reach box, to .* -35\.3\) mm"),
    ],
)
def test_a_path_beyond_the_limits_of_spel_is_refused(path, changes, says):
    with pytest.raises(InputError, match="cell.toml: .*" + says):
        spel_text(placed(trajectory(**path), **changes))


@pytest.mark.parametrize("motion", ["curve", "move"])
def test_the_arms_speed_limit_includes_plunger_travel_on_the_z_axis(motion):
    """The plunger moves 15.3 mm over 62 mm of path, so that the arm is 3 % faster than the nozzle."""
    fast, limit = trajectory(speed_mm_s=30.0), {"motion": {"largest_speed_mm_s": 30.0}, "tip_deg": 0.0}
    assert spel_text(placed(fast, **limit))
    with pytest.raises(InputError, match=r"the arm.* 30\.9\d? mm/s, but motion.largest_speed_mm_s allows at most 30\."):
        spel_text(placed(fast, spel={**ON_Z, "motion": motion}, **limit))
