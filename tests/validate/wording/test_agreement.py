"""What a report says of readings and of how near they are."""

from dataclasses import replace

from tests.evidence import make_evidence
from tests.tables import rows
from validate.report_input import ReadingsSheet


def test_both_areas_stand_side_by_side(tmp_path):
    agreement = rows(make_evidence(tmp_path, error_mm=0.5), "Agreement with the readings")
    assert agreement["area between the curves, exact"] == "20.0000 mm²"
    assert agreement["area by similaritymeasures"].startswith("20.0000 mm²")
    assert agreement["mean error = area / covered length"] == "0.500 mm"
    assert agreement["area by similaritymeasures"].endswith("the same to 1e-9 mm²")
    assert "100.0 % of the crack" in agreement["covered length"]
    assert "the simulation beats it" in agreement["the dispensed volume lying flat, as a baseline"]


def test_a_report_says_how_the_sheet_was_understood(tmp_path):
    """A comma taken for thousands, or a depth for a level, is seen here first."""
    evidence = make_evidence(tmp_path)
    assert evidence.readings is not None
    assert "read as" not in rows(evidence, "Readings")
    told = replace(evidence, readings=replace(evidence.readings, dialect="CSV, decimal comma; depth downward in cm"))
    assert rows(told, "Readings")["read as"] == "CSV, decimal comma; depth downward in cm"


def test_the_sheet_that_is_judged_is_named(tmp_path):
    evidence = make_evidence(tmp_path)
    assert "file" not in rows(evidence, "Readings")
    sheet = ReadingsSheet(name="P01 Messung.csv", sha256="73cf", operator="A. B.", date=None)
    told = rows(replace(evidence, sheet=sheet), "Readings")
    assert (told["file"], told["sha256 of the file"]) == ("P01 Messung.csv", "73cf")
    assert (told["read by"], told["read on"]) == ("A. B.", "not recorded")
    assert rows(evidence, "Readings")["stations compared"].startswith("9 of 9,")
