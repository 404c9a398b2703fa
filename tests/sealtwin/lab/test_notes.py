"""Notes: keys of a trial become settings; every other number of a note or a text is quoted, and holds its sample."""

import pytest

from sealtwin.core.errors import present
from sealtwin.lab.ingest import ingest
from sealtwin.lab.notes import Note, NoteEntry
from sealtwin.trial.trial_file import load_trial
from tests.lab_folder import ANSWER, QUOTED, make_lab_folder, quote_notes
from tests.labs import QUIET, answer, edit, fates, question


def _read(folder, text, name="P01.toml"):
    (folder / name).write_text(text, encoding="utf-8")
    note = Note()
    return note, note.read(folder / name, "P01")


def test_notes_in_the_words_of_labs_are_quoted_and_hold_their_samples_until_answered(sound, tmp_path):
    """Broken on purpose by reading texts only if they are called notes: P03, P08 and P10 are new without a question."""
    folder, lab = make_lab_folder(tmp_path / "folder"), tmp_path / "lab"
    quote_notes(folder)
    states = fates(ingest(folder, lab, QUIET))
    assert {name for name, state in states.items() if state == "failed"} == QUOTED.keys()
    for name, _, quotations in QUOTED.values():
        assert question(lab, name).startswith(f"{name}: not read: {', '.join(quotations)}. Write settings")
    answer(lab, {name: {"settings": ANSWER} for name, _, _ in QUOTED.values()})
    outcomes = {outcome.sample.name: outcome for outcome in ingest(folder, lab, QUIET).outcomes}
    assert {outcome.fate for outcome in outcomes.values()} == {"new", "unchanged"}
    for sample, (name, _, quotations) in QUOTED.items():
        (remark,) = (one for one in outcomes[sample].remarks if one.startswith(f"{name}: not read: "))
        assert quotations[0] in remark
        trials = [load_trial(each / sample / "trial.toml") for each in (lab, sound[2])]
        assert trials[0].crack == trials[1].crack
        assert present(trials[0].photo, "photo").ends_px == present(trials[1].photo, "photo").ends_px
    assert set(fates(ingest(folder, lab, QUIET)).values()) == {"unchanged"}


def test_lines_of_a_text_are_settings_and_its_other_numbers_are_asked_about(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P01.toml").rename(small / "P01.txt")
    (small / "P01.txt").write_text(
        "Probe P01, gesägt.\ndate = 2026-05-03\ncrack.depth_mm = 8.0\nphoto.ends_px = [[40.0, 101], [160, 98]]\n"
    )
    (small / "P02 Anmerkung.md").write_text("# Probe P02\n\n- Kante ausgebrochen\n")
    (small / "README.txt").write_text("Fotos vom Mai")
    outcomes = {outcome.sample.name: outcome for outcome in ingest(small, lab, QUIET).outcomes}
    assert {outcome.fate for outcome in outcomes.values()} == {"new"}
    assert outcomes["P01"].note.entries["date"] == NoteEntry("2026-05-03", str(small / "P01.txt"))
    assert present(load_trial(lab / "P01" / "trial.toml").crack, "crack").depth_mm == 8.0
    assert (lab / "P02/inputs/text-1.txt").exists() is False
    assert (lab / "P01/inputs/text-1.txt").read_bytes() == (small / "P01.txt").read_bytes()
    edit(small / "P01.txt", "gesägt", "gesägt, 21 °C")
    (small / "zu P01 notiert.txt").write_text("Wetter: 3 Tage trocken")
    (small / "README.txt").write_text("Fotos vom 3. Mai")
    ingested = ingest(small, lab, QUIET)
    assert fates(ingested) == {"P01": "failed", "P02": "unchanged"}
    assert {fault.name for fault in ingested.faults} == {"P01", "README.txt"}
    assert "not read: 'Probe P01, gesägt, 21 °C.'" in question(lab, "P01.txt")
    assert "not read: 'Wetter: 3 Tage trocken'" in question(lab, "zu P01 notiert.txt")
    assert "not read: 'Fotos vom 3. Mai'" in question(lab, "README.txt")
    ignored = {"role": "ignore"}
    answer(lab, {"zu P01 notiert.txt": ignored, "README.txt": ignored, "P01.txt": {"settings": "crack.depth_mm = 9"}})
    assert not ingest(small, lab, QUIET).faults
    assert present(load_trial(lab / "P01@2" / "trial.toml").crack, "crack").depth_mm == 9
    edit(small / "P01.txt", "21 °C", "12 mm tief")
    changed = ingest(small, lab, QUIET).outcomes[0]
    assert changed.fate == "revised", "what the answer was not about"
    assert any("12 mm tief" in remark for remark in changed.remarks)


@pytest.mark.parametrize(
    ("line", "quoted"),
    [
        ("crack.depth_mm = 8,5", "'crack.depth_mm = 8,5'"),
        ("crack.tilt = lean", "'crack.tilt = lean'"),
        ("depth_mm = 8", "'depth_mm = 8'"),
        ("Wetter = 'trocken'", ""),
        ("Risstiefe ½ cm", "'Risstiefe ½ cm'"),
        ("Siehe P-01 und P02.", "'Siehe P-01 und P02.'"),
        ("Siehe P-01. Tiefe bekannt.", ""),
        ("x = " + "[" * 5000 + "1", f"'x = {'[' * 55}…'"),
    ],
)
def test_a_line_is_a_setting_or_harmless_or_quoted(tmp_path, line, quoted):
    note, unread = _read(tmp_path, line, "P01.txt")
    assert (note.entries, note.faults, unread) == ({}, [], quoted)


def test_what_is_behind_the_part_of_a_text_that_is_read_is_asked_about(tmp_path):
    assert "all behind its first 200000 bytes" in _read(tmp_path, "Wort " * 50_000, "P01.txt")[1]
    (tmp_path / "P01.dat").write_bytes(b"\x81\x00\xff\x9d" * 9)
    note = Note()
    assert note.read(tmp_path / "P01.dat") == ""
    assert "P01.dat: not a text" in note.faults[0]


def test_toml_has_the_trials_own_keys(tmp_path):
    text = 'data = "measured"\ndate = 2026-05-03\ncrack.depth_mm = 16\ndepht_mm = 3\n'
    note, unread = _read(tmp_path, text + '[photo]\nmm_per_pixl = 0.1\n[mesh]\n[project]\nname = "A"\n')
    assert note.entries["date"].value == "2026-05-03"
    assert note.entries["crack.depth_mm"].value == 16
    assert unread == "'depht_mm = 3'"
    assert "'project' = {'name': 'A'} is kept as a remark" in note.remarks[0]
    for key, fault in zip(("photo.mm_per_pixl", "mesh"), note.faults, strict=True):
        assert f"'{key}': no such key" in fault
    twice = Note()
    for name in ("P01.toml", "P01.txt"):
        (tmp_path / name).write_text("crack.depth_mm = 8.0\n")
        twice.read(tmp_path / name)
    assert "P01.txt: crack.depth_mm is also given in " in twice.faults[0]


def test_a_samples_own_scale_takes_the_place_of_the_folders_whatever_its_kind():
    folder = Note({key: NoteEntry(1.0, "lab.toml") for key in ("photo.mm_per_px", "crack.depth_mm", "fluid.U")})
    own = Note({key: NoteEntry(1.0, "P01.toml") for key in ("photo.face_mm", "fluid.viscosity_pa_s")})
    assert set(own.over(folder).entries) == {"photo.face_mm", "fluid.viscosity_pa_s", "crack.depth_mm"}
