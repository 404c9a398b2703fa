"""What is said of a path's smoothing, against lines and arcs whose lengths, turns and radii are known."""

from typing import Any

import numpy as np
import pytest

from digitise.settings import NozzlePath
from digitise.trajectory import path_report, plan_trajectory
from sealtwin.core.facts import Fact, texts
from sealtwin.core.records import Outline, Sections
from sealtwin.core.solid_figures import PathFigures
from tests.support.shapes import arc_slot, dog_leg, straight_slot, wandering_crack


def reported(outline: Outline, cavity: Sections | None = None, **changes: Any) -> tuple[PathFigures, tuple[Fact, ...]]:
    path = NozzlePath.model_validate({"volume_ml": 4.8} | changes)
    return path_report(plan_trajectory(outline, path, 1.0, cavity), outline, path)


def test_an_arc_has_its_radius_and_turns_by_a_step_of_it():
    """Unsmoothed: 1 mm steps of a circle of 60 mm turn by 1/60; the chord is shorter than the arc by 1e-5 of it."""
    report, warnings = reported(arc_slot(60.0), smoothing_mm=0.0)
    # The centreline's own chords of 0.25 mm are 1e-6 of the radius inside it, and turn the waypoints by that.
    assert report.smallest_radius_mm == pytest.approx(60.0, rel=5e-3)
    assert report.largest_turn_deg == pytest.approx(np.degrees(1 / 60), rel=0.02)
    assert report.length_mm == pytest.approx(report.centreline_mm, rel=2e-5)
    assert warnings == ()


def test_leads_change_no_figure_of_the_crack():
    plain, _ = reported(wandering_crack(1))
    led, _ = reported(wandering_crack(1), lead_in_mm=30.0, lead_out_mm=9.0)
    for name in ("length_mm", "centreline_mm", "off_centreline_rms_mm", "largest_turn_deg", "smallest_radius_mm"):
        assert getattr(led, name) == pytest.approx(getattr(plain, name))
    assert led.sealant_mm3_per_mm == pytest.approx(plain.sealant_mm3_per_mm)
    assert led.starts_at_s_mm == pytest.approx(-20.0)
    assert led.waypoints == plain.waypoints + 39


def test_the_doses_of_a_varying_section_and_the_speeds_of_a_ramp_are_told():
    sections = Sections(np.array([0.0, 80.0]), np.array([4.0, 16.0]), np.array([10.0, 50.0]))
    report, _ = reported(straight_slot(80.0), sections, flow="cross_section", ramp_mm=10.0, reverse=True)
    # 4800 mm³ over 1800 of section: (10 + 10.5 / 2) and (10 + 69.5 / 2) of it a millimetre.
    assert report.sealant_mm3_per_mm == pytest.approx((4800 / 1800 * 15.25, 4800 / 1800 * 44.75))
    assert report.speed_mm_s == pytest.approx((4 / (2 * np.sqrt(10)), 4.0))
    assert (report.starts_at_s_mm, report.ends_at_s_mm) == pytest.approx((70.0, 10.0))


def test_a_sharp_turn_and_a_path_beside_the_crack_are_remarked_on():
    _, (turn,) = reported(dog_leg(40.0), smoothing_mm=0.0, spacing_mm=5.0)
    assert "turns by 40 degrees at s = 40.0 mm" in turn.text
    assert reported(dog_leg(15.0), smoothing_mm=0.0, spacing_mm=5.0)[1] == ()
    _, warnings = reported(dog_leg(60.0), smoothing_mm=2.0)
    assert any("smoothing takes the nozzle" in text and "3.00 mm wide" in text for text in texts(warnings))
