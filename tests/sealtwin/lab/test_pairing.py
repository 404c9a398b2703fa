"""What names say of files is done beyond doubt and asked otherwise; pairing.csv is corrected, kept and refused."""

import re
import shutil
from pathlib import PurePath

import pytest

from sealtwin.core.errors import InputError
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.file_owners import place_files, with_owners
from sealtwin.lab.file_parts import Piece
from sealtwin.lab.found_files import FilePlace, read_name, read_names
from sealtwin.lab.ingest import ingest
from sealtwin.lab.pairing import pair
from tests.labs import QUIET, answer, edit, fates, question
from validate.readings.header_words import sample_key

SPELLINGS = {
    "photo": (
        "P01.jpg", "p-01_top.JPEG", "photos/P 01.png", "Fotos/P01 Draufsicht.png", "P01_Foto.tif", "P01/IMG_2041.jpg",
        "P01/P01.webp", "P01_second.jpg",
    ),
    "mask": ("P01_mask.png", "masks/P01.png"),
    "readings": (
        "P01.csv", "p.01 Messung.xlsx", "caliper/P01.txt", "P01/Messwerte.tsv", "Tiefen P01.csv", "P01 mesures.txt",
        "Relevés/P01.csv", "P01_profondeur.csv", "P01 lecturas.xlsx", "Höhen P01.csv", "P01_Pegel.csv",
    ),
    "note": ("P01.toml", "P01 observaciones.csv", "P01_notes.csv", "Protokolle/P01.xlsx", "P01/Notiz.csv"),
}  # fmt: skip


def _read(name):
    named = read_name(PurePath(name))
    assert named is not None
    return named


def test_one_sample_however_its_files_are_named():
    roles = {name: (sample_key(_read(name).sample), _read(name).role) for names in SPELLINGS.values() for name in names}
    assert roles == {name: ("p01", role) for role, names in SPELLINGS.items() for name in names}
    for name in ("report.pdf", "P01", "P01.docx", "P01.stl"):
        assert read_name(PurePath(name)) is None
    # A camera's name and a remark are no part of a sample's.
    for name in ("IMG_0412_P4.jpg", "P4 readings.xlsx", "20260503_142233_P4.jpg", "P4 (von oben).jpg"):
        assert sample_key(_read(name).sample) == "p4", name


@pytest.mark.parametrize(
    ("one", "other"),
    [("May/P01.jpg", "June/P01.jpg"), ("1-11.jpg", "11-1.jpg"), ("P01.jpg", "P1.jpg")],
)
def test_what_may_be_two_samples_is_two(one, other):
    assert sample_key(_read(one).sample) != sample_key(_read(other).sample)


def test_a_name_with_markup_or_mathtext_becomes_a_plain_label():
    assert not set(_read("<b onload=x>P$_{1}$.png").sample) & set("<>$={}&\"'/\\")


def _paired(*names, decided=None):
    named = {Piece(file): name for file, name in read_names(map(PurePath, names), "?").items()}
    named = with_owners(named, [place.sample for place in named.values() if place.role == "photo"])
    samples = pair(place_files(named, decided or {}))
    return {sample.key: sample for sample in samples}


def _questions(*names, decided=None):
    return {key: sample.questions for key, sample in _paired(*names, decided=decided).items() if sample.questions}


def test_photo_sheet_and_note_of_one_name_are_one_sample():
    samples = _paired("a/P01_top.jpg", "a/p-01 Messung.csv", "a/P01.toml", "a/P02.jpg")
    files = {"photo": "a/P01_top.jpg", "readings": "a/p-01 Messung.csv", "note": "a/P01.toml"}
    assert {role: str(file) for role, file in samples["ap01"].files.items()} == files
    assert samples["ap01"].name == "a-P01"
    assert not samples["ap01"].questions
    assert list(samples["ap02"].files) == ["photo"]
    # Traced photos as they come from the camera are samples; beside a sheet of another name they are views of one.
    assert list(_paired("May/IMG_2041.jpg", "May/IMG_2041.toml", "May/IMG_2042.jpg")) == ["mayimg2041", "mayimg2042"]


