"""A file belongs to the photo whose stem is its own; all else is a question in pairing.csv, answered in one round."""

import shutil
from pathlib import Path, PurePath

import pytest

from sealtwin.core.errors import InputError
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.files import place_of
from sealtwin.lab.ingest import ingest
from sealtwin.lab.sample import pair
from tests.support.ingested_lab import QUIET, add_rows, answer, edit, fates, levels_mm, pairing_rows, question

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
    places = {name: place_of(PurePath(name)) for names in SPELLINGS.values() for name in names}
    roles = {name: (place.key, place.role) for name, place in places.items() if place}
    assert roles == {name: ("p01", role) for role, names in SPELLINGS.items() for name in names}
    assert [place_of(PurePath(name)) for name in ("report.pdf", "P01", "P01.docx", "P01.stl")] == [None] * 4


@pytest.mark.parametrize(
    "other",
    ["June/P01.jpg", "P1.jpg", "P01'.jpg", "P01 (2).jpg", "IMG_0412_P01.jpg", "P01 2026-05-12.jpg", "PO1.jpg"],
)  # fmt: skip
def test_no_other_name_is_that_sample(other):
    """A date, a camera's name, a remark, a prime: once some of them were guessed away."""
    place = place_of(PurePath(other))
    assert place is not None
    assert place.key != "p01"


def test_a_sample_whose_folder_another_one_has_is_given_another_name(small, tmp_path):
    lab = tmp_path / "lab"
    for file in small.glob("P02*"):
        file.rename(small / file.name.replace("P02", "P01'"))
    asked = ingest(small, lab, QUIET)
    assert fates(asked) == {"P01": "new", "P01'": "failed"}
    assert "the folder" in question(lab, "P01'.png")


def _paired(*names):
    placed = {PurePath(name): [place] for name in names if (place := place_of(PurePath(name))) is not None}
    return {sample.name: sample for sample in pair(Path(), placed, [])}


@pytest.mark.parametrize(
    ("names", "waiting"),
    [
        (("K05.jpg", "K05.csv", "K06.jpg", "Blatt 1.csv"), {"K06"}),
        (("K05.jpg", "K06.jpg", "K07.csv"), {"K05", "K06"}),
        (("K05.jpg", "K06.jpg", "K07 Wasser.csv"), {"K05", "K06"}),
        (("K05.jpg", "K06.jpg", "Blatt.toml"), set()),
        (("K05.jpg", "K06.jpg"), set()),
    ],
)
def test_photos_without_a_sheet_wait_while_a_sheet_has_no_photo(names, waiting):
    samples = _paired(*names)
    assert {name for name, sample in samples.items() if sample.files.get("readings") == []} == waiting
    asked = {
        f"{file}" for sample in samples.values() for question in sample.questions.values() for file in question.rows
    }
    assert asked == {f"{name}.jpg" for name in waiting} | {name for name in names if name[:3] not in ("K05", "K06")}


def test_a_thousand_sheets_without_a_photo_are_asked_about_in_short_sentences():
    samples = _paired(
        *(f"{kind}{number}.{end}" for kind, end in (("A", "jpg"), ("B", "csv")) for number in range(1000))
    )
    questions = [question for sample in samples.values() for question in sample.questions]
    assert len(questions) == 2000
    assert max(map(len, questions)) < 600


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
    for words in ("no photo is called 'Q02'", "Photos without a sheet: P02.png", "no unit"):
        assert words in question(lab, "Q02_Messung.csv")
    assert "readings.role is missing" in question(lab, "P02.png")
    assert "2 files are its photo" in question(lab, "P01_side.png")
    role = "readings.role = 'held-out'"
    sheet, other = {"sample": "p-02", "unit": "mm", "settings": role}, {"role": "ignore"}
    answer(lab, {"Q02_Messung.csv": sheet, "P01_side.png": other, "P01.csv": {"settings": role}})
    assert fates(ingest(small, lab, QUIET)) == {"P01": "new", "P02": "revised"}
    assert {row["question"] for row in pairing_rows(lab)} == {""}


def test_the_pairing_is_corrected_and_remembered(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "Q02_Messung.csv")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "new", "P02": "failed", "Q02": "failed"}
    answer(lab, {"Q02_Messung.csv": {"sample": "p-02"}})
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "revised"}
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    # Saved by a German spreadsheet, and in another order.
    head, *rows = (lab / "pairing.csv").read_text().replace(",", ";").splitlines()
    saved = "\r\n".join((head, *reversed(rows))).encode("utf-8-sig")
    (lab / "pairing.csv").write_bytes(saved)
    assert not ingest(small, lab, QUIET, dry_run=True).faults
    assert (lab / "pairing.csv").read_bytes() == saved, "a dry run leaves it as it is"
    (lab / "catalogue.json").unlink()
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}, "pairing.csv outlives it"


