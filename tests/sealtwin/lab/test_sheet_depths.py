"""The depth of the crack in a sheet of readings: asked about, and never taken."""

import pytest

from sealtwin.lab.ingest import ingest
from tests.labs import QUIET, answer, edit, fates, levels_mm, question

READINGS = ["s [mm];Tiefe 1 [mm];Tiefe 2 [mm]", "1;1;1,1", "6;1,2;1,3", "11;1,5;1,6"]


def _beside(*table: str, title: str = "") -> str:
    """A table of two columns beside the readings, with a title above each."""
    lines = [f"{line};;{other}" for line, other in zip(READINGS, [*table, ";"], strict=True)]
    return "\n".join([f"Probe P01;;;;{title};", *lines])


def _below(*table: str) -> str:
    return "\n".join(["Probe P01", *READINGS, "", *table])


@pytest.fixture
def folder(small):
    """Two samples; the note of P01 has no depth."""
    edit(small / "P01.toml", "depth_mm = 8.0\n", "")
    return small


SURE, WHOLE = "s [mm];Risstiefe [mm]", {"range": "A1:C5"}
DEPTHS = "crack.depth_mm = [[0.0, 7.5], [12.0, 8.5]]"


@pytest.mark.parametrize(
    ("text", "note", "columns", "words"),
    [
        (_beside("s [mm];Tiefe der Fuge [mm]", "0;7,5", "12;8,5"), "", WHOLE, "row 2: 'Tiefe der Fuge [mm]'"),
        (_below("Ort;Risstiefe", "[mm];[mm]", "0;7,5", "12;8,5"), "", WHOLE, "row 7: 'Risstiefe'"),
        (_below("Depth of crack", "s [mm];Depth [mm]", "0;7,5", "12;8,5"), "", WHOLE, "row 7: 'Depth of crack'"),
        (_beside("s [mm];Tiefe im Riss [mm]", "0;7,5", "12;8,5"), "", WHOLE, "'Tiefe im Riss [mm]'"),
        (_beside(SURE, "0;7,5", "12;8,5"), "depth_mm = 9.0\n", WHOLE, "P01.toml has 9.0"),
        (_beside(SURE, "0;7,5", "12;8,5"), "", {"s": "A", "levels": "B:C"}, "row 2: 'Risstiefe [mm]'"),
        ("s [mm];Tiefe 1 [mm];Risstiefe [mm]\n1;1;7,5\n11;1,5;8,5\n", "", {}, "row 1: 'Risstiefe [mm]'"),
    ],
)  # fmt: skip
def test_depths_are_asked_about_and_answered_in_the_pairing(folder, tmp_path, text, note, columns, words):
    """An answer about the columns of the readings once took the question away, and 16 mm ran."""
    lab = tmp_path / "lab"
    (folder / "P01.csv").write_text(text)
    edit(folder / "P01.toml", "[crack]\n", f"[crack]\n{note}")
    for given in ({}, columns):
        answer(lab, {"P01.csv": given}) if given else None
        assert fates(ingest(folder, lab, QUIET))["P01"] == "failed"
    assert words in question(lab, "P01.csv")
    answer(lab, {"P01.csv": columns | {"settings": DEPTHS}})
    assert fates(ingest(folder, lab, QUIET))["P01"] == "new"
    assert levels_mm(lab, "P01")[-1] == pytest.approx(-1.5, abs=0.051)


@pytest.mark.parametrize("header", ["Tiefe Dichtstoff im Riss [mm]", "Temperatur"])
def test_the_depth_of_the_sealant_is_never_that_of_the_crack(folder, tmp_path, header):
    (folder / "P01.csv").write_text(_beside(f"s [mm];{header}", "0;7,5", "12;8,5"))
    ingested = ingest(folder, tmp_path / "lab", QUIET)
    (sample,) = (outcome for outcome in ingested.outcomes if outcome.sample.name == "P01")
    assert sample.fate == "failed"
    assert "crack.depth_mm" not in sample.note.entries
    assert not any("depth of the crack" in one for one in (*sample.faults, *sample.remarks))