def test_a_sheet_one_letter_off_is_asked_about_with_the_photos_that_lack_one():
    assert not _questions("P01.jpg", "P01.csv", "P02.jpg", "P02.csv", "P03.jpg"), "whole samples may have near names"
    asked = _questions("P01.jpg", "P02.jpg", "P02.csv", "P0l.csv")
    assert list(asked) == ["p0l"], "a photo without a sheet is taken in; its answer makes a revision of it"
    assert "Is it of P01.jpg? If so, write P01 into the column sample" in asked["p0l"][0]


@pytest.mark.parametrize(
    ("names", "sample", "question"),
    [
        pytest.param(("May/P01.jpg", "Readings 2026/P01.csv"), "2026p01", "Is it of May/P01.jpg?", id="another folder"),
        pytest.param(("P02.jpg", "P02.csv", "P02 alt.csv"), "p02", "2 files are its readings", id="another sheet"),
        pytest.param(("P1.jpg", "P1.csv", "P1_2.csv", "P3.jpg"), "p1-2", "Photos without readings: P3.jpg", id="taken"),
        pytest.param(("P01.jpg", "P02.jpg", "P03.csv"), "p03", "Is it of P02.jpg, P01.jpg?", id="all photos are named"),
        pytest.param(("photo.jpg",), "", "its name gives no sample", id="no sample"),
        pytest.param(
            ("P01_before.jpg", "P01_after.jpg", "P01.csv"),
            "p01",
            "2 files are its photo: P01_before.jpg",
            id="two photos",
        ),
    ],
)
def test_of_words_about_a_name_none_is_guessed(names, sample, question):
    asked = _paired(*names)[sample]
    assert any(question in one for one in asked.questions)
    assert "its photo" not in question or "photo" not in asked.files


@pytest.mark.parametrize(
    "name",
    [
        "Sealing tests 2026 - L06.csv", "L06 2026-05-12 09-30-00.csv", "12.05.2026 L06.csv", "260512 L06 v2.csv",
        "L06_093000.csv", "L06 2026-05-12 14.30.xlsx", "L06_12052026.csv", "3.5.2026/L06.csv", "p L06 depths.txt",
        "L06 readings FINAL v2.xlsx", "Serie/L06.csv",
    ],
)  # fmt: skip
def test_a_sheet_with_other_words_or_a_date_about_a_photos_name_is_its_own(name):
    sample = _paired("L06.jpg", name, "L060.jpg", "K12.jpg")["l06"]
    assert str(sample.files["readings"]) == name
    assert (sample.questions, sample.awaits) == ((), ())


@pytest.mark.parametrize(
    ("names", "host"),
    [
        (("L06.jpg", "L06_0007_profile.csv", "L07.jpg"), "L06"),
        (("P1.jpg", "P1-12-05-2026.csv"), "P1"),
        (("P1.jpg", "P1_20260512_0007.csv"), "P1"),
        (("P1.jpg", "P1_20261399.csv"), "P1"),
        (("12.jpg", "Messung 12.05.2026.csv"), "12"),
        (("P02.jpg", "P02 xyz 7.csv", "K07.jpg"), "P02"),
        (("P02.jpg", "P02 links.jpg", "P02 rechts.csv"), "P02"),
        (("A1.jpg", "A1 2.jpg", "A1 2 7.csv"), "A1 2"),
    ],
)
def test_a_sheet_with_another_number_is_read_as_its_photos_but_asked_about(names, host):
    sheet = next(name for name in names if name.endswith(".csv"))
    sample = _paired(*names)[sample_key(host)]
    assert str(sample.files["readings"]) == sheet
    assert not sample.questions
    (question,) = sample.awaits
    assert question.startswith(f"{sheet}:")
    assert f"Is it of {host}.jpg? If so, write {host} into the column sample" in question
    # An answer in its row alone does not pair it; the sample, once written, does.
    own = read_names([PurePath(sheet)], "?")[PurePath(sheet)]
    for place, asked in (
        (FilePlace(own.sample, "readings", answers={"unit": "mm"}), 1),
        (FilePlace(host, "readings"), 0),
    ):
        again = _paired(*names, decided={(PurePath(sheet), ""): place})[sample_key(host)]
        assert (str(again.files["readings"]), len(again.awaits)) == (sheet, asked)


@pytest.mark.parametrize(
    ("names", "hosts"),
    [(("P1.jpg", "P1_1.csv", "P1_2.csv"), ("p1",)), (("A07.jpg", "A08.jpg", "A07 A08.csv"), ("a07", "a08"))],
)
def test_a_sample_with_several_likely_sheets_or_a_sheet_of_several_samples_waits(names, hosts):
    samples = _paired(*names)
    for host in hosts:
        assert list(samples[host].files) == ["photo"]
        assert {one.partition(":")[0] for one in samples[host].awaits} == {one for one in names if one.endswith(".csv")}


