"""What notes, lab.toml and fills say of samples: read, asked about, or refused in one sentence."""

import json
from pathlib import PurePath

import numpy as np
import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.lab.ingest import ingest
from sealtwin.lab.notes import Note, read_note
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, answer, edit, fates, pairing_rows, question, sealtwin
from tests.support.lab_folder import ANSWER, NOTES, TEXTS, make_lab_folder, write_texts


def note_of(folder, name, text):
    """Return what is read of a note of P01."""
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    read_note(folder, PurePath(name), "p01", note := Note())
    return note


def _depth_mm(lab, trial):
    return present(load_trial(lab / trial / "trial.toml").crack, "crack").depth_mm


def test_texts_in_the_words_of_labs_are_not_read_and_hold_their_samples_until_answered(tmp_path):
    folder, lab = make_lab_folder(tmp_path / "folder"), tmp_path / "lab"
    write_texts(folder)
    (folder / "README.txt").write_text("Fotos vom 3. Mai")
    states = fates(ingest(folder, lab, QUIET))
    assert {name for name, state in states.items() if state == "failed"} == {*TEXTS, "README.txt"}
    for name, _ in TEXTS.values():
        assert "is not read, since some lines are not key = value" in question(lab, name)
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
        ("crack.depth_mm = 8\ndepth_mm = 8", None),
        ("crack.tilt = lean", None),
        ("x = " + "[" * 5000 + "1", None),
        ("Wort " * 50_000, None),
        ("crack.depth_mm = 8\noperator = 'M\xfcller'".encode("latin-1"), None),
        (b"\x81\x00\xff\x9d9" * 9, None),
    ],
)
def test_a_text_is_read_if_each_of_its_lines_is_a_setting_and_is_open_if_not(tmp_path, text, depth_mm):
    note = note_of(tmp_path, "P01.txt", text)
    assert note.values.get("crack.depth_mm") == depth_mm
    assert ["is not read" in fault.finding for fault in note.faults] == [True] * (depth_mm is None)


@pytest.mark.parametrize("text", ["Kante ausgebrochen", "Probe P-01", "Wetter = 'trocken'"])
def test_a_text_without_a_number_sets_nothing(tmp_path, text):
    assert note_of(tmp_path, "P01.txt", text) == Note()


def test_toml_has_the_trials_own_keys(tmp_path):
    text = 'data = "measured"\ndate = 2026-05-03\ncrack.depth_mm = 16\ndepht_mm = 3\nreadings.quantity = "depth"\n'
    note = note_of(tmp_path, "P01.toml", f"{text}[photo]\nmm_per_pixl = 0.1\n")
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
    assert "there is no photo with the name 'Mai'" in question(lab, "Tiefen Mai.csv")
    settings = "crack.depth_mm = 7.5; photo.ends_px = [[40, 101], [160, 98]]"
    answer(lab, {"Tiefen Mai.csv": {"role": "ignore"}, "P01.png": {"settings": settings}})
    assert not ingest(small, lab, QUIET).faults
    assert _depth_mm(lab, "P01") == 7.5


def test_a_samples_scale_takes_the_place_of_the_folders_whatever_its_kind():
    folder = Note(dict.fromkeys(("photo.mm_per_px", "crack.depth_mm", "fluid.U"), 1.0))
    sample = Note(dict.fromkeys(("photo.face_mm", "fluid.viscosity_pa_s"), 1.0))
    assert {*sample.over(folder).values} == {"photo.face_mm", "fluid.viscosity_pa_s", "crack.depth_mm"}


P01 = str(NOTES["P01"][1])
TRACED = 'name = "P01"\n[photo]\nfile = "{}"\ndata = "measured"\nmm_per_px = 0.1\n[crack]\ndepth_mm = 8.0\n'
"""A trial as 'sealtwin trace' writes it: it names its photo, which must be the one beside it."""


def test_all_faults_of_lab_toml_are_told_at_once_and_stop_all(small, tmp_path):
    faulty = 'data = "measured"\nname = "all"\n[photo]\nmm_per_pxl = 0.1\nscale = 2\n[readings]\nas_written = ["C4"]\n'
    (small / "lab.toml").write_text(faulty)
    with pytest.raises(InputError, match=r"lab\.toml: ") as refusal:
        ingest(small, tmp_path / "lab", QUIET)
    faults = "photo.mm_per_pxl = '0.1': there is no such", "photo.scale = '2': there is no such", "as_written"
    lines = str(refusal.value).splitlines()
    assert [sum(fault in line for line in lines) for fault in faults] == [1, 1, 1]
    assert len(lines) == 3


