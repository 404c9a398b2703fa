"""Settings come from TOML and from texts of key = value alone; all else is asked about."""

from pathlib import PurePath

import pytest

from sealtwin.core.errors import present
from sealtwin.lab.ingest import ingest
from sealtwin.lab.notes import Note, read_note
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, answer, fates, question
from tests.support.lab_folder import ANSWER, TEXTS, make_lab_folder, write_texts


def _depth_mm(lab, trial):
    return present(load_trial(lab / trial / "trial.toml").crack, "crack").depth_mm


def test_texts_in_the_words_of_labs_are_not_read_and_hold_their_samples_until_answered(tmp_path):
    folder, lab = make_lab_folder(tmp_path / "folder"), tmp_path / "lab"
    write_texts(folder)
    (folder / "README.txt").write_text("Fotos vom 3. Mai")
    states = fates(ingest(folder, lab, QUIET))
    assert {name for name, state in states.items() if state == "failed"} == {*TEXTS, "README.txt"}
    for name, _ in TEXTS.values():
        assert "is not read, since not each of its lines is key = value" in question(lab, name)
    answer(lab, {"README.txt": {"role": "ignore"}, **{name: {"settings": ANSWER} for name, _ in TEXTS.values()}})
    assert set(fates(ingest(folder, lab, QUIET)).values()) == {"revised", "unchanged"}
    assert all(_depth_mm(lab, sample) == 8 for sample in TEXTS)
    assert (lab / "P03/inputs/note.txt").read_bytes() == (folder / "P03.txt").read_bytes()
    assert set(fates(ingest(folder, lab, QUIET)).values()) == {"unchanged"}


@pytest.mark.parametrize(
    ("text", "depth_mm"),
    [
        ("crack.depth_mm = 8.0\n\noperator = 'A. Muster'\n", 8.0),
        ("crack.depth_mm = 8.0 # or 9?", None),
        ("# P01\ncrack.depth_mm = 8.0", None),
        ("crack.depth_mm = 8,5", None),
        ("crack.depth_mm = 8\ndepth_mm = 8", None),
        ("Risstiefe ½ cm", None),
        ("Siehe P02.", None),
        ("crack.tilt = lean", None),
        ("x = " + "[" * 5000 + "1", None),
        ("Wort " * 50_000, None),
        ("crack.depth_mm = 8\noperator = 'M\xfcller'".encode("latin-1"), None),
        (b"\x81\x00\xff\x9d9" * 9, None),
    ],
)
def test_a_text_is_read_if_each_of_its_lines_is_a_setting_and_is_open_if_not(tmp_path, text, depth_mm):
    (tmp_path / "P01.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    read_note(tmp_path, PurePath("P01.txt"), "p01", note := Note())
    assert note.values.get("crack.depth_mm") == depth_mm
    assert ["is not read" in fault.finding for fault in note.faults] == [True] * (depth_mm is None)


@pytest.mark.parametrize("text", ["Kante ausgebrochen", "Probe P-01", "Wetter = 'trocken'"])
def test_a_text_without_a_number_sets_nothing(tmp_path, text):
    (tmp_path / "P01.txt").write_text(text)
    read_note(tmp_path, PurePath("P01.txt"), "p01", note := Note())
    assert note == Note()


def test_toml_has_the_trials_own_keys(tmp_path):
    (tmp_path / "P01.toml").write_text(
        'data = "measured"\ndate = 2026-05-03\ncrack.depth_mm = 16\ndepht_mm = 3\nreadings.quantity = "depth"\n'
        "[photo]\nmm_per_pixl = 0.1\n"
    )
    read_note(tmp_path, PurePath("P01.toml"), "p01", note := Note())
    assert note.values == {
        "photo.data": "measured", "readings.data": "measured", "date": "2026-05-03", "crack.depth_mm": 16,
        "readings.quantity": "depth",
    }  # fmt: skip
    for key, fault in zip(("depht_mm", "photo.mm_per_pixl"), note.faults, strict=True):
        assert f"{key} = " in fault.finding


def test_a_table_of_samples_is_asked_about_and_its_settings_go_into_their_rows(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P01.toml").unlink()
    (small / "Tiefen Mai.csv").write_text("sample;crack.depth_mm\nP01;7,5\n")
    assert fates(ingest(small, lab, QUIET))["Mai"] == "failed"
    assert "no photo is called 'Mai'" in question(lab, "Tiefen Mai.csv")
    settings = "crack.depth_mm = 7.5; photo.ends_px = [[40, 101], [160, 98]]"
    answer(lab, {"Tiefen Mai.csv": {"role": "ignore"}, "P01.png": {"settings": settings}})
    assert not ingest(small, lab, QUIET).faults
    assert _depth_mm(lab, "P01") == 7.5


def test_a_samples_own_scale_takes_the_place_of_the_folders_whatever_its_kind():
    folder = Note(dict.fromkeys(("photo.mm_per_px", "crack.depth_mm", "fluid.U"), 1.0))
    own = Note(dict.fromkeys(("photo.face_mm", "fluid.viscosity_pa_s"), 1.0))
    assert set(own.over(folder).values) == {"photo.face_mm", "fluid.viscosity_pa_s", "crack.depth_mm"}