@pytest.mark.parametrize(
    ("names", "waiting"),
    [
        (("K05.jpg", "K05.csv", "K06.jpg", "Blatt 1.csv"), {"K06"}),
        (("K05.jpg", "K06.jpg", "Blatt.toml", "Blatt.csv"), {"K05", "K06"}),
        (("K05.jpg", "K06.jpg", "K07.csv"), set()),
        (("K05.jpg", "K06.jpg", "Z05.csv"), {"K05"}),
        (("K01.jpg", "K06.jpg", "KO1.csv"), {"K01"}),
        (("K05.jpg", "K06.jpg", "Probe 7.csv"), {"K05", "K06"}),
        (("K05.jpg", "K05.csv", "Blatt 1.csv"), set()),
    ],
)
def test_samples_without_readings_wait_for_a_sheet_that_may_be_theirs(names, waiting):
    samples = _paired(*names)
    assert {one.name for one in samples.values() if one.awaits} == waiting
    sentences = {sentence for one in samples.values() for sentence in (*one.questions, *one.awaits)}
    assert len(sentences) == 1 or not waiting, "said once"
    assert all(names[-1] in sentence for sentence in sentences)


@pytest.mark.parametrize(("name", "waits"), [(".Blatt.csv.icloud", True), (".P01.jpg.icloud", False)])
def test_a_sample_without_readings_waits_for_a_sheet_that_is_not_read(small, tmp_path, name, waits):
    (small / "P01.csv").unlink()
    (small / name).touch()
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "failed" if waits else "new", "P02": "new"}


def test_pairing_and_content_of_a_likely_sheet_are_asked_together_and_hold_its_sample(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "P02_0007.csv")
    edit(small / "P02_0007.csv", "[mm]", "")
    for dry_run in (True, False):
        ingested = ingest(small, lab, QUIET, dry_run=dry_run)
        assert fates(ingested) == {"P01": "new", "P02": "failed"}
    assert {fault.name for fault in Catalogue.of(lab).faults()} == {"P02"}, "by which 'lab run' leaves it out"
    assert "column sample" in question(lab, "P02_0007.csv")
    assert "no unit" in question(lab, "P02_0007.csv")
    assert question(lab, "P02.png") == ""
    answer(lab, {"P02_0007.csv": {"unit": "mm"}})
    assert [fault.sentence.partition(":")[0] for fault in ingest(small, lab, QUIET).faults] == ["P02_0007.csv"]
    answer(lab, {"P02_0007.csv": {"unit": "mm", "sample": "P02"}})
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "new"}


@pytest.mark.parametrize("ending", [".lvm", ".dat"])
def test_a_text_table_is_a_sheet_by_its_content(small, tmp_path, ending):
    (small / "P01.csv").rename((small / "P01.csv").with_suffix(ending))
    (small / "binary.dat").write_bytes(bytes(range(256)))
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "new", "P02": "new"}
    assert str(ingested.outcomes[0].sample.files["readings"]) == f"P01{ending}"


NUMBERS = "P01\n5: 1.2 / 1.3\n10: 1.4 / 1.5\n15: 1.6 / 1.7\n"


@pytest.mark.parametrize("name", ["P01.md", "P01_3.xyz"])
def test_a_sample_without_readings_waits_for_a_text_whose_lines_may_be_some(small, tmp_path, name):
    (small / name).write_text(NUMBERS)
    (small / "P01.pdf").write_text("Nothing")
    ingested = ingest(small, tmp_path / "with", QUIET)
    assert fates(ingested)["P01"] == ("new" if "_3" in name else "failed"), (
        "it has readings, but its own texts have numbers"
    )
    assert [each.file for each in ingested.left_out if "ending" in each.reason] == ["P01.pdf"]
    (small / "P01.csv").unlink()
    lab = tmp_path / "lab"
    assert fates(ingest(small, lab, QUIET)) == {"P01": "failed", "P02": "new"}
    assert "readings" in question(lab, name)
    for role, fate in (("ignore", "new"), ("readings", "failed")):
        answer(lab, {name: {"role": role, "sample": "P01"}})
        ingested = ingest(small, lab, QUIET)
        assert fates(ingested)["P01"] == fate
    assert str(ingested.outcomes[0].sample.files["readings"]) == name