def test_a_name_that_may_change_the_readings_is_asked_with_the_photo_it_belongs_to(small, tmp_path):
    """Not in a second round, once the sheet has a sample."""
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "P02 inch.csv")
    ingest(small, lab, QUIET)
    assert "no photo is called 'P02 inch'" in (asked := question(lab, "P02 inch.csv"))
    assert "as_written = names" in asked
    answer(lab, {"P02 inch.csv": {"sample": "P02", "as_written": "names"}})
    assert not ingest(small, lab, QUIET).faults


TABLE = "s [mm];Pegel 1 [mm]\n1;-1,0\n11;-1,5\n;\ns [mm];Pegel 1 [mm]\n1;-2,0\n11;-2,5\n"


def test_a_file_of_several_samples_has_a_row_for_each_whose_answers_say_what_is_read(small, tmp_path):
    lab = tmp_path / "lab"
    for sheet in ("P01.csv", "P02_Messung.csv"):
        (small / sheet).unlink()
    (small / "Mai.csv").write_text(TABLE)
    assert fates(ingest(small, lab, QUIET)) == {"Mai": "failed", "P01": "failed", "P02": "failed"}
    assert "add a row of this file for each" in question(lab, "Mai.csv")
    add_rows(
        lab, {"file": "Mai.csv", "sample": "P01", "range": "1:3"}, {"file": "Mai.csv", "sample": "P02", "range": "5:7"}
    )
    assert fates(ingest(small, lab, QUIET)) == {"P01": "revised", "P02": "revised"}
    assert (levels_mm(lab, "P01"), levels_mm(lab, "P02")) == ([-1.0, -1.5], [-2.0, -2.5])
    for sample in ("P01", "P02"):
        assert (lab / sample / "inputs" / "readings.csv").read_text() == TABLE
    assert [row["range"] for row in pairing_rows(lab) if row["file"] == "Mai.csv"] == ["1:3", "5:7"]
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    for old, new in (("5:7", "1:3"), ("5:7", "")):
        text = (lab / "pairing.csv").read_text()
        edit(lab / "pairing.csv", old, new)
        with pytest.raises(InputError, match=r"Mai\.csv has several rows"):
            ingest(small, lab, QUIET)
        (lab / "pairing.csv").write_text(text)


@pytest.mark.parametrize("header", ["unti", ""])
def test_an_answer_in_a_column_without_a_known_name_is_refused(small, lab, header):
    (lab / "pairing.csv").write_text(f"file,role,sample,{header}\nP01.csv,readings,P01,mm\n")
    with pytest.raises(InputError, match=f"'mm' is in a column '{header}'; allowed are file, role, sample, s,"):
        ingest(small, lab, QUIET)


def test_the_pairing_has_only_columns_that_are_asked_for_or_answered(small, tmp_path):
    lab = tmp_path / "lab"

    def columns():
        return (lab / "pairing.csv").read_text().splitlines()[0].split(",")

    ingest(small, lab, QUIET)
    assert columns() == ["file", "role", "sample", "question"]
    edit(small / "P02_Messung.csv", "[mm]", "")
    ingest(small, lab, QUIET)
    assert columns() == ["file", "role", "sample", "places", "unit", "question"]
    # By hand: a column that nothing asks for, in another place.
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}, "P01.csv": {"as_written": "B3"}})
    assert "P02" not in {fault.name for fault in ingest(small, lab, QUIET).faults}
    assert columns() == ["file", "role", "sample", "unit", "as_written", "question"]


FAULTS = (
    "line 2: P01.png cannot be 'readings'; write one of photo, mask, ignore.",
    "line 3: 'gone.png' is no file that is read",
    "line 5: 'P02.stl' is no file that is read",
)


def test_a_pairing_that_cannot_be_is_refused_with_all_its_rows(small, tmp_path):
    (lab := tmp_path / "lab").mkdir()
    rows = "P01.png,readings,P01\ngone.png,photo,P01\nP02.png,photo,\nP02.stl,readings,P02\n"
    (lab / "pairing.csv").write_text("file,role,sample\n" + rows)
    (small / "P02.stl").write_bytes(b"solid")
    with pytest.raises(InputError) as refusal:
        ingest(small, lab, QUIET)
    for sentence, words in zip(str(refusal.value).splitlines(), FAULTS, strict=True):
        assert words in sentence
    assert {path.name for path in lab.iterdir()} <= {"pairing.csv", ".lock"}
