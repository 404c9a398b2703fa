"""The assumptions of a report about sample and run, with their numbers."""

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
from validate.intervals import StationErrors
from validate.report.chapters import path_table, settings_table
from validate.report.first_page import first_page
from validate.report.report_facts import HEALTH_LABELS, assumptions, stretches_off, walls
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


def test_reynolds_and_bond_numbers_come_from_the_record_of_the_run(evidence):
    recorded, bare = (
        replace(evidence, run=replace(evidence.run, health=health))
        for health in (RunHealth(bond=2.24, reynolds=0.031, bingham=7.1), RunHealth())
    )
    (fact,) = of_keys(assumptions(recorded), "assumed.surface-tension")
    assert fact.value == 2.24
    assert [number for number in ("2.2 ", "0.031 ", "7.1 ") if number not in fact.text] == []
    assert "records no Bond number" in assumed(bare)


PASTE = {
    "method": "curve",
    "date": "2026-11-25",
    "data": "measured",
    "not_for": ("a warm day",),
    "yield_stress_pa": 10.0,
}
UNSURE = PASTE | {"yield_stress_error_pa": 0.0, "yield_stress_95_pa": (10.0, 10.0)}
THINS = PASTE | {"yield_stress_error_pa": 1.0, "yield_stress_95_pa": (8.0, 12.0), "doubts": ["6 rows."]}
THINS |= {"consistency_pa_s_n": 3.0, "flow_index": 0.5, "flow_index_95": (0.45, 0.56)}
AGEING = {"age_s": [0.0, 60.0, 600.0], "viscosity_pa_s": [0.05, 1.0, 30.0]}
AGEING |= {"yield_stress_pa": [0.0, 5.0, 40.0]}
SLOPES = {"crossfall_deg": -2.5, "gradient_deg": 5.0}


@pytest.mark.parametrize(
    ("groups", "words", "absent"),
    [
        ({}, [], ["Bingham", "slopes"]),
        # Curing is modelled here, but shrinkage is not.
        (
            {"fluid": {"yield_stress_pa": 12.0, "structuration_pa_per_s": 0.5}},
            ["yield stress of 12 Pa, and 0.5 Pa more each second", "Shrinkage is not modelled"],
            ["Curing"],
        ),
        # A yield stress without a stated uncertainty has no interval from 10 to 10.
        ({"fluid": {"material": UNSURE}}, ["is 10 Pa (uncertainty not stated), with the method curve"], ["10 to 10"]),
        (
            {"fluid": {"material": THINS, "flow_index": 0.5}},
            ["6 rows.", "3 Pa times the power 0.5 (0.45 to 0.56, which no budget includes)"],
            [],
        ),
        (
            {"fluid": {"curve": AGEING}},
            ["0.05 to 30 Pa s, its yield stress (Bingham) 0 to 40 Pa", "Shrinkage is not modelled"],
            [],
        ),
    ],
    ids=["plain", "yields", "unsure", "thins", "ageing"],
)
def test_the_assumptions_describe_the_sealant_with_its_numbers(evidence, groups, words, absent):
    text = assumed(evidence, **groups)
    assert [each for each in words if each not in text] + [each for each in absent if each in text] == []


def test_the_table_of_settings_leaves_out_columns_without_values(evidence):
    """Doubts about a paste are on the first page."""
    run = with_settings(evidence, sample=SLOPES, fluid={"curve": AGEING}).run
    rows = dict(settings_table(run.settings).rows)
    assert rows["sample"] == "crossfall (°) -2.5, gradient (°) 5"
    assert "rises towards +x by 5° and towards +y by -2.5°" in assumed(evidence, sample=SLOPES)
    assert "curve age (s) 0, 60, 600, viscosity (Pa s) 0.05, 1, 30, " in rows["fluid"]
    thins = with_settings(evidence, fluid={"material": THINS, "flow_index": 0.5})
    assert ("Paste:", "6 rows.") in first_page(thins).notes


@pytest.mark.parametrize(
    ("tilt", "words"),
    [
        ("flare", "the solid's mouth, 7.0 mm, is wider than the crack in the photo, 3.1 mm"),
        ("undercut", "the floor, 7.0 mm wide, extends under the face on both sides of the mouth, 3.1 mm"),
    ],
)
def test_the_largest_width_of_a_tilted_crack_is_compared_with_the_photo(evidence, tilt, words):
    """It is 3.1 mm plus twice 10 mm times the tangent of 11 degrees, 6.99 mm."""
    assert walls(evidence) == ""
    solid = build_solid(evidence.outline, CrackShape(depth_mm=10.0, tilt=tilt, wall_angle_deg=11.0))
    assert words in walls(replace(evidence, solid=solid))


