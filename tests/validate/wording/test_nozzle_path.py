"""What a report says of the nozzle's path."""

import re
from dataclasses import replace

from digitise.settings import NozzlePath
from digitise.trajectory import path_report, plan_trajectory
from sealtwin.core.solid_figures import PathFigures, SolidFigures
from tests.evidence import make_evidence
from tests.tables import rows
from validate.report_input import Evidence
from validate.wording.sample_and_run import assumptions


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


def test_a_path_s_length_is_told_with_its_smoothing(tmp_path):
    evidence = make_evidence(tmp_path)
    assert "length over the crack" not in rows(evidence, "Nozzle path")
    plan = NozzlePath(volume_ml=1.2, trim_mm=5.0)
    path = path_report(evidence.trajectory, evidence.outline, plan)[0]
    told = rows(_with_path(evidence, path), "Nozzle path")["length over the crack"]
    assert told == "30.00 mm, smoothed within 0.1 mm RMS of the centreline's 30.00 mm; turns by up to 0.0°"
    bent = _with_path(evidence, replace(path, smallest_radius_mm=12.34))
    assert rows(bent, "Nozzle path")["length over the crack"].endswith("0.0°, smallest radius 12.3 mm")


def _with_path(evidence: Evidence, path: PathFigures) -> Evidence:
    return replace(evidence, solid=replace(evidence.solid, figures=SolidFigures(path=path)))
