"""What a report takes for granted and leaves out: said, with numbers, and never invented."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.run_figures import RunHealth
from tests.evidence import make_evidence
from validate.compare import assess
from validate.settings import Readings, Uncertainty
from validate.wording.comparison import volume_table
from validate.wording.sample_and_run import assumptions, left_out, settings_table


def test_reynolds_and_bond_numbers_are_those_of_the_trial(tmp_path):
    """By hand: Bo = 1690 * 9.81 * 0.0031² / 0.072 = 2.2; Re = v d / nu with v = Q / (pi d² / 4)."""
    evidence = make_evidence(tmp_path)
    sentence = next(text for text in assumptions(evidence) if text.startswith("Surface tension"))
    assert "Bond number 2.2" in sentence
    trajectory = evidence.trajectory
    flow_mm3_s = 40 * 3.1 * 10 / trajectory.duration_s
    speed_mm_s = flow_mm3_s / (np.pi * 1.2**2)
    assert f"Reynolds number {speed_mm_s * 2.4 / 32.6:.2g}" in sentence
    assert f"{speed_mm_s:.0f} mm/s" in sentence


def test_the_mouth_of_a_flare_is_told_beside_the_width_in_the_photo(tmp_path):
    """By hand: 3.1 mm and twice 10 mm times the tangent of 11 degrees are 6.99 mm."""
    evidence = make_evidence(tmp_path)
    assert "a mouth of" not in " ".join(assumptions(evidence))
    flared = build_solid(evidence.outline, CrackShape(depth_mm=10.0, tilt="flare", wall_angle_deg=11.0))
    told = " ".join(assumptions(replace(evidence, solid=flared)))
    assert "traced width of 3.10 mm is taken as that of the floor. The mouth is then 6.99 mm" in told


def test_the_floor_of_an_undercut_is_told_beside_the_width_in_the_photo(tmp_path):
    evidence = make_evidence(tmp_path)
    undercut = build_solid(evidence.outline, CrackShape(depth_mm=10.0, tilt="undercut", wall_angle_deg=11.0))
    sentences = " ".join(assumptions(replace(evidence, solid=undercut)))
    assert "The mouth has the width in the photo, 3.10 mm; the floor, 6.99 mm wide" in sentences


def test_paste_that_yields_is_told_with_its_stress_and_its_number(tmp_path):
    """By hand: 12 Pa over rho nu v / d; curing is then modelled, and only shrinkage is not."""
    evidence = make_evidence(tmp_path)
    assert not any("Bingham" in text for text in assumptions(evidence))
    evidence.run.settings["fluid"] |= {"yield_stress_pa": 12.0, "structuration_pa_per_s": 0.5}
    told = " ".join(assumptions(evidence))
    speed_mm_s = 40 * 3.1 * 10 / evidence.trajectory.duration_s / (np.pi * 1.2**2)
    density_kg_m3 = evidence.run.settings["fluid"]["density_kg_m3"]
    assert f"Bingham number {12.0 / (density_kg_m3 * 32.6e-6 * speed_mm_s / 2.4):.2g} there" in told
    assert "yield stress of 12 Pa, and 0.5 Pa more each second" in told
    assert "Shrinkage is not modelled" in told
    assert "Curing" not in told


def test_walls_whose_drag_follows_from_the_viscosity_are_told_with_its_weight(tmp_path):
    evidence = make_evidence(tmp_path)
    evidence.run.settings["fluid"] |= {"D_cm": 0.3}
    assert not any("sticks to the walls" in text for text in assumptions(evidence))
    evidence.run.settings["fluid"] |= {"D_cm": 0.0361, "D_from": "no slip"}
    (told,) = (text for text in assumptions(evidence) if "sticks to the walls" in text)
    assert "D = 0.0361 cm" in told


def test_a_sample_that_slopes_is_told_with_both_angles_and_a_level_one_is_not(tmp_path):
    evidence = make_evidence(tmp_path)
    assert not any("slopes" in text for text in assumptions(evidence))
    evidence.run.settings["sample"] = {"crossfall_deg": -2.5, "gradient_deg": 5.0}
    (told,) = (text for text in assumptions(evidence) if "slopes" in text)
    assert "rises towards +x by 5° and towards +y by -2.5°" in told
    assert ("sample: crossfall (°)", "-2.5") in settings_table(evidence).rows


def test_sealant_with_a_table_is_told_with_its_ends_and_its_columns_are_not_listed(tmp_path):
    evidence = make_evidence(tmp_path)
    table = {"age_s": [0.0, 60.0, 600.0], "temperature_c": None, "viscosity_pa_s": [0.05, 1.0, 30.0]}
    evidence.run.settings["fluid"] |= {"curve": table | {"yield_stress_pa": [0.0, 5.0, 40.0]}, "cooling": None}
    told = " ".join(assumptions(evidence))
    assert (
        "a table over its age since it left the nozzle, 0.05 to 30 Pa s, its yield stress (Bingham) 0 to 40 Pa" in told
    )
    assert "Shrinkage is not modelled" in told
    rows = dict(settings_table(evidence).rows)
    assert rows["fluid: curve viscosity (Pa s)"] == "3 rows, 0.05 to 30"
    assert not any("temperature" in name or "cooling" in name for name in rows)
    cooling = {"age_s": [0.0, 60.0], "temperature_c": [190.0, 120.0]}
    hot = {"temperature_c": [100.0, 200.0], "viscosity_pa_s": [30.0, 0.05]}
    evidence.run.settings["fluid"] |= {"curve": hot, "cooling": cooling}
    told = " ".join(assumptions(evidence))
    assert "over its temperature, 0.05 to 30 Pa s; between" in told
    assert "from 190 to 120 °C" in told


def test_a_run_without_viscosity_gets_no_invented_numbers(tmp_path):
    evidence = make_evidence(tmp_path)
    bare = replace(evidence, run=replace(evidence.run, health=RunHealth()))
    assert any("no Reynolds or Bond number" in text for text in assumptions(bare))


def test_what_counts_in_no_metric_is_told_by_its_number(tmp_path):
    """Seen to fail with the stations counted from the comparison alone."""
    evidence = make_evidence(tmp_path)
    assert evidence.readings is not None
    assert evidence.comparison is not None
    assert left_out(evidence) == [
        "1 particle (1 mm³) over the edge of the sample: in the mass balance, not in the profile."
    ]
    repeats_mm = np.array(evidence.readings.repeats_mm)
    repeats_mm[0, :2] = np.nan
    fewer = evidence.comparison.model_copy(update={"stations_beyond_mm": np.array([38.0, 40.5])})
    outline = replace(evidence.outline, branches_mm=(np.zeros((2, 2)),))
    told = left_out(
        replace(evidence, readings=replace(evidence.readings, repeats_mm=repeats_mm), comparison=fewer, outline=outline)
    )
    assert told[:2] == [
        "2 stations of 9 (s = 38, 40.5 mm): beyond the stretch that both curves cover, 0.0 to 40.0 mm. The nearest "
        "one beyond each end still sets the slope of the readings' line up to that end.",
        "2 single readings: no number in the sheet.",
    ]
    assert told[3] == "1 side crack seen in the photo: not part of the solid."


def test_where_all_counts_it_is_said(tmp_path):
    evidence = make_evidence(tmp_path)
    run = replace(evidence.run, spilled=np.zeros(len(evidence.run.spilled), dtype=bool))
    assert left_out(replace(evidence, run=run)) == ["Left out: nothing."]


@pytest.mark.parametrize(
    ("state", "shrinkage_percent", "said"),
    [
        ("wet", None, "not modelled, and the caliper read wet sealant, which had not shrunk."),
        ("cured", None, "not modelled, while the caliper read cured sealant, whose shrinkage is not declared"),
        ("cured", 7.0, "cured sealant: the mass balance adds the 7 % by which it shrank"),
        (None, None, "whether the caliper read wet or cured sealant is not declared (readings.state)."),
    ],
)
def test_what_was_read_is_as_it_was_declared(tmp_path, state, shrinkage_percent, said):
    """Seen to fail with every sealant taken for cured."""
    evidence = make_evidence(tmp_path)
    sheet = Readings.model_validate(
        {"file": Path("a.csv"), "data": "measured", "role": "held-out", "state": state}
        | {"shrinkage_percent": shrinkage_percent}
    )
    told = assumptions(replace(evidence, comparison=assess(evidence, sheet, Uncertainty(), None)))
    assert any(said in sentence for sentence in told)
    assert not any("the caliper" in sentence for sentence in assumptions(evidence)), "not assessed, nothing is known"


def test_the_sealant_under_the_level_is_held_against_the_settled_space(tmp_path):
    """A level 0.5 mm too high in a slot of 3.1 mm reads off more than what the particles fill."""
    evidence = make_evidence(tmp_path)
    compared = assess(evidence, Readings(file=Path("x.csv"), role="held-out", data="measured"), Uncertainty(), None)
    assert compared.volumes is not None
    balance = compared.volumes.mass_balance
    rows = dict(volume_table(compared, compared.volumes).rows)
    share = compared.simulated_sealant_mm3 / (balance.in_crack_mm3 + balance.above_mm3)
    assert f"({100 * share:.1f} % of the settled space)" in rows["sealant under the level, over the covered length"]