def test_data_left_out_of_all_metrics_are_reported_with_their_count(evidence):
    """Seen to fail with stations counted in the comparison alone."""
    assert left_out(evidence)[0].text.startswith("1 particle (1 mm³) ran over the edge of the sample")
    repeats_mm = np.array(evidence.readings.repeats_mm)
    repeats_mm[0, :2] = np.nan
    basis = evidence.comparison.basis.model_copy(update={"stations_beyond_mm": np.array([38.0, 40.5])})
    fewer = replace(
        evidence,
        outline=replace(evidence.outline, branches_mm=(np.zeros((2, 2)),)),
        readings=replace(evidence.readings, repeats_mm=repeats_mm),
        comparison=evidence.comparison.model_copy(update={"basis": basis}),
    )
    first, second, _, last = texts(left_out(fewer))
    assert "2 stations of 9 (s = 38, 40.5 mm) beyond the stretch that both curves cover, 0.0 to 40.0" in first
    assert "2 single readings" in second
    assert "1 side crack" in last
    run = replace(evidence.run, spilled=np.zeros(len(evidence.run.spilled), dtype=bool))
    assert [fact.key for fact in left_out(replace(evidence, run=run))] == ["left-out.nothing"]


@pytest.mark.parametrize(
    ("state", "shrinkage_percent", "words"),
    [
        ("wet", None, "wet sealant was read, which had not shrunk."),
        ("cured", None, "cured sealant was read, whose shrinkage is not declared"),
        ("cured", 7.0, "cured sealant was read: the mass balance adds its shrinkage of 7 %"),
        (None, None, "is not declared (readings.state)."),
    ],
)
def test_the_state_of_the_sealant_is_reported_as_declared(evidence, state, shrinkage_percent, words):
    """Seen to fail with every sealant taken for cured."""
    table = {"file": Path("a.csv"), "data": "measured", "role": "held-out", "state": state}
    settings = Readings.model_validate(table | {"shrinkage_percent": shrinkage_percent})
    comparison = assess(evidence, settings, Uncertainty(), None)
    assert words in assumed(replace(evidence, comparison=comparison))
    assert "the caliper" not in assumed(evidence), "not assessed, nothing is known"


def test_every_health_figure_of_a_run_has_a_label_in_the_report():
    """A new number needs a line in HEALTH_LABELS, or the report shows its name in the code."""
    crack = slot(12.0)
    recorded = set(pour(crack, path(crack[1], 0.005, speed_mm_s=40.0), radius_mm=0.7).health.recorded())
    assert {"density_error_mean", "frame_s", "particles_across"} < recorded
    assert recorded < set(HEALTH_LABELS)


def test_the_table_of_a_path_has_its_leads_and_its_range_of_speeds(evidence):
    leads = {"lead_in_mm": 30.0, "lead_out_mm": 4.0, "ramp_mm": 10.0, "reverse": True}
    plan = NozzlePath.model_validate({"volume_ml": 1.2, "trim_mm": 5.0} | leads)
    table = dict(path_table(replace(evidence, trajectory=plan_trajectory(evidence.outline, plan, 1.0))).rows)
    assert table["sealant flows from, to"] == "s = 35.0 to 5.0 mm"
    assert table["length without sealant before, after"] == "30.0 mm, 4.0 mm"
    # The first millimetre of a ramp of 10 mm takes 2 sqrt(10) / 4 s.
    assert table["speed"] == "0.63 to 4.00 mm/s"


READ_MM = np.arange(0.0, 45.0, 5.0)


def stations(*errors_mm):
    """Stations 5 mm apart, in a band of 1 mm."""
    bands = {"data_mm": 0 * READ_MM, "validation_mm": 0 * READ_MM, "profile_mm": 1 + 0 * READ_MM}
    return StationErrors(
        s_mm=READ_MM, error_mm=np.array(errors_mm), numerics_mm=None, inputs_mm=None, by_chance=0.4, **bands
    )


LARGEST_FIRST = (
    "too low from 15 to 20 mm (up to 3.0 mm, at 15 mm), too high at 40 mm (2.0 mm), "
    "too high from 5 to 10 mm (up to 1.4 mm, at 10 mm)."
)


@pytest.mark.parametrize(
    ("errors_mm", "named", "absent"),
    [
        ((0, 1.2, 1.4, -3, -1.1, 0.9, 0, 0, 2.0), LARGEST_FIRST, "more"),
        ((2, 0, -2.1, 0, 2.2, 0, -2.3, 0, 2.4), "2 more stretches", "at 0 mm"),
        ((0.99,) * 9, "", "too"),
    ],
)
def test_stretches_outside_the_band_are_named_with_the_largest_error_first(errors_mm, named, absent):
    text = stretches_off(stations(*errors_mm))
    assert named in text
    assert absent not in text
    assert bool(text) == bool(named)
