"""A file belongs to the photo whose stem is its own; all else is a question in pairing.csv, answered in one round."""

import json
import re
import shutil
from pathlib import Path, PurePath

import pytest

from sealtwin.core.errors import InputError
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.files import place_of
from sealtwin.lab.ingest import ingest
from sealtwin.lab.sample import pair
from tests.support.ingested_lab import (
    QUIET,
    add_rows,
    answer,
    edit,
    fates,
    hashes_of,
    levels_mm,
    pairing_rows,
    question,
    sealtwin,
)

SPELLINGS = {
    "photo": (
        "P01.jpg", "p-01_top.JPEG", "photos/P 01.png", "Fotos/P01 Draufsicht.png", "P01_Foto.tif", "P01/photo.jpg",
        "P01/P01.webp", "P01_second.jpg",
    ),
    "mask": ("P01_mask.png", "masks/P01.png"),
    "readings": (
        "P01.csv", "p.01 Messung.xlsx", "caliper/P01.dat", "P01/Messwerte.tsv", "Tiefen P01.csv", "P01 mesures.txt",
        "Relevés/P01.csv", "P01_profondeur.csv", "P01 lecturas.xlsx", "Höhen P01.csv", "P01_Pegel.csv",
    ),
    "fill": ("P01 Wasser.xlsx", "P01_fill.csv"),
    "note": ("P01.toml", "P01.txt", "Messungen/P01.md", "P01_notes.csv", "Protokolle/P01.xlsx", "P01/trial.toml"),
}  # fmt: skip


def test_one_sample_however_its_files_are_named():
    positions = {name: place_of(PurePath(name)) for names in SPELLINGS.values() for name in names}
    roles = {name: (position.key, position.role) for name, position in positions.items() if position}
    assert roles == {name: ("p01", role) for role, names in SPELLINGS.items() for name in names}
    assert [place_of(PurePath(name)) for name in ("report.pdf", "P01", "P01.docx", "P01.stl")] == [None] * 4


OTHERS = "June/P01.jpg", "P1.jpg", "P01'.jpg", "P01 (2).jpg", "IMG_0412_P01.jpg", "P01 2026-05-12.jpg", "PO1.jpg"


@pytest.mark.parametrize("name", OTHERS)
def test_no_other_name_is_that_sample(name):
    """A date, a camera's name, a remark, a prime: once some of them were guessed away."""
    assert getattr(place_of(PurePath(name)), "key", "p01") != "p01"


def test_a_sample_whose_folder_another_one_has_is_given_another_name(small, tmp_path):
    for file in small.glob("P02*"):
        file.rename(small / file.name.replace("P02", "P01'"))
    assert fates(ingest(small, tmp_path / "lab", QUIET)) == {"P01": "new", "P01'": "failed"}
    assert "the folder" in question(tmp_path / "lab", "P01'.png")


def _paired(*names):
    placed = {PurePath(name): [place] for name in names if (place := place_of(PurePath(name))) is not None}
    return {sample.name: sample for sample in pair(Path(), placed, [])}


@pytest.mark.parametrize(
    ("names", "waiting"),
    [
        ("K05.jpg K05.csv K06.jpg Blatt_1.csv", {"K06"}),
        ("K05.jpg K06.jpg K07.csv", {"K05", "K06"}),
        ("K05.jpg K06.jpg K07_Wasser.csv", {"K05", "K06"}),
        ("K05.jpg K06.jpg Blatt.toml", set()),
        ("K05.jpg K06.jpg", set()),
    ],
)
def test_photos_without_a_sheet_wait_while_a_sheet_has_no_photo(names, waiting):
    samples = _paired(*names.split())
    assert {name for name, sample in samples.items() if sample.files.get("readings") == []} == waiting
    questions = [question for sample in samples.values() for question in sample.questions.values()]
    others = {name for name in names.split() if name[:3] not in ("K05", "K06")}
    assert {f"{file}" for question in questions for file in question.rows} == {
        f"{name}.jpg" for name in waiting
    } | others


def test_all_questions_of_a_folder_come_at_once_and_their_answers_leave_none(small, tmp_path):
    """Matching, the content of a sheet without a photo, a missing setting, two photos."""
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "Q02_Messung.csv")
    edit(small / "Q02_Messung.csv", "[mm]", "")
    edit(small / "lab.toml", 'role = "held-out"', "")
    shutil.copy(small / "P01.png", small / "P01_side.png")
    for dry_run in (True, False):
        assert set(fates(ingest(small, lab, QUIET, dry_run=dry_run)).values()) == {"failed"}
    assert set(Catalogue.of(lab).faults()) == {"p01", "p02", "q02"}, "'lab run' leaves them out"
    for words in ("there is no photo with the name 'Q02'", "Photos without a sheet: P02.png", "no unit"):
        assert words in question(lab, "Q02_Messung.csv")
    assert "readings.role is missing" in question(lab, "P02.png")
    assert "2 files have the role photo" in question(lab, "P01_side.png")
    role = "readings.role = 'held-out'"
    sheet, other = {"sample": "p-02", "unit": "mm", "settings": role}, {"role": "ignore"}
    answer(lab, {"Q02_Messung.csv": sheet, "P01_side.png": other, "P01.csv": {"settings": role}})
    assert fates(ingest(small, lab, QUIET)) == {"P01": "new", "P02": "revised"}
    assert {row["question"] for row in pairing_rows(lab)} == {""}


