"""What a report says of where the sealant is: every particle once."""

import re
from dataclasses import replace

from tests.evidence import make_evidence
from validate.wording.comparison import balance_table, volumes_mm3
from validate.wording.sample_and_run import assumptions

SPILLED = "dispensed sealant over the sample's edge"


def test_one_particle_is_no_plural(tmp_path):
    spilled = dict(balance_table(make_evidence(tmp_path)).rows)[SPILLED]
    assert spilled.endswith(", 1 particle")


def test_every_particle_is_somewhere(tmp_path):
    evidence = make_evidence(tmp_path)
    count = {
        name: int(re.findall(r"([\d,]+) particle", text)[0].replace(",", ""))
        for name, text in balance_table(evidence).rows
        if "particle" in text
    }
    places = volumes_mm3(evidence)
    parts = [count[places[key][0]] for key in ("in_crack", "above_face", "spilled")]
    assert count[SPILLED] == 1
    assert sum(parts) == count["dispensed"] == len(evidence.run.position_mm)


def test_a_paste_without_a_stated_uncertainty_has_no_interval(tmp_path):
    """As of a calibration that left the yield stress alone. Broken on purpose, it is known to 95 % from 10 to 10."""
    evidence = make_evidence(tmp_path)
    paste = {"method": "calibration", "date": "2026-11-25", "data": "measured", "not_for": ("a warm day",)}
    paste |= {"yield_stress_pa": 10.0, "yield_stress_error_pa": 0.0, "yield_stress_95_pa": (10.0, 10.0)}
    settings = {**evidence.run.settings, "fluid": {**evidence.run.settings["fluid"], "material": paste}}
    words = " ".join(assumptions(replace(evidence, run=replace(evidence.run, settings=settings))))
    assert "yield stress is 10 Pa, its uncertainty is not stated, by: calibration" in words
    assert "95 % 10 to 10" not in words
