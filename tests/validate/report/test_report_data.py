"""The content of report.json, and its published schema."""

import html
import json
import re
from dataclasses import replace
from importlib.resources import files as resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from tests.support.evidence import make_evidence, slope
from tests.support.report_schema import schema
from tests.support.report_stubs import leave_out_figures
from validate.compare import assess
from validate.comparison import CurveDistances
from validate.report.write_report import report_data, write_report
from validate.result import Comparison, ReadingsFile, ReadingsSheet, ReportData
from validate.settings import Gate, Readings, Uncertainty
from validate.uncertainty.computed import Effect, SizeRuns, Spread

DECLARED = "uncertainty.repeatability_mm"


def test_the_published_schema_equals_the_schema_of_the_model():
    """``python -m tests.support.report_schema`` prints it; a change of the model has to be published with it."""
    published = resources("validate").joinpath("schema", "report.schema.json").read_text(encoding="utf-8")
    assert json.loads(published) == schema()


def test_every_field_of_the_schema_has_a_description():
    """A field that refers to a part of the schema is described at that part."""
    for part in (schema(), *schema()["$defs"].values()):
        assert "description" in part
        assert {name for name, field in part["properties"].items() if not {"description", "$ref"} & set(field)} == set()


def test_report_json_has_the_tables_and_figures_of_the_page(tmp_path, monkeypatch):
    """Particle sizes, inputs and volumes were once on the page alone. A table that is added there must be here too."""
    sheet = ReadingsSheet(name="P01 Messung.csv", sha256="73cf", operator="A. B.", date="2026-03-01")
    s_mm = np.linspace(0, 40, 81)
    fine, middle, coarse = (
        SizeRuns(radius_mm, slope(s_mm) + z_mm + np.array([[-0.1], [0.0], [0.1]]))
        for radius_mm, z_mm in ((0.4, 0.45), (0.5, 0.5), (0.6, 0.6))
    )
    runs = Spread(s_mm, (fine, middle, coarse), (Effect("volume_ml", 0.1, np.full(81, 0.3)),), 0.02, 0.6)
    settings = Readings(file=Path("readings.csv"), data="measured", role="held-out")
    evidence = make_evidence(tmp_path, gate=Gate(mean_error_mm=1.0), error_mm=0.5, sheet=sheet)
    readings = replace(evidence.readings, doubts=("A9: wet",))
    declared = Uncertainty(volume_ml=0.1, repeatability_mm=0.001)
    compared = assess(replace(evidence, readings=readings), settings, declared, runs, Gate(mean_error_mm=1.0))
    assert [re.sub(r" is .*", "", remark) for remark in compared.readings_remarks] == ["A9: wet", DECLARED]
    leave_out_figures(monkeypatch)
    write_report(tmp_path, replace(evidence, comparison=compared))
    data: Any = ReportData.model_validate_json((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert data.readings == ReadingsFile(**dict(sheet), dialect="", data="measured")
    assert data.comparison.model_dump_json() == compared.model_dump_json()
    assert (data.outcome, data.headline) == ("passed", compared.headline)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    titles = [html.unescape(title) for title in re.findall("<h3>(.*)</h3>", page)]
    assert [table.title for table in data.tables] == titles
    assert len(titles) > 10
    assert [title for title in titles if "remark" in title] == ["Agreement with the readings, with 2 remarks"]


@pytest.mark.parametrize("outcome", ["passed", "failed", "undecided"])
@pytest.mark.parametrize("role", ["held-out", "calibrated-on", "undeclared"])
def test_only_a_pass_on_held_out_readings_is_shown_in_green(outcome, role):
    report = ReportData.model_construct(outcome=outcome, comparison=Comparison.model_construct(role=role))
    assert report.tone == ("open" if outcome == "passed" and role != "held-out" else outcome)


def test_report_json_has_null_instead_of_nan_and_no_unknown_keys(evidence):
    changed: dict[str, Any] = dict(evidence.comparison.distances) | {"frechet_mm": float("nan")}
    distances = CurveDistances(**changed)
    broken = evidence.comparison.model_copy(update={"distances": distances})
    content = report_data(replace(evidence, comparison=broken)).model_dump(mode="json")
    assert content["comparison"]["distances"]["frechet_mm"] is None
    with pytest.raises(ValidationError, match="surprise"):
        ReportData.model_validate(content | {"surprise": 1})
