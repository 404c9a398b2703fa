"""The depth of the crack in a sheet of readings: taken where its words are unmistakable, otherwise asked about."""

import pytest

from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.labs import QUIET, answer, edit, fates, levels_mm, pairing_rows, question

READINGS = ["s [mm];Tiefe 1 [mm];Tiefe 2 [mm]", "1;1;1,1", "6;1,2;1,3", "11;1,5;1,6"]
DEPTHS = [[0.0, 7.5], [12.0, 8.5]]


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


@pytest.mark.parametrize(
    ("text", "cells", "depth_mm"),
    [
        (_beside("s [mm];Tiefe der Fuge [mm]", "0;7,5", "12;8,5"), "E2:F4", DEPTHS),
        (_beside("s [cm];Risstiefe [cm]", "0;0,75", "1,2;0,85"), "E2:F4", DEPTHS),
        (_below("Ort;Risstiefe", "[mm];[mm]", "0;7,5", "12;8,5"), "A7:B10", DEPTHS),
        ("s [mm];Tiefe 1 [mm];Risstiefe [mm]\n1;1;7,5\n11;1,5;8,5\n", "A1:C3", [[1.0, 7.5], [11.0, 8.5]]),
    ],
)
def test_a_sheets_own_depths_are_taken_and_stated(folder, tmp_path, text, cells, depth_mm):
    lab = tmp_path / "lab"
    (folder / "P01.csv").write_text(text)
    ingested = ingest(folder, lab, QUIET)
    assert fates(ingested)["P01"] == "new", ingested.faults
    trial = load_trial(lab / "P01" / "trial.toml")
    assert trial.crack is not None
    assert trial.crack.depth_mm == tuple(map(tuple, depth_mm))
    assert levels_mm(lab, "P01")[-1] == pytest.approx(-1.5, abs=0.051)
    (remark,) = (one for outcome in ingested.outcomes for one in outcome.remarks if "depth of the crack from" in one)
    assert remark.startswith(f"P01.csv, range {cells}: ")


ANSWER = "crack.depth_mm = [[0.0, 7.5], [12.0, 8.5]]"
SURE, DOUBTFUL = "s [mm];Risstiefe [mm]", "s [mm];Tiefe im Riss [mm]"


@pytest.mark.parametrize(
    ("text", "note", "words"),
    [
        (_beside(DOUBTFUL, "0;7,5", "12;8,5"), "", ["'Tiefe im Riss [mm]'", ANSWER]),
        (_beside(SURE, "0;7,5", "12;8,5"), "depth_mm = 9.0\n", ["P01.toml has 9.0", ANSWER]),
        (_beside("wo [mm];Risstiefe [mm]", "0;7,5", "12;8,5"), "", ["places along the crack is unknown"]),
        (_beside("s;Tiefe [mm]", "0;7,5", "12;8,5", title="Riss, Tiefe"), "depth_mm = 8.0\n", ["'Riss, Tiefe'"]),
        (_beside(SURE, "0;7,5", "12;-8,5"), "", ["must be positive"]),
        (_beside(SURE, "0;7,5", "12;8,5"), "[readings.columns]\ns_from = 'second'\n", ["second end", ANSWER]),
    ],
)  # fmt: skip
def test_depths_in_doubt_are_asked_about_with_the_answer(folder, tmp_path, text, note, words):
    lab = tmp_path / "lab"
    (folder / "P01.csv").write_text(text)
    edit(folder / "P01.toml", "[crack]\n", f"[crack]\n{note}")
    assert fates(ingest(folder, lab, QUIET))["P01"] == "failed"
    asked = " ".join(row["question"] for row in pairing_rows(lab) if row["file"] == "P01.csv")
    assert all(word in asked for word in words), asked


def test_the_answer_about_depths_is_taken(folder, tmp_path):
    lab = tmp_path / "lab"
    (folder / "P01.csv").write_text(_beside(DOUBTFUL, "0;7,5", "12;8,5"))
    ingest(folder, lab, QUIET)
    given = question(lab, "P01.csv").partition("pairing.csv: ")[2].rstrip(".")
    assert given == ANSWER
    answer(lab, {"P01.csv": {"settings": given}})
    assert fates(ingest(folder, lab, QUIET))["P01"] == "new"


@pytest.mark.parametrize("header", ["Tiefe Dichtstoff im Riss [mm]", "Temperatur"])
def test_the_depth_of_the_sealant_is_never_that_of_the_crack(folder, tmp_path, header):
    (folder / "P01.csv").write_text(_beside(f"s [mm];{header}", "0;7,5", "12;8,5"))
    ingested = ingest(folder, tmp_path / "lab", QUIET)
    (sample,) = (outcome for outcome in ingested.outcomes if outcome.sample.name == "P01")
    assert sample.fate == "failed"
    assert "crack.depth_mm" not in sample.note.entries
    assert not any("depth of the crack" in one for one in (*sample.faults, *sample.remarks))


def test_each_sample_of_a_sheet_has_its_own_depths(folder, tmp_path):
    """A table beside two samples whose title names neither is a question for both."""
    (folder / "P02_Messung.csv").unlink()
    edit(folder / "P02_Notiz.toml", "depth_mm = 8.0\n", "")
    heads = "P01;;;;P02;;;;{};", "s [mm];Tiefe 1 [mm];Tiefe 2 [mm];;" * 2 + "s [mm];Risstiefe [mm]"
    rows = [f"{row};;{row};;{depth}" for row, depth in zip(READINGS[1:], ["0;7,5", "12;8,5", ";"], strict=True)]
    for title, asked in (("Riss P02", {"P01": "missing"}), ("", dict.fromkeys(("P01", "P02"), "of which sample"))):
        (folder / "P01.csv").write_text("\n".join([*heads, *rows]).format(title))
        ingested = ingest(folder, tmp_path / f"lab{title}", QUIET)
        faults = {outcome.sample.name: " ".join(outcome.faults) for outcome in ingested.outcomes if outcome.faults}
        assert faults.keys() == asked.keys()
        assert all(words in faults[name] for name, words in asked.items())


def test_letters_of_the_readings_answer_no_question_about_depths_below(folder, tmp_path):
    """Letters of the readings' columns are columns of the depths' table too: the question went, and 16 mm ran."""
    lab = tmp_path / "lab"
    (folder / "P01.csv").write_text(_below("Depth of crack", "Station [mm];Depth [mm]", "0;7,5", "12;8,5", "20;8,6"))
    ingest(folder, lab, QUIET)
    rows = {row["part"] for row in pairing_rows(lab) if row["file"] == "P01.csv"}
    assert len(rows) == 2
    edit(lab / "pairing.csv", f"P01.csv,readings,,{max(rows)}", f"P01.csv,ignore,,{max(rows)}")
    answer(lab, {"P01.csv": {"s": "A", "levels": "B:C"}})
    assert fates(ingest(folder, lab, QUIET))["P01"] == "failed"
    assert any("crack.depth_mm = [[0.0, 7.5]" in row["question"] for row in pairing_rows(lab))
