"""What a report says of where the sealant is: every particle once."""

import re

from tests.evidence import make_evidence
from validate.wording.comparison import balance_table, volumes_mm3

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
