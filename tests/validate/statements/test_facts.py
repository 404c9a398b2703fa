"""What a report says: every number with its unit, nothing claimed that was not measured."""

import re
from dataclasses import replace

import numpy as np
import pytest

from digitise.path_report import path_report
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.records import Comparison, Sections
from tests.evidence import make_evidence
from validate.evidence import Evidence
from validate.reporting.plates import solid_plate
from validate.settings import Gate
from validate.statements import facts
from validate.statements.assumptions import assumptions
from validate.statements.facts import Table, headline, key_figures

GATE = Gate(mean_error_mm=1.0)


def rows(evidence: Evidence, title: str) -> dict[str, str]:
    return dict(next(table.rows for table in tables(evidence) if table.title == title))


def tables(evidence: Evidence) -> list[Table]:
    compared = [] if evidence.comparison is None else [facts.agreement(evidence), facts.readings(evidence)]
    alone = (facts.mass_balance, facts.health, facts.geometry, facts.nozzle_path, facts.settings_in_effect)
    return [*compared, *(table(evidence) for table in alone)]


@pytest.mark.parametrize(
    ("gate", "error_mm", "outcome"), [(GATE, 0.5, "passed"), (GATE, 1.5, "failed"), (None, 1, "open")]
)
def test_the_headline_is_the_verdict(tmp_path, gate, error_mm, outcome):
    evidence = make_evidence(tmp_path, gate=gate, error_mm=error_mm)
    comparison = evidence.comparison
    assert isinstance(comparison, Comparison)
    assert headline(evidence) == (comparison.verdict, outcome)


def test_without_readings_nothing_is_compared(tmp_path):
    evidence = make_evidence(tmp_path, readings_data=None)
    assert headline(evidence)[1] == "open"
    assert "mean error" not in dict(key_figures(evidence))
    assert "Agreement with the readings" not in [table.title for table in tables(evidence)]


def test_a_leak_without_readings_is_the_headline(tmp_path):
    evidence = make_evidence(tmp_path, readings_data=None)
    leaking = replace(evidence, run=replace(evidence.run, escaped_particles=2))
    assert headline(leaking) == ("Do not use: 2 particles went through a wall. There are no readings.", "failed")


def test_one_particle_is_no_plural(tmp_path):
    spilled = rows(make_evidence(tmp_path), "Where the sealant is")["spilled over the sample's edge"]
    assert spilled.endswith(", 1 particle")


def test_every_particle_is_somewhere(tmp_path):
    evidence = make_evidence(tmp_path)
    count = {
        name: int(re.findall(r"([\d,]+) particle", text)[0].replace(",", ""))
        for name, text in rows(evidence, "Where the sealant is").items()
        if "particle" in text
    }
    parts = [number for name, number in count.items() if name.startswith(("in the crack", "above the face", "spilled"))]
    assert count["spilled over the sample's edge"] == 1
    assert sum(parts) == count["dispensed"] == len(evidence.run.position_mm)


def test_a_path_with_leads_and_ramps_is_told_with_what_varies(tmp_path):
    """Its flow is that of the time in which sealant flows: a lead of any length must not dilute it."""
    evidence = make_evidence(tmp_path)
    plain, led = (
        replace(
            evidence,
            trajectory=plan_trajectory(
                evidence.outline, NozzlePath.model_validate({"volume_ml": 1.2, "trim_mm": 5.0} | more), 1.0
            ),
        )
        for more in ({}, {"lead_in_mm": 30.0, "lead_out_mm": 4.0, "ramp_mm": 10.0, "reverse": True})
    )
    table = rows(led, "Nozzle path")
    assert table["gives sealant from, to"] == "s = 35.0 to 5.0 mm"
    assert table["without sealant before, after"] == "30.0 mm, 4.0 mm"
    # The first millimetre of a ramp of 10 mm takes 2 sqrt(10) / 4 s.
    assert table["speed"] == "0.63 to 4.00 mm/s"
    nozzle = [next(text for text in assumptions(each) if text.startswith("Surface tension")) for each in (plain, led)]
    speeds = [float(re.search(r"\((\d+) mm/s", text)[1]) for text in nozzle]  # pyright: ignore[reportOptionalSubscript]
    # 1.2 ml in 7.5 s; slowed by the end of one ramp, it is less, but not the half that the leads would make of it.
    assert 0.8 * speeds[0] < speeds[1] <= speeds[0]


