"""What a report takes for granted of sample and run: said, with numbers, and never invented."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.facts import of_keys, texts
from sealtwin.core.run_figures import RunHealth
from tests.support.small_fluids import path, pour, slot
from validate.compare import assess
from validate.report.chapters import path_table, settings_table
from validate.report.first_page import first_page
from validate.report.report_facts import HEALTH_LABELS, assumptions, walls
from validate.settings import Readings, Uncertainty


def with_settings(evidence, **groups):
    """The same evidence of a run with more settings in these groups."""
    settings = evidence.run.settings
    changed = {name: settings.get(name, {}) | more for name, more in groups.items()}
    return replace(evidence, run=replace(evidence.run, settings=settings | changed))


def left_out(evidence):
    return of_keys(assumptions(evidence), "left-out")


def assumed(evidence, **groups) -> str:
    return " ".join(texts(assumptions(with_settings(evidence, **groups))))


def test_reynolds_and_bond_numbers_are_those_that_the_run_recorded(evidence):
    health = RunHealth(bond=2.24, reynolds=0.031, bingham=7.1)
    (fact,) = of_keys(
        assumptions(replace(evidence, run=replace(evidence.run, health=health))), "assumed.surface-tension"
    )
    assert fact.value == 2.24
    assert [number for number in ("2.2 ", "0.031 ", "7.1 ") if number not in fact.text] == []
    bare = replace(evidence, run=replace(evidence.run, health=RunHealth()))
    assert "records no Bond number" in assumed(bare)


@pytest.mark.parametrize(
    ("tilt", "words"),
    [
        ("flare", "the solid's mouth, 7.0 mm, is wider than the crack in the photo, 3.1 mm"),
        ("undercut", "the floor, 7.0 mm wide, extends under the face on both sides of the mouth, 3.1 mm"),
    ],
)
def test_the_other_width_of_a_tilted_crack_is_told_beside_that_in_the_photo(evidence, tilt, words):
    """By hand: 3.1 mm and twice 10 mm times the tangent of 11 degrees are 6.99 mm."""
    assert walls(evidence) == ""
    solid = build_solid(evidence.outline, CrackShape(depth_mm=10.0, tilt=tilt, wall_angle_deg=11.0))
    assert words in walls(replace(evidence, solid=solid))


def test_paste_that_yields_is_told_with_its_stress_and_its_number(evidence):
    """Curing is then modelled, and only shrinkage is not."""
    assert "Bingham" not in assumed(evidence)
    words = assumed(evidence, fluid={"yield_stress_pa": 12.0, "structuration_pa_per_s": 0.5})
    assert "yield stress of 12 Pa, and 0.5 Pa more each second" in words
    assert "Shrinkage is not modelled" in words
    assert "Curing" not in words


def test_a_paste_without_a_stated_uncertainty_has_no_interval(evidence):
    """As of a calibration that left the yield stress alone. Broken on purpose, it is known to 95 % from 10 to 10."""
    paste = {"method": "calibration", "date": "2026-11-25", "data": "measured", "not_for": ("a warm day",)}
    paste |= {"yield_stress_pa": 10.0, "yield_stress_error_pa": 0.0, "yield_stress_95_pa": (10.0, 10.0)}
    words = assumed(evidence, fluid={"material": paste})
    assert "yield stress is 10 Pa (uncertainty not stated), with the method calibration" in words
    assert "10 to 10" not in words


def test_a_paste_that_thins_is_described_by_its_law(evidence):
    paste = {"method": "curve", "date": "2026-11-25", "data": "measured", "not_for": ("a warm day",)}
    paste |= {"yield_stress_pa": 10.0, "yield_stress_error_pa": 1.0, "yield_stress_95_pa": (8.0, 12.0)}
    paste |= {"consistency_pa_s_n": 3.0, "flow_index": 0.5, "flow_index_95": (0.45, 0.56), "doubts": ["6 rows."]}
    fluid = {"material": paste, "flow_index": 0.5}
    assert ("Paste:", "6 rows.") in first_page(with_settings(evidence, fluid=fluid)).notes
    words = assumed(evidence, fluid=fluid)
    assert "6 rows." in words
    assert "3 Pa times the power 0.5 (0.45 to 0.56, which no budget includes)" in words


def test_a_sample_that_slopes_is_told_with_both_angles_and_a_level_one_is_not(evidence):
    assert "slopes" not in assumed(evidence)
    sloping = {"crossfall_deg": -2.5, "gradient_deg": 5.0}
    assert "rises towards +x by 5° and towards +y by -2.5°" in assumed(evidence, sample=sloping)
    rows = dict(settings_table(with_settings(evidence, sample=sloping).run.settings).rows)
    assert rows["sample"] == "crossfall (°) -2.5, gradient (°) 5"


def test_sealant_with_a_table_is_told_with_its_ends_and_its_columns_are_not_listed(evidence):
    table = {"age_s": [0.0, 60.0, 600.0], "temperature_c": None, "viscosity_pa_s": [0.05, 1.0, 30.0]}
    ageing = {"curve": table | {"yield_stress_pa": [0.0, 5.0, 40.0]}, "cooling": None}
    words = assumed(evidence, fluid=ageing)
    assert "its age since it left the nozzle, 0.05 to 30 Pa s, its yield stress (Bingham) 0 to 40 Pa" in words
    assert "Shrinkage is not modelled" in words
    rows = dict(settings_table(with_settings(evidence, fluid=ageing).run.settings).rows)
    assert "curve age (s) 0, 60, 600, viscosity (Pa s) 0.05, 1, 30, " in rows["fluid"]
    assert "temperature" not in rows["fluid"]
    assert "cooling" not in rows["fluid"]
    hot = {"temperature_c": [100.0, 200.0], "viscosity_pa_s": [30.0, 0.05]}
    cooling = {"age_s": [0.0, 60.0], "temperature_c": [190.0, 120.0]}
    words = assumed(evidence, fluid={"curve": hot, "cooling": cooling})
    assert "over its temperature, 0.05 to 30 Pa s; between" in words
    assert "from 190 to 120 °C" in words


def test_what_counts_in_no_metric_is_told_by_its_number(evidence):
    """Seen to fail with the stations counted from the comparison alone."""
    assert left_out(evidence)[0].text.startswith("1 particle (1 mm³) ran over the edge of the sample")
    repeats_mm = np.array(evidence.readings.repeats_mm)
    repeats_mm[0, :2] = np.nan
    fewer = evidence.comparison.basis.model_copy(update={"stations_beyond_mm": np.array([38.0, 40.5])})
    outline = replace(evidence.outline, branches_mm=(np.zeros((2, 2)),))
    readings = replace(evidence.readings, repeats_mm=repeats_mm)
    fewer = evidence.comparison.model_copy(update={"basis": fewer})
    first, second, _, last = texts(left_out(replace(evidence, readings=readings, comparison=fewer, outline=outline)))
    assert "2 stations of 9 (s = 38, 40.5 mm) beyond the stretch that both curves cover, 0.0 to 40.0" in first
    assert "2 single readings" in second
    assert "1 side crack" in last
    run = replace(evidence.run, spilled=np.zeros(len(evidence.run.spilled), dtype=bool))
    assert [fact.key for fact in left_out(replace(evidence, run=run))] == ["left-out.nothing"]


def assessed(evidence, **declared):
    how = {"file": Path("a.csv"), "data": "measured", "role": "held-out"} | declared
    return assess(evidence, Readings.model_validate(how), Uncertainty(), None)


@pytest.mark.parametrize(
    ("state", "shrinkage_percent", "words"),
    [
        ("wet", None, "not modelled, and the caliper read wet sealant, which had not shrunk."),
        ("cured", None, "not modelled, while the caliper read cured sealant, whose shrinkage is not declared"),
        ("cured", 7.0, "cured sealant: the mass balance adds its shrinkage of 7 %"),
        (None, None, "whether the caliper read wet or cured sealant is not declared (readings.state)."),
    ],
)
def test_what_was_read_is_as_it_was_declared(evidence, state, shrinkage_percent, words):
    """Seen to fail with every sealant taken for cured."""
    comparison = assessed(evidence, state=state, shrinkage_percent=shrinkage_percent)
    assert words in assumed(replace(evidence, comparison=comparison))
    assert "the caliper" not in assumed(evidence), "not assessed, nothing is known"


def test_a_run_records_nothing_that_the_report_cannot_name():
    """A new number needs a line in HEALTH_LABELS, or the report shows its name in the code."""
    crack = slot(12.0)
    recorded = set(pour(crack, path(crack[1], 0.005, speed_mm_s=40.0), radius_mm=0.7).health.recorded())
    assert {"density_error_mean", "frame_s", "particles_across"} < recorded
    assert recorded < set(HEALTH_LABELS)


def test_a_path_with_leads_and_ramps_is_told_with_what_varies(evidence):
    leads = {"lead_in_mm": 30.0, "lead_out_mm": 4.0, "ramp_mm": 10.0, "reverse": True}
    plan = NozzlePath.model_validate({"volume_ml": 1.2, "trim_mm": 5.0} | leads)
    table = dict(path_table(replace(evidence, trajectory=plan_trajectory(evidence.outline, plan, 1.0))).rows)
    assert table["sealant flows from, to"] == "s = 35.0 to 5.0 mm"
    assert table["length without sealant before, after"] == "30.0 mm, 4.0 mm"
    # The first millimetre of a ramp of 10 mm takes 2 sqrt(10) / 4 s.
    assert table["speed"] == "0.63 to 4.00 mm/s"
