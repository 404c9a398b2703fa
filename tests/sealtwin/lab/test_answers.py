"""What a sheet leaves open is asked in pairing.csv, and answered there or in lab.toml: no file of the lab is edited."""

import csv

import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.lab.ingest import ingest
from sealtwin.lab.sheets import kind_of_text
from sealtwin.trial.trial_file import load_trial
from tests.labs import QUIET, hashes_of, sealtwin
from validate.readings.read_readings import read_readings

UNKNOWN = "Stelle;a;b\n1;1,5;1,6\n5;1,4;1,5\n11;1,6;1,7\n"


def _fates(ingested):
    return {outcome.sample.name: outcome.fate for outcome in ingested.outcomes}


def _answered(lab, file, **answers):
    """Write answers into the row of a file of the lab's pairing."""
    rows = list(csv.DictReader((lab / "pairing.csv").read_text(encoding="utf-8").splitlines()))
    for row in rows:
        row.update(answers if row["file"] == file else {})
    with (lab / "pairing.csv").open("w", encoding="utf-8", newline="") as pairing:
        writer = csv.DictWriter(pairing, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return lab / "pairing.csv"


def _question(lab, file):
    rows = csv.DictReader((lab / "pairing.csv").read_text(encoding="utf-8").splitlines())
    return next(row["question"] for row in rows if row["file"] == file)


def _levels_mm(lab, sample):
    trial = load_trial(lab / sample / "trial.toml")
    assert trial.readings is not None
    return read_readings(lab / sample / trial.readings.file, trial.readings).level_mm.tolist()


def test_columns_are_asked_and_answered_by_letters_and_remembered(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P01.csv").write_text(UNKNOWN)
    before = hashes_of(small)
    assert _fates(ingest(small, lab, QUIET)) == {"P01": "failed", "P02": "new"}
    assert "A 'Stelle' (1), B 'a' (1,5), C 'b' (1,6)" in _question(lab, "P01.csv")
    pairing = _answered(lab, "P01.csv", s="A", levels="B C", unit="mm", sign="down")
    assert _fates(ingest(small, lab, QUIET, pairing=pairing)) == {"P01": "new", "P02": "unchanged"}
    assert _levels_mm(lab, "P01") == pytest.approx([-1.55, -1.45, -1.65])
    assert _question(lab, "P01.csv") == ""
    assert "P01.csv,readings,P01,,,A,B C,mm,down" in pairing.read_text()
    assert _fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    assert hashes_of(small) == before


def test_answers_may_be_in_small_letters(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P01.csv").write_text(UNKNOWN.replace("Stelle;a;b", "Stelle;eins;zwei"))
    ingest(small, lab, QUIET)
    pairing = _answered(
        lab, "P01.csv", s="a", levels="b c", unit="MM", sign="Down", range="a1:c9", as_written="b2, Sign"
    )
    assert _fates(ingest(small, lab, QUIET, pairing=pairing))["P01"] == "new"
    assert _levels_mm(lab, "P01") == pytest.approx([-1.55, -1.45, -1.65])
    trial = load_trial(lab / "P01" / "trial.toml")
    assert trial.readings is not None
    assert trial.readings.as_written == ("B2", "sign")
    assert trial.readings.columns is not None
    assert trial.readings.columns.range == "A1:C9"


def test_a_small_letter_that_is_another_columns_name_is_not_guessed(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P01.csv").write_text(UNKNOWN)
    ingest(small, lab, QUIET)
    _answered(lab, "P01.csv", s="A", levels="b", unit="mm", sign="down")
    assert _fates(ingest(small, lab, QUIET))["P01"] == "failed"
    assert "'b' is not a column, or both a letter and another's name" in _question(lab, "P01.csv")
    _answered(lab, "P01.csv", s="Stelle", levels="b:b")
    assert _fates(ingest(small, lab, QUIET))["P01"] == "new"
    assert _levels_mm(lab, "P01") == [-1.5, -1.4, -1.6]


def test_lab_toml_says_it_for_all_sheets_and_pairing_csv_for_single_ones(small, tmp_path):
    (small / "P01.csv").write_text(UNKNOWN)
    (small / "P02_Messung.csv").write_text(UNKNOWN)
    with (small / "lab.toml").open("a") as lab_toml:
        lab_toml.write('quantity = "depth"\n[readings.columns]\ns = "A"\nlevels = ["B:C"]\nunit = "mm"\n')
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    datum = 'readings.datum = "sealant_top"; readings.datum_level_mm = 1'
    _answered(lab, "P01.csv", levels="B:B", settings=datum)
    ingested = ingest(small, lab, QUIET)
    assert not ingested.faults
    assert _levels_mm(lab, "P01") == pytest.approx([-0.5, -0.4, -0.6])
    assert _levels_mm(lab, "P02") == pytest.approx([-1.55, -1.45, -1.65])


def test_a_doubt_is_answered_in_the_pairing_too(small, tmp_path):
    lab = tmp_path / "lab"
    lines = (small / "P01.csv").read_text().splitlines()
    cells = lines[3].split(",")
    (small / "P01.csv").write_text("\n".join([*lines[:3], ",".join([*cells[:2], "0.0", *cells[3:]]), *lines[4:]]))
    assert _fates(ingest(small, lab, QUIET))["P01"] == "failed"
    assert 'as_written = ["C4"]' in _question(lab, "P01.csv")
    pairing = _answered(lab, "P01.csv", as_written="C4")
    assert _fates(ingest(small, lab, QUIET, pairing=pairing))["P01"] == "new"


def test_what_was_understood_is_shown_before_anything_is_taken_in(small, tmp_path):
    told = sealtwin("ingest", small, "--out", tmp_path / "lab", "--dry-run", "--quiet").stdout
    assert not (tmp_path / "lab").exists()
    for line in ("  column  name ", "  A       s_mm ", "level upward, 1  mm    -"):
        assert line in told


def test_a_text_is_kept_with_its_sample_and_never_fails_it(small, tmp_path):
    (small / "P01.txt").write_text("Nach Regen gemessen. Massstab: 0\nSiehe Heft 3; Foto verwackelt.\n")
    (small / "P02 Anmerkung.md").write_text("# Probe 2\n\n- Kante ausgebrochen\n")
    (small / "README.txt").write_text("Fotos vom Mai")
    (small / "zu P01 notiert.txt").write_text("Wetter: trocken")
    (small / "Messungen").mkdir()
    (small / "Messungen" / "P02.txt").write_text("Im Ordner der Messungen, und doch keine.")
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert _fates(ingested) == {"P01": "new", "P02": "new"}
    assert (tmp_path / "lab/P01/inputs/text-1.txt").read_bytes() == (small / "P01.txt").read_bytes()
    assert len(list((tmp_path / "lab/P02/inputs").glob("text-*"))) == 2
    assert len(list((tmp_path / "lab/P01/inputs").glob("text-*"))) == 2
    assert "Not used: README.txt" in "\n".join(ingest_answer(ingested).lines)
    assert any(
        "P01.txt is kept as text and not read; it gives no setting; its numbers Massstab: 0" in remark
        for remark in ingested.outcomes[0].remarks
    ), "the hint names what nothing would read"
    (small / "P01.txt").write_text("Mehr dazu.")
    assert _fates(ingest(small, tmp_path / "lab", QUIET))["P01"] == "unchanged", "it says nothing of the trial"


def test_a_text_that_looks_like_settings_is_asked_about_and_fails_nothing(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P01.toml").rename(small / "P01.txt")
    (small / "P01.txt").write_text("Probe 1, gesägt. Tiefe 8,0 mm, Datum: 3.5.2026\nRissenden 40 101 160 98")
    ingested = ingest(small, lab, QUIET)
    assert any(
        "seems to give crack.depth_mm = 8.0" in remark
        for remark in ingested.outcomes[0].remarks + list(ingested.outcomes[0].asked.values())
    )
    assert "set its role to note" in _question(lab, "P01.txt")
    pairing = _answered(lab, "P01.txt", role="note")
    assert _fates(ingest(small, lab, QUIET, pairing=pairing)) == {"P01": "new", "P02": "unchanged"}
    crack = load_trial(lab / "P01" / "trial.toml").crack
    assert crack is not None
    assert crack.depth_mm == 8.0


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("s_mm\tlevel_mm\n0\t-1\n5\t-2\n", "readings"),
        ("Tiefe;16 mm\nPrüfer;M\n", "note"),
        ("crack.depth_mm\t8\n", "note"),
        ("Tiefe;s\n1;0\n2;5\n", "readings"),
        ("Tiefe;Ort\n1 mm;0 mm\n2 mm;5 mm\n", "text"),
        ("Tiefe 16 mm, am Rand mehr\n", "text"),
        ("Am 3.5. gemessen, 3 Fotos, 2 Proben\n", "text"),
        ("", "text"),
    ],
)
def test_a_text_is_told_by_what_it_holds(tmp_path, text, kind):
    (tmp_path / "a.txt").write_text(text)
    assert kind_of_text(tmp_path / "a.txt") == kind
