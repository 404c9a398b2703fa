"""Pairing of files with samples by their names, and questions in pairing.csv if names are ambiguous."""

import csv
import re
from pathlib import Path, PurePath

import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.lab.files import place_of
from sealtwin.lab.ingest import ingest
from sealtwin.lab.sample import pair
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import (
    QUIET,
    add_rows,
    answer,
    fates,
    hashes_of,
    levels_mm,
    pairing_rows,
    question,
)

SPELLINGS = {
    "photo": (
        "P01.jpg", "p-01_top.JPEG", "photos/P 01.png", "Fotos/P01 Draufsicht.png", "P01_Foto.tif", "P01/photo.jpg",
        "P01/P01.webp", "P01_second.jpg", "IMG_20261127_P01.jpg", "DSC_20261127_101502_P01.JPG",
    ),
    "mask": ("P01_mask.png", "masks/P01.png"),
    "readings": (
        "P01.csv", "p.01 Messung.xlsx", "caliper/P01.dat", "P01/Messwerte.tsv", "Tiefen P01.csv", "P01 mesures.txt",
        "Relevés/P01.csv", "P01_profondeur.csv", "P01 lecturas.xlsx", "Höhen P01.csv", "P01_Pegel.csv",
    ),
    "scan": ("P01.ply", "P01_scan.stl", "scans/P01.xyz", "P01 heightmap.png"),
    "fill": ("P01 Wasser.xlsx", "P01_fill.csv"),
}  # fmt: skip


def test_file_names_in_different_spellings_belong_to_the_same_sample():
    positions = {name: place_of(PurePath(name)) for names in SPELLINGS.values() for name in names}
    roles = {name: (position.key, position.role) for name, position in positions.items() if position}
    assert roles == {name: ("p01", role) for role, names in SPELLINGS.items() for name in names}
    others = "report.pdf", "P01", "P01.docx", "P01.toml", "P01.txt", "P01 Notiz.md"
    assert [place_of(PurePath(name)) for name in others] == [None] * len(others)


OTHERS = "June/P01.jpg", "P1.jpg", "P01'.jpg", "P01 (2).jpg", "IMG_0412_P01.jpg", "P01 2026-05-12.jpg", "PO1.jpg"


@pytest.mark.parametrize("name", OTHERS)
def test_file_names_that_are_only_similar_belong_to_other_samples(name):
    """A date or a camera's word in front is ignored, but no number of a picture, no remark and no prime."""
    assert getattr(place_of(PurePath(name)), "key", "p01") != "p01"


def test_a_sample_whose_folder_name_is_taken_gives_a_question(small, tmp_path):
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
    ],
)
def test_photos_without_a_sheet_give_a_question_if_a_sheet_has_no_photo(names, waiting):
    samples = _paired(*names.split())
    assert {name for name, sample in samples.items() if sample.files.get("readings") == []} == waiting
    questions = [question for sample in samples.values() for question in sample.questions.values()]
    others = {name for name in names.split() if name[:3] not in ("K05", "K06")}
    assert {f"{file}" for question in questions for file in question.rows} == {
        f"{name}.jpg" for name in waiting
    } | others


