"""report.json: what it says is what was found, and the schema that is published is its own."""

import json
from dataclasses import replace
from importlib.resources import files as resources

import pytest
from pydantic import ValidationError

from sealtwin.files import as_json
from tests.evidence import make_evidence
from validate.reporting.report_data import SCHEMA, ReportData, report_data, schema
from validate.settings import Gate


def test_the_published_schema_is_the_model_s():
    """``python -m validate.reporting.report_data`` prints it; a change of the model has to be published with it."""
    published = resources("validate").joinpath("schema", SCHEMA).read_text(encoding="utf-8")
    assert json.loads(published) == schema()


def test_every_field_is_described():
    """A field that is a part of its own is described where that part is."""
    for part in (schema(), *schema()["$defs"].values()):
        assert "description" in part
        assert {name for name, field in part["properties"].items() if not {"description", "$ref"} & set(field)} == set()


def test_numbers_have_units_and_are_those_of_the_comparison(tmp_path):
    evidence = make_evidence(tmp_path, gate=Gate(mean_error_mm=1.0), error_mm=0.5)
    data = ReportData.model_validate_json(as_json(report_data(evidence).model_dump(mode="json")))
    assert (data.verdict.outcome, data.verdict.mean_error_limit_mm, data.verdict.role) == ("passed", 1.0, "held-out")
    mean = data.metrics["mean_error_mm"]
    assert (mean.value, mean.unit) == (pytest.approx(0.5), "mm")
    assert (data.metrics["area_mm2"].unit, data.metrics["coverage"].unit) == ("mm²", "1")
    assert data.metrics["measured_underfill_mm3"].unit == "mm³"
    assert data.metrics["share_under_1_mm"].unit == "1", "the millimetre in its name is another's"
    assert all(quantity.unit and quantity.meaning for quantity in data.metrics.values())
    assert len(data.error_by_bin) == 4


def test_what_was_dispensed_is_somewhere(tmp_path):
    volumes = report_data(make_evidence(tmp_path)).mass_balance
    parts = [volumes[key].value for key in ("in_crack", "above_face", "spilled")]
    assert sum(value or 0.0 for value in parts) == volumes["dispensed"].value


def test_a_number_that_does_not_exist_is_null_and_an_unknown_key_is_refused(tmp_path):
    evidence = make_evidence(tmp_path)
    assert evidence.comparison is not None
    broken = replace(evidence.comparison, metrics=evidence.comparison.metrics | {"start_zone_error_mm": float("nan")})
    content = report_data(replace(evidence, comparison=broken)).model_dump(mode="json")
    assert content["metrics"]["start_zone_error_mm"]["value"] is None
    with pytest.raises(ValidationError, match="surprise"):
        ReportData.model_validate(content | {"surprise": 1})
