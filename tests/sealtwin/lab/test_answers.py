"""What a sheet leaves open or makes doubtful is asked, and answered in pairing.csv, a note or lab.toml."""

import json

import pytest

from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.ingest import ingest
from tests.support.ingested_lab import QUIET, answer, fates, hashes_of, levels_mm, question, sealtwin

UNKNOWN = "Stelle;a;b\n1;1,5;1,6\n5;1,4;1,5\n11;1,6;1,7\n"


def test_columns_are_asked_and_answered_by_letters_and_remembered(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P01.csv").write_text(UNKNOWN)
    before = hashes_of(small)
    assert fates(ingest(small, lab, QUIET)) == {"P01": "failed", "P02": "new"}
    for words in ("P01.csv: no column is named as a reading", "column B 'a', column C 'b'", "Give sign = ...."):
        assert words in question(lab, "P01.csv")
    pairing = answer(lab, {"P01.csv": {"s": "A", "levels": "B C", "unit": "mm", "sign": "down"}})
    assert fates(ingest(small, lab, QUIET)) == {"P01": "revised", "P02": "unchanged"}
    assert levels_mm(lab, "P01") == pytest.approx([-1.55, -1.45, -1.65])
    assert question(lab, "P01.csv") == ""
    assert "P01.csv,readings,P01,A,B C,mm,down" in pairing.read_text()
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    assert hashes_of(small) == before


def test_a_sheet_in_question_is_shown_as_it_was_understood(small, tmp_path):
    (small / "P01.csv").write_text(";<script>;s [mm];x\n;;1;1,5\n;;5;1,4\n")
    sealtwin("ingest", small, "--out", tmp_path / "lab", "--quiet")
    page = (tmp_path / "lab" / "index.html").read_text()
    assert "<td>&lt;script&gt;</td>" in page
    assert "<td><strong>1</strong></td>" in page


def test_lab_toml_says_it_for_all_sheets_and_pairing_csv_for_single_ones(small, tmp_path):
    (small / "P01.csv").write_text(UNKNOWN)
    (small / "P02_Messung.csv").write_text(UNKNOWN)
    with (small / "lab.toml").open("a") as lab_toml:
        lab_toml.write('quantity = "depth"\nunit = "mm"\n[readings.columns]\ns = "A"\nlevels = ["B:C"]\n')
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    answer(lab, {"P01.csv": {"levels": "B", "datum": "sealant_top", "datum_level_mm": "-1"}})
    # The second ingest reads the "'-1" of its own file, which no spreadsheet calculates.
    for _ in range(2):
        assert not ingest(small, lab, QUIET).faults
        assert levels_mm(lab, "P01") == pytest.approx([-2.5, -2.4, -2.6])
        answer(lab, {"P02_Messung.csv": {"as_written": "B"}})
    assert levels_mm(lab, "P02") == pytest.approx([-1.55, -1.45, -1.65])


@pytest.fixture
def doubtful(small):
    """The small folder, with a 0 for a missing reading of P01 in cell C4, and its answer not given."""
    lines = (small / "P01.csv").read_text().splitlines()
    cells = lines[3].split(",")
    lines[3] = ",".join([*cells[:2], "0.00", *cells[3:]])
    (small / "P01.csv").write_text("\n".join(lines) + "\n")
    return small


def test_a_doubt_holds_its_sample_alone_names_cell_and_answer_and_is_answered_in_the_pairing(doubtful, tmp_path):
    lab = tmp_path / "lab"
    ingested = ingest(doubtful, lab, QUIET)
    assert fates(ingested) == {"P01": "failed", "P02": "new"}
    (fault,) = ingested.faults
    assert fault.sentence.startswith("P01.csv, cell C4: 0 mm at s = 5 mm")
    assert "as_written = C4" in fault.sentence
    assert not Catalogue.of(lab).latest["p01"].sound, "'lab run' leaves it out, even once its files are removed"
    assert "as_written = C4" in question(lab, "P01.csv")
    answer(lab, {"P01.csv": {"as_written": "C4"}})
    assert fates(ingest(doubtful, lab, QUIET))["P01"] == "revised"


def test_the_readings_are_judged_again_by_the_volume_in_the_traced_crack(small, tmp_path):
    """0.08 ml fill a third of the crack, and levels 1.5 mm below its face most of it."""
    rows = (f"{s_mm},-1.5{s_mm},-1.4{13 - s_mm}" for s_mm in (0, 3, 5, 8, 11, 13))
    (small / "P01.csv").write_text("\n".join(["s_mm,level_1_mm,level_2_mm", *rows]))
    ingested = sealtwin("ingest", small, "--out", tmp_path / "lab", "--json")
    (doubt,) = json.loads(ingested.stdout)["faults"]
    assert doubt["name"] == "P01"
    assert "as_written = datum" in doubt["sentence"]
    assert ingested.exit_code == 6