def test_answers_in_pairing_csv_are_applied_and_kept(small, tmp_path):
    lab, unchanged = tmp_path / "lab", {"P01": "unchanged", "P02": "unchanged"}
    (small / "P02_Messung.csv").rename(small / "Q02 inch.csv")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "new", "P02": "failed", "Q02 inch": "failed"}
    answer(lab, {"Q02 inch.csv": {"sample": "p-02"}})
    ingested = ingest(small, lab, QUIET)
    assert fates(ingested) == unchanged | {"P02": "revised"}
    assert [[*sample.remarks] for sample in ingested.samples] == [
        [],
        ["Q02 inch.csv: name of the file has the remark 'Q02 inch'."],
    ]
    with (lab / "catalogue.csv").open(newline="", encoding="utf-8") as table:
        assert [row["remarks"] for row in csv.DictReader(table)] == ["0", "1"]
    assert fates(ingest(small, lab, QUIET)) == unchanged
    # A German spreadsheet saves the table so; the rows are in another order.
    head, *rows = (lab / "pairing.csv").read_text().replace(",", ";").splitlines()
    saved = "\r\n".join((head, *reversed(rows))).encode("utf-8-sig")
    (lab / "pairing.csv").write_bytes(saved)
    assert not ingest(small, lab, QUIET, dry_run=True).faults
    assert (lab / "pairing.csv").read_bytes() == saved, "a dry run leaves it as it is"
    (lab / "catalogue.json").unlink()
    assert fates(ingest(small, lab, QUIET)) == unchanged, "pairing.csv outlives it"


TABLE = "s [mm];Pegel 1 [mm]\n1;-1,0\n11;-1,5\n;\ns [mm];Pegel 1 [mm]\n1;-2,0\n11;-2,5\n"


def test_a_sheet_of_several_samples_is_split_by_rows_of_pairing_csv(small, tmp_path):
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


def test_unit_and_direction_of_a_scan_are_asked_in_one_round(small, tmp_path):
    lab, key = tmp_path / "lab", "readings.placement."
    for sheet in ("P01.csv", "P02_Messung.csv"):
        (small / sheet).unlink()
    (small / "P01.xyz").write_text("0 0 0\n")
    (small / "P02_scan.png").write_bytes(b"")
    ingest(small, lab, QUIET)
    for photo, names in {"P01.png": ["units", "up"], "P02.png": ["step_mm", "count_mm"]}.items():
        assert re.findall(rf"{key}(\w+) is missing", question(lab, photo)) == names
    answer(lab, {"P01.xyz": {f"{key}units": "mm", f"{key}up": "-z"}})
    answer(lab, {"P02_scan.png": {f"{key}step_mm": "0.1", f"{key}count_mm": "-0.01"}})
    assert not ingest(small, lab, QUIET).faults
    trials = [load_trial(lab / sample / "trial.toml").readings for sample in ("P01", "P02")]
    first, second = (present(present(readings, "readings").placement, "placement") for readings in trials)
    assert (first.units, first.up, second.step_mm, second.count_mm) == ("mm", "-z", 0.1, -0.01)


@pytest.mark.parametrize("header", ["unti", ""])
def test_an_answer_in_an_unknown_column_of_pairing_csv_is_refused(small, lab, header):
    (lab / "pairing.csv").write_text(f"file,role,sample,{header}\nP01.csv,readings,P01,mm\n")
    with pytest.raises(
        InputError, match=f"'mm' is in the column '{header}'; allowed columns are file, role, sample, s,"
    ):
        ingest(small, lab, QUIET)


def test_all_impossible_rows_of_pairing_csv_are_refused_together(small, tmp_path):
    (lab := tmp_path / "lab").mkdir()
    rows = "P01.png,readings,P01\ngone.png,photo,P01\nP02.png,photo,\nP02.stl,readings,P02\n"
    (lab / "pairing.csv").write_text("file,role,sample\n" + rows)
    (small / "P02.stl").write_bytes(b"solid")
    faults = (
        "line 2: P01.png cannot have the role 'readings'.*photo, mask, scan, ignore",
        "line 3: 'gone.png'",
        "line 5: P02.stl cannot have the role 'readings'.*scan, ignore",
    )
    with pytest.raises(InputError, match="^.*" + ".*\n.*".join(faults) + ".*$"):
        ingest(small, lab, QUIET)
    assert {path.name for path in lab.iterdir()} <= {"pairing.csv", ".lock"}


UNKNOWN = "Stelle;a;b\n1;1,5;1,6\n5;1,4;1,5\n11;1,6;1,7\n"


def test_unnamed_columns_are_assigned_by_letters_in_pairing_csv(small, tmp_path):
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