def test_the_pairing_is_corrected_and_remembered(small, tmp_path):
    """A name that may change the readings is asked about at once with the photo."""
    lab, unchanged = tmp_path / "lab", {"P01": "unchanged", "P02": "unchanged"}
    (small / "P02_Messung.csv").rename(small / "Q02 inch.csv")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "new", "P02": "failed", "Q02 inch": "failed"}
    assert "as_written = names" in question(lab, "Q02 inch.csv")
    answer(lab, {"Q02 inch.csv": {"sample": "p-02", "as_written": "names"}})
    assert fates(ingest(small, lab, QUIET)) == unchanged | {"P02": "revised"}
    assert fates(ingest(small, lab, QUIET)) == unchanged
    # As a German spreadsheet saves it, and in another order.
    head, *rows = (lab / "pairing.csv").read_text().replace(",", ";").splitlines()
    saved = "\r\n".join((head, *reversed(rows))).encode("utf-8-sig")
    (lab / "pairing.csv").write_bytes(saved)
    assert not ingest(small, lab, QUIET, dry_run=True).faults
    assert (lab / "pairing.csv").read_bytes() == saved, "a dry run leaves it as it is"
    (lab / "catalogue.json").unlink()
    assert fates(ingest(small, lab, QUIET)) == unchanged, "pairing.csv outlives it"


TABLE = "s [mm];Pegel 1 [mm]\n1;-1,0\n11;-1,5\n;\ns [mm];Pegel 1 [mm]\n1;-2,0\n11;-2,5\n"


def test_a_file_of_several_samples_has_a_row_for_each_whose_answers_say_what_is_read(small, tmp_path):
    lab, both = tmp_path / "lab", ("P01", "P02")
    for sheet in ("P01.csv", "P02_Messung.csv"):
        (small / sheet).unlink()
    (small / "Mai.csv").write_text(TABLE)
    assert fates(ingest(small, lab, QUIET)) == dict.fromkeys(("Mai", *both), "failed")
    assert "add a row with this file for each" in question(lab, "Mai.csv")
    ranges = dict(zip(both, ("1:3", "5:7"), strict=True))
    add_rows(lab, *({"file": "Mai.csv", "sample": sample, "range": rows} for sample, rows in ranges.items()))
    assert fates(ingest(small, lab, QUIET)) == dict.fromkeys(both, "revised")
    assert [levels_mm(lab, sample) for sample in both] == [[-1.0, -1.5], [-2.0, -2.5]]
    assert [(lab / sample / "inputs" / "readings.csv").read_text() for sample in both] == [TABLE, TABLE]
    assert [row["range"] for row in pairing_rows(lab) if row["file"] == "Mai.csv"] == [*ranges.values()]
    assert fates(ingest(small, lab, QUIET)) == dict.fromkeys(both, "unchanged")
    text = (lab / "pairing.csv").read_text()
    for rows in ("1:3", ""):
        (lab / "pairing.csv").write_text(text.replace("5:7", rows))
        with pytest.raises(InputError, match=r"Mai\.csv has several rows"):
            ingest(small, lab, QUIET)


@pytest.mark.parametrize("header", ["unti", ""])
def test_an_answer_in_a_column_without_a_known_name_is_refused(small, lab, header):
    (lab / "pairing.csv").write_text(f"file,role,sample,{header}\nP01.csv,readings,P01,mm\n")
    with pytest.raises(
        InputError, match=f"'mm' is in the column '{header}'; allowed columns are file, role, sample, s,"
    ):
        ingest(small, lab, QUIET)


def test_the_pairing_has_only_columns_that_are_asked_for_or_answered(small, tmp_path):
    def columns():
        ingest(small, tmp_path / "lab", QUIET)
        return (tmp_path / "lab" / "pairing.csv").read_text().splitlines()[0]

    assert columns() == "file,role,sample,question"
    edit(small / "P02_Messung.csv", "[mm]", "")
    assert columns() == "file,role,sample,places,unit,question"
    # A column that nothing asks for, by hand and in another position.
    answer(tmp_path / "lab", {"P02_Messung.csv": {"unit": "mm"}, "P01.csv": {"as_written": "B3"}})
    assert columns() == "file,role,sample,unit,as_written,question"


def test_a_pairing_that_cannot_be_is_refused_with_all_its_rows(small, tmp_path):
    (lab := tmp_path / "lab").mkdir()
    rows = "P01.png,readings,P01\ngone.png,photo,P01\nP02.png,photo,\nP02.stl,readings,P02\n"
    (lab / "pairing.csv").write_text("file,role,sample\n" + rows)
    (small / "P02.stl").write_bytes(b"solid")
    faults = (
        "line 2: P01.png cannot have the role 'readings'.*photo, mask, ignore",
        "line 3: 'gone.png'",
        "line 5: 'P02.stl'",
    )
    with pytest.raises(InputError, match="^.*" + ".*\n.*".join(faults) + ".*$"):
        ingest(small, lab, QUIET)
    assert {path.name for path in lab.iterdir()} <= {"pairing.csv", ".lock"}


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
    assert "P01.csv,readings,P01,A,B C,mm,down,\n" in pairing.read_text(), "no question is left"
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
    """The small folder, with a 0 for a missing reading of P01 in cell C4."""
    lines = (small / "P01.csv").read_text().splitlines()
    lines[3] = re.sub(r"^([^,]*,[^,]*),[^,]*", r"\1,0.00", lines[3])
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
    assert (ingested.exit_code, doubt["name"]) == (6, "P01")
    assert "as_written = datum" in doubt["sentence"]