def test_two_angles_and_a_table_of_depths_are_told_as_two_and_as_a_range(tmp_path):
    evidence = make_evidence(tmp_path)
    sections = Sections(np.array([0.0, 40.0]), np.array([10.0, 4.0]), np.array([1.0, 1.0]))
    odd = replace(evidence.solid, tilt="flare", wall_angles_deg=(5.0, 12.5), sections=sections)
    table = rows(replace(evidence, solid=odd), "Crack and solid")
    assert table["depth"] == "4 to 10 mm, from station to station"
    assert table["tilt"] == "flare, left wall 5°, right wall 12.5° from vertical"
    even = rows(evidence, "Crack and solid")
    assert (even["depth"], even["tilt"]) == ("10 mm", "vertical walls")


def test_a_path_s_length_is_told_with_its_smoothing(tmp_path):
    evidence = make_evidence(tmp_path)
    assert "length over the crack" not in rows(evidence, "Nozzle path")
    plan = NozzlePath(volume_ml=1.2, trim_mm=5.0)
    evidence.solid.report["path"] = path_report(evidence.trajectory, evidence.outline, plan)[0]
    told = rows(evidence, "Nozzle path")["length over the crack"]
    assert told == "30.00 mm, smoothed within 0.1 mm RMS of the centreline's 30.00 mm; turns by up to 0.0°"
    evidence.solid.report["path"]["smallest_radius_mm"] = 12.34
    assert rows(evidence, "Nozzle path")["length over the crack"].endswith("0.0°, smallest radius 12.3 mm")


def test_each_reading_of_the_tilt_has_its_volume(tmp_path):
    solid = rows(make_evidence(tmp_path), "Crack and solid")
    assert solid["tilt"] == "vertical walls"
    assert solid["cavity over sealant"]
    volumes = next(text for name, text in solid.items() if name.startswith("volume by reading"))
    assert all(tilt in volumes for tilt in ("lean", "flare", "funnel", "vertical"))


def test_dams_are_told_from_the_sample(tmp_path):
    """Whoever prints crack.stl prints them too."""
    evidence = make_evidence(tmp_path)
    assert "in crack.stl beside the sample" not in rows(evidence, "Crack and solid")
    report = {**evidence.solid.report, "dams": [{"end": 0, "box_mm": [0.0, -4.0, -20.0, 9.0, 0.0, 10.0]}]}
    dammed = replace(evidence, solid=replace(evidence.solid, report=report))
    row = rows(dammed, "Crack and solid")["in crack.stl beside the sample"]
    assert row == "1 dam at open ends, to 10 mm above the face: no part of the sample"
    captions = [solid_plate(which).caption for which in (evidence, dammed)]
    assert ["dams" in caption for caption in captions] == [False, True]


def test_widths_that_vary_along_the_crack_are_called_means(tmp_path):
    solid = rows(make_evidence(tmp_path), "Crack and solid")
    assert {name for name in solid if "width" in name} == {
        "width in the photo, mean",
        "mean width of the mouth, of the floor",
    }


def test_both_areas_stand_side_by_side(tmp_path):
    agreement = rows(make_evidence(tmp_path, error_mm=0.5), "Agreement with the readings")
    assert agreement["area between the curves, exact"] == "20.0000 mm²"
    assert agreement["area by similaritymeasures"].startswith("20.0000 mm²")
    assert agreement["mean error = area / covered length"] == "0.500 mm"
    assert "beats it" in agreement["best flat level, as a baseline"]


def test_units_follow_from_the_names(tmp_path):
    health = rows(make_evidence(tmp_path), "Numerical health")
    assert health["simulated time of a frame"] == "7.14 ms"
    assert health["kinematic viscosity in effect"] == "32.6 mm²/s"
    assert health["compression above the rest density, mean"] == "2.00 %"
    assert rows(make_evidence(tmp_path), "Settings in effect")["fluid: density (kg/m³)"] == "1690"


def test_a_report_says_how_the_sheet_was_understood(tmp_path):
    """A comma taken for thousands, or a depth for a level, is seen here first."""
    evidence = make_evidence(tmp_path)
    assert evidence.readings is not None
    assert "read as" not in rows(evidence, "Readings")
    told = replace(evidence, readings=replace(evidence.readings, dialect="CSV, decimal comma; depth downward in cm"))
    assert rows(told, "Readings")["read as"] == "CSV, decimal comma; depth downward in cm"