FAULTS = (
    "line 2: P01.png cannot be 'readings'; write one of photo, mask, ignore.",
    "line 3: no file 'gone.png'",
    "line 4: P01.csv has no sample",
    "line 6: P02.png has two rows",
    "line 7: 'P02.stl' is not used: its ending is not read",
)


def test_the_pairing_is_shown_corrected_and_remembered(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "PO2_Messung.csv")
    shutil.copy(small / "P01.png", small / "P01_side.png")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "failed", "P02": "failed", "PO2": "failed"}
    pairing = lab / "pairing.csv"
    edit(pairing, "PO2_Messung.csv,readings,PO2,", "PO2_Messung.csv,readings,p-02,")
    edit(pairing, "P01_side.png,photo,P01", "P01_side.png,ignore,")
    # Saved by a German spreadsheet, and in another order.
    head, *rows = [line.split(",")[:3] for line in pairing.read_text().splitlines()]
    corrected = "\r\n".join(";".join(row) for row in (head, *reversed(rows)))
    pairing.write_bytes(corrected.encode("utf-8-sig"))
    assert not [outcome.faults for outcome in ingest(small, lab, QUIET, dry_run=True).outcomes if outcome.faults]
    assert pairing.read_bytes() == corrected.encode("utf-8-sig"), "a dry run leaves it as it is"
    assert fates(ingest(small, lab, QUIET)) == {"P01": "new", "P02": "new"}
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    (lab / "catalogue.json").unlink()
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}, "pairing.csv outlives it"


@pytest.mark.parametrize(
    ("header", "cells", "words"),
    [
        ("unti", "mm", "no such column 'unti'; did you mean 'unit'?"),
        ("Bemerkung", "", "no such column 'Bemerkung'; delete it; allowed are file, role, sample, part,"),
        ("", "mm", "'mm' is in a column without a name"),
    ],
)
def test_an_answer_in_a_column_without_a_known_name_is_refused(small, tmp_path, header, cells, words):
    pairing = tmp_path / "pairing.csv"
    pairing.write_text(f"file,role,sample,{header}\nP01.csv,readings,P01,{cells}\n")
    with pytest.raises(InputError, match=re.escape(words)):
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)


def test_the_pairing_has_only_columns_that_are_asked_for_or_answered(small, tmp_path):
    lab = tmp_path / "lab"

    def columns():
        return (lab / "pairing.csv").read_text().splitlines()[0].split(",")

    ingest(small, lab, QUIET)
    assert columns() == ["file", "role", "sample", "question"]
    edit(small / "P02_Messung.csv", "[mm]", "")
    ingest(small, lab, QUIET)
    assert columns() == ["file", "role", "sample", "unit", "question"]
    # By hand: a column that nothing asks for, in another place.
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}, "P01.csv": {"as_written": "B3"}})
    assert "P02" not in {fault.name for fault in ingest(small, lab, QUIET).faults}
    assert columns() == ["file", "role", "sample", "unit", "as_written", "question"]
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}, "P01.csv": {"as_written": ""}})
    ingest(small, lab, QUIET)
    assert columns() == ["file", "role", "sample", "unit", "question"]


def test_a_pairing_that_cannot_be_is_refused_with_all_its_rows(small, tmp_path):
    pairing = tmp_path / "pairing.csv"
    pairing.write_text(
        "file,role,sample\nP01.png,readings,P01\ngone.png,photo,P01\nP01.csv,note,\nP02.png,photo,P02\nP02.png,photo,P3\n"
        "P02.stl,readings,P02\n"
    )
    (small / "P02.stl").write_bytes(b"solid")
    with pytest.raises(InputError) as refusal:
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)
    for sentence, words in zip(str(refusal.value).splitlines(), FAULTS, strict=True):
        assert words in sentence
    assert not (tmp_path / "lab").exists()
    with pytest.raises(InputError, match=r"gone\.csv: no such file; 'sealtwin ingest FOLDER"):
        ingest(small, tmp_path / "lab", QUIET, pairing=tmp_path / "gone.csv")
    pairing.write_text("file,role,sample\nP01.png,photo,../../x\n")
    with pytest.raises(
        InputError, match=r"P01.png: a sample '../../x'; names may have letters, digits, spaces and -_. only"
    ):
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)
