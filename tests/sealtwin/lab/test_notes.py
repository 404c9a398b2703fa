"""Settings of samples from notes, from lab.toml and from weighed fills."""

import json
from pathlib import PurePath

import numpy as np
import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.lab.ingest import ingest
from sealtwin.lab.notes import Note, read_note
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, answer, pairing_rows, sealtwin
from tests.support.lab_folder import NOTES


def note_of(folder, name, text):
    """Write a note of P01 and return its settings and faults."""
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    read_note(folder, PurePath(name), "p01", note := Note())
    return note


SETTINGS = "crack.depth_mm = 8.0", "operator = 'A. Muster'", "operator = 'M\xfcller'".encode("latin-1"), b"\x81 9"
WORDS = "Kante ausgebrochen", "Probe P-01", "Wetter = 'trocken'"


@pytest.mark.parametrize("text", [*SETTINGS, *WORDS])
def test_a_text_note_that_may_give_a_setting_is_asked_about(tmp_path, text):
    note = note_of(tmp_path, "P01.txt", text)
    assert ["is not read" in fault.finding for fault in note.faults] == [True] * (text in SETTINGS)
    assert not note.values


def test_the_scale_of_a_sample_replaces_any_scale_of_the_folder():
    folder = Note(dict.fromkeys(("photo.mm_per_px", "crack.depth_mm", "fluid.U"), 1.0))
    sample = Note(dict.fromkeys(("photo.face_mm", "fluid.viscosity_pa_s"), 1.0))
    assert {*sample.over(folder).values} == {"photo.face_mm", "fluid.viscosity_pa_s", "crack.depth_mm"}


P01 = str(NOTES["P01"][1])
TRACED = 'name = "P01"\n[photo]\nfile = "{}"\ndata = "measured"\nmm_per_px = 0.1\n[crack]\ndepth_mm = 8.0\n'
"""A trial as 'sealtwin trace' writes it: it names its photo, which must be the one beside it."""


def test_all_faults_of_lab_toml_are_listed_together_and_stop_the_ingest(small, tmp_path):
    faulty = 'data = "measured"\nname = "all"\n[photo]\nmm_per_pxl = 0.1\nscale = 2\n[readings]\nas_written = ["C4"]\n'
    (small / "lab.toml").write_text(faulty)
    with pytest.raises(InputError, match=r"lab\.toml: ") as refusal:
        ingest(small, tmp_path / "lab", QUIET)
    faults = "photo.mm_per_pxl = '0.1': there is no such", "photo.scale = '2': there is no such", "as_written"
    lines = str(refusal.value).splitlines()
    assert [sum(fault in line for line in lines) for fault in faults] == [1, 1, 1]
    assert len(lines) == 3


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (TRACED.format("P02.png"), "photo.file = 'P02.png', but the sample's photo is P01.png"),
        (f'{P01}mask = "P01_mask.png"\n', "photo.mask = 'P01_mask.png', but the sample's mask is no file"),
        ("a." * 60_000 + "b = 1", "a dotted key has more than 16 parts"),
    ],
)
def test_a_contradictory_or_unreadable_note_gives_exactly_one_fault(small, tmp_path, text, sentence):
    (small / "P02_Messung.csv").unlink()
    (small / "P01.toml").write_text(text)
    faults = [fault.sentence for fault in ingest(small, tmp_path / "lab", QUIET).faults]
    assert [f"P01.toml: {sentence}" in fault for fault in faults if "missing" not in fault] == [True]


@pytest.fixture
def poured(small):
    """The small folder with a weighed fill of P01, whose crack is 12 x 2 x 8 mm with upright walls."""
    steps = ((12 * 2 * 8 * (1 + z / 8) * 0.998e-3, z) for z in np.linspace(-6.0, 0.0, 5))
    rows = [f"{mass_g:.3f},{z}" for mass_g, z in steps]
    (small / "P01 Wasser.csv").write_text("\n".join(["mass_g,level_mm", *rows]))
    note = (small / "lab.toml").read_text().replace('tilt = "vertical"', "wall_angle_deg = 5.0")
    (small / "lab.toml").write_text(note + "[crack.fill]\nmass_sd_g = 0.02\n[uncertainty]\nwidth_mm = 0.1\n")
    return small


def test_a_weighed_fill_beside_the_readings_is_copied_and_used_for_the_solid(poured, tmp_path):
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