@pytest.mark.parametrize(
    ("fluid", "stress_pa", "viscosity_pa_s", "assumed"),
    [
        ("", 5.0, 0.3, True),
        ("[fluid]\nD_cm = 0.2\n", 5.0, 0.3, True),
        ("[fluid]\nU = 10.0\nD_cm = 0.3\nfreeze_after_s = 2.5\n", 0.0, None, False),
    ],
)
def test_what_is_not_said_of_the_fluid_is_the_starters(small, tmp_path, fluid, stress_pa, viscosity_pa_s, assumed):
    """What a lab says of its paste is never added to: an age of freezing already holds the slope."""
    lab_toml = (small / "lab.toml").read_text()
    edit(small / "lab.toml", lab_toml[lab_toml.index("[fluid]") : lab_toml.index("[solver]")], fluid)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    trial = load_trial(tmp_path / "lab" / "P01" / "trial.toml")
    assert (trial.given_fluid.yield_stress_pa, trial.given_fluid.viscosity_pa_s) == (stress_pa, viscosity_pa_s)
    # Without a rest the jet, still falling, is read as a spike of the level.
    assert trial.solver.settle_s == 2.0
    # Every report shows the trial's note.
    for texts in (ingested.samples[0].remarks, [trial.note]):
        assert any("fluid.yield_stress_pa = 5.0" in text for text in texts) is assumed


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (TRACED.format("P02.png"), "photo.file = 'P02.png', but the sample's photo is P01.png"),
        (f'{P01}mask = "P01_mask.png"\n', "photo.mask = 'P01_mask.png', but the sample's mask is no file"),
        ("a." * 60_000 + "b = 1", "a dotted key has more than 16 parts"),
    ],
)
def test_a_note_that_contradicts_its_samples_files_or_cannot_be_is_the_one_fault(small, tmp_path, text, sentence):
    (small / "P02_Messung.csv").unlink()
    (small / "P01.toml").write_text(text)
    faults = [fault.sentence for fault in ingest(small, tmp_path / "lab", QUIET).faults]
    assert [f"P01.toml: {sentence}" in fault for fault in faults if "missing" not in fault] == [True]


@pytest.fixture
def poured(small):
    """The small folder with a CSV of what the crack of P01, 12 mm by 2 by 8 mm with upright walls, holds."""
    steps = ((12 * 2 * 8 * (1 + z / 8) * 0.998e-3, z) for z in np.linspace(-6.0, 0.0, 5))
    rows = [f"{mass_g:.3f},{z}" for mass_g, z in steps]
    (small / "P01 Wasser.csv").write_text("\n".join(["mass_g,level_mm", *rows]))
    note = (small / "lab.toml").read_text().replace('tilt = "vertical"', "wall_angle_deg = 5.0")
    (small / "lab.toml").write_text(note + "[crack.fill]\nmass_sd_g = 0.02\n[uncertainty]\nwidth_mm = 0.1\n")
    return small


def test_a_fill_beside_the_readings_is_copied_used_and_reported(poured, tmp_path):
    lab = tmp_path / "lab"
    asked = sealtwin("ingest", poured, "--out", lab, "--quiet").stdout
    (row,) = (row for row in pairing_rows(lab) if row["role"] == "fill")
    assert (row["file"], row["sample"]) == ("P01 Wasser.csv", "P01")
    assert "crack.tilt is missing: the steps of a fill require it" in asked
    answer(lab, {"P01 Wasser.csv": {"settings": 'crack.tilt = "funnel"'}})
    last = sealtwin("ingest", poured, "--out", lab, "--quiet")
    assert last.exit_code == 0, last.output
    trial = load_trial(lab / "P01" / "trial.toml")
    fill = present(present(trial.loaded(lab / "P01").crack, "crack").fill, "fill")
    assert (fill.level_mm, fill.mass_sd_g) == ((-6.0, -4.5, -3.0, -1.5, 0.0), 0.02)
    assert "wall_angle_deg" not in (trial.note or "")
    assert (lab / "P01" / "inputs" / "fill.csv").read_bytes() == (poured / "P01 Wasser.csv").read_bytes()
    weighed = json.loads((lab / "P01" / "run" / "solid.json").read_text())["weighed"]
    assert weighed["wall_angle_deg"] < 3.0, "the walls of what was poured are upright"
    other = present(load_trial(lab / "P02" / "trial.toml").crack, "crack")
    assert (other.fill, other.wall_angle_deg) == (None, 5.0), "the folder's words hold for the others"


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("P01 Wasser.csv", "mass_g", "Masse [g]", "expected a CSV"),
        ("P01 Wasser.csv", "-3.0", "-5.0", "row 4, column level_mm: -5 after -4.5"),
        ("P01 Wasser.xlsx", "", "PK", "CSV"),
    ],
)
def test_a_fill_that_cannot_be_read_is_asked_about_at_its_file(poured, tmp_path, name, old, new, words):
    file = (poured / "P01 Wasser.csv").rename(poured / name)
    file.write_text(file.read_text().replace(old, new))
    edit(poured / "lab.toml", "wall_angle_deg = 5.0", 'tilt = "funnel"')
    sealtwin("ingest", poured, "--out", tmp_path / "lab", "--quiet")
    asked = question(tmp_path / "lab", name)
    assert asked.startswith(name)
    assert words in asked
