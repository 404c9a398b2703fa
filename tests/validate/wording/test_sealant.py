"""What a report says of where the sealant is: every particle once."""

import re

from tests.evidence import make_evidence
from tests.tables import rows


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
