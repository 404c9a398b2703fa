"""The nozzle's path on lines and arcs, its flow, its volume, and its figures."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from digitise.settings import NozzlePath
from digitise.trajectory import begun_late, path_report, plan_trajectory
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, texts
from sealtwin.core.records import Outline, Sections, Trajectory
from sealtwin.core.solid_figures import PathFigures
from tests.support.shapes import arc_slot, cut_crack, dog_leg, straight_slot

TAPERING = Sections(s_mm=np.array([0.0, 80.0]), depth_mm=np.array([4.0, 16.0]), area_mm2=np.array([10.0, 50.0]))
"""A crack of 80 mm whose section at s is 10 + s / 2 mm²."""


def planned(outline: Outline, sections: Sections | None = None, **changes: Any) -> Trajectory:
    return plan_trajectory(outline, NozzlePath.model_validate({"volume_ml": 4.8} | changes), 1.0, sections)


def reported(
    outline: Outline, sections: Sections | None = None, **changes: Any
) -> tuple[PathFigures, tuple[Fact, ...]]:
    path = NozzlePath.model_validate({"volume_ml": 4.8} | changes)
    return path_report(plan_trajectory(outline, path, 1.0, sections), outline, path)


def turns_deg(path: Trajectory) -> np.ndarray:
    step = np.diff(path.position_mm[:, :2], axis=0)
    return np.degrees(np.abs(np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0])))))


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 50),
    trims=st.tuples(st.floats(0, 15), st.floats(0, 15)),
    ramp=st.floats(0, 4),
    leads=st.tuples(st.sampled_from([0.0, 0.4, 12.0]), st.sampled_from([0.0, 3.0])),
    reverse=st.booleans(),
    options=st.fixed_dictionaries(
        {
            "volume_ml": st.floats(0.01, 900),
            "speed_mm_s": st.floats(0.1, 100),
            "spacing_mm": st.floats(0.1, 7),
            "flow": st.sampled_from(["constant", "cross_section"]),
        }
    ),
)
def test_any_path_dispenses_exactly_the_planned_volume(seed, trims, ramp, leads, reverse, options):
    """Each row is valid until the next: speed times time is the distance, and flow times time is the volume."""
    outline = cut_crack(seed)
    lead = {"lead_in_mm": leads[0], "lead_out_mm": leads[1], "reverse": reverse}
    ramp_mm = min(ramp, (outline.length_mm - sum(trims)) / 3)
    path = planned(outline, TAPERING, trim_mm=trims, ramp_mm=ramp_mm, **lead, **options)
    assert path.dispensed_mm3 == pytest.approx(options["volume_ml"] * 1000, rel=1e-9)
    way_mm = np.linalg.norm(np.diff(path.position_mm, axis=0), axis=1)
    assert way_mm / np.diff(path.t_s) == pytest.approx(path.speed_mm_s[:-1], rel=1e-9)
    assert path.speed_mm_s.max() <= options["speed_mm_s"] * (1 + 1e-9)
    assert way_mm.max() <= options["spacing_mm"] + 1e-9
    giving = path.giving
    on_crack = way_mm[giving.start : giving.stop - 1]
    # Chords of even arcs: no waypoint is skipped, none doubled.
    assert on_crack.min() > 0.9 * on_crack.max()
    ends = (trims[0], outline.length_mm - trims[1])
    first, last = reversed(ends) if reverse else ends
    assert path.s_mm[giving][[0, -1]] == pytest.approx([first, last], abs=1e-9)
    onward = -1 if reverse else 1
    assert path.s_mm[[0, -1]] == pytest.approx([first - onward * leads[0], last + onward * leads[1]], abs=1e-9)


@pytest.mark.parametrize("reverse", [False, True])
def test_lead_in_and_lead_out_are_straight_tangents_without_flow(reverse):
    """On an arc of 60 mm radius about the origin a tangent is square to the radius; s runs on below 0."""
    path = planned(arc_slot(60.0), trim_mm=2.0, lead_in_mm=7.5, lead_out_mm=4.0, reverse=reverse)
    giving = path.giving
    lead_in, lead_out = path.position_mm[: giving.start + 1, :2], path.position_mm[giving.stop - 1 :, :2]
    for lead, length_mm, foot in ((lead_in, 7.5, lead_in[-1]), (lead_out, 4.0, lead_out[0])):
        along = (lead[-1] - lead[0]) / length_mm
        assert np.linalg.norm(along) == pytest.approx(1.0, abs=1e-9)
        # Smoothing by 0.1 mm may turn the very end of an arc by a degree or two.
        assert abs(along @ foot / np.linalg.norm(foot)) < np.sin(np.radians(2))
        assert np.linalg.norm(np.diff(lead, n=2, axis=0), axis=1).max() < 1e-9
    assert turns_deg(path).max() < 2
    assert path.flow_mm3_s[: giving.start].tolist() == [0.0] * 8
    assert path.flow_mm3_s[giving.stop - 1 :].tolist() == [0.0] * 5
    assert path.flow_mm3_s[giving][:-1] == pytest.approx(path.flow_mm3_s[giving][0])


def test_a_late_pump_delays_the_flow_but_not_the_motion():
    """The delay of 2.6 s is 10.4 mm at 4 mm/s. The flow ends at the same point, so that the leads stay dry."""
    prompt = planned(straight_slot(80.0), ramp_mm=10.0, lead_in_mm=12.0, lead_out_mm=5.0)
    late = begun_late(prompt, 2.6)
    t_s = np.linspace(0.0, prompt.duration_s - 1e-6, 500)
    for prompt_mm, late_mm in ((prompt.s_mm, late.s_mm), (prompt.position_mm[:, 0], late.position_mm[:, 0])):
        assert np.interp(t_s, late.t_s, late_mm) == pytest.approx(np.interp(t_s, prompt.t_s, prompt_mm))

    def flow_at(path: Trajectory, t_s: Any) -> Any:
        return np.where(t_s < 0, 0.0, path.flow_mm3_s[np.searchsorted(path.t_s, t_s, side="right") - 1])

    end_s = prompt.t_s[prompt.giving][-1]
    assert np.array_equal(flow_at(late, t_s), np.where(t_s < end_s, flow_at(prompt, t_s - 2.6), 0.0))
    dispensed_mm3 = np.interp(end_s - 2.6, prompt.t_s[1:], prompt.given_mm3.cumsum())
    assert (late.dispensed_mm3, late.duration_s) == (pytest.approx(dispensed_mm3), prompt.duration_s)


@pytest.mark.parametrize(
    ("path", "share"), [({"fill": 0.55}, 0.55), ({"volume_ml": "cavity"}, 0.6), ({"fill": 1.0}, 1.0)]
)
def test_the_set_fraction_of_the_cavitys_volume_is_dispensed(path, share):
    trajectory = plan_trajectory(straight_slot(), NozzlePath.model_validate(path), cavity_volume_mm3=3968.0)
    assert trajectory.dispensed_mm3 == pytest.approx(share * 3968.0, rel=1e-12)


@pytest.mark.parametrize(
    ("length_mm", "changes", "cavity_mm3", "says"),
    [
        (10.5, {}, 0.0, "10.5 mm .* 5 and 5 mm"),
        (20.5, {"trim_mm": (18.0, 2.0)}, 0.0, "18 and 2 mm .* 1 mm"),
        (40.0, {"ramp_mm": 10.5, "trim_mm": 10.0}, 0.0, "ramp_mm is 10.5, .* 20.0 mm.* at most 10, or"),
        (40.0, {"ramp_mm": 15.5, "lead_in_mm": 10.0, "trim_mm": 10.0}, 0.0, "30.0 mm, leads included.* at most 15"),
        (80.0, {"spacing_mm": 0.0105, "lead_in_mm": 500.0, "lead_out_mm": 500.0}, 0.0, "100000 waypoints"),
        # volume_ml has a limit of 1000; "cavity" must not be a way round it.
        (80.0, {"volume_ml": "cavity", "fill": 1.0}, 3.1e7, "31000 ml, and one path may give at most 1000 ml"),
        (80.0, {"volume_ml": "cavity", "fill": 3.0}, 4e5, "fill = 3 of the cavity is 1200 ml"),
    ],
)
def test_paths_with_impossible_lengths_or_volumes_are_refused(length_mm, changes, cavity_mm3, says):
    plan = NozzlePath.model_validate({"volume_ml": 4.8} | changes)
    with pytest.raises(InputError, match=says):
        plan_trajectory(straight_slot(length_mm), plan, cavity_volume_mm3=cavity_mm3)


def test_a_flow_by_cross_section_without_any_cross_section_is_refused():
    empty = Sections(np.array([0.0, 80.0]), np.zeros(2), np.zeros(2))
    with pytest.raises(InputError, match=r'flow is "cross_section", .* between s = 5 and'):
        planned(straight_slot(80.0), empty, flow="cross_section")
    with pytest.raises(ValueError, match="sections is missing"):
        planned(straight_slot(80.0), flow="cross_section")


def test_a_sharp_turn_and_a_path_beside_the_crack_give_a_warning():
    _, (turn,) = reported(dog_leg(40.0), smoothing_mm=0.0, spacing_mm=5.0)
    assert "40 degrees at s = 40.0 mm" in turn.text
    assert reported(dog_leg(15.0), smoothing_mm=0.0, spacing_mm=5.0)[1] == ()
    _, warnings = reported(dog_leg(60.0), smoothing_mm=2.0)
    assert any("smoothing moves the nozzle" in text and "3.00 mm wide" in text for text in texts(warnings))
