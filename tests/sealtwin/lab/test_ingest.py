"""Ingest: ten dialects and all planted faults; nothing of the lab's changed, nothing twice, nothing lost."""

import hashlib
import json
import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sealtwin.cli import app
from sealtwin.errors import InputError
from sealtwin.lab import finding
from sealtwin.lab import ingest as ingesting
from sealtwin.lab.catalogue import CATALOGUE, Catalogue, Fault
from sealtwin.lab.ingest import ingest
from sealtwin.lab.telling import exit_code, lines
from sealtwin.progress import Progress
from sealtwin.trial import load_trial
from tests.lab_folder import FAULTS, HANDS, LENGTH_MM, S_MM, levels_mm, make_lab_folder
from tests.pictures import mortar, write_png
from tests.places import FIXTURE
from validate.caliper import read_readings

QUIET = Progress()


def _sealtwin(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def _hashes(folder):
    """Of all files below, by relative name, without the lock."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def _rows(lab):
    """What the catalogue says, without times."""
    with Catalogue.of(lab) as catalogue:
        return [
            (record.name, record.revision, record.folder, record.content, record.files)
            for record in catalogue.records()
        ]


def _trials(lab):
    return sum(1 for _ in lab.glob("[!.]*/record.json"))


def _start(folder, lab):
    command = [sys.executable, "-m", "sealtwin", "ingest", str(folder), "--out", str(lab), "--quiet"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A lab's folder, its hashes before, and the lab that was made of it."""
    folder = make_lab_folder(tmp_path_factory.mktemp("sound") / "folder")
    before = _hashes(folder)
    lab = folder.parent / "lab"
    return folder, before, lab, ingest(folder, lab, QUIET)


@pytest.fixture
def small(sound, tmp_path):
    """Two samples in a folder of their own."""
    whole = sound[0]
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in ("lab.toml", "P01.png", "P01.csv", "P01.toml", "P02.png", "P02_Messung.csv", "P02_Notiz.csv"):
        shutil.copy(whole / name, folder)
    return folder


def test_ten_samples_in_ten_dialects_become_ten_trials(sound):
    _, _, lab, ingested = sound
    assert [outcome.fate for outcome in ingested.outcomes] == ["new"] * 10
    assert not ingested.faults
    assert len({outcome.dialect for outcome in ingested.outcomes}) == 10
    assert exit_code(ingested) == 0
    for sample, (_, hand) in HANDS.items():
        trial = load_trial(lab / sample / "trial.toml")
        assert trial.readings is not None
        profile = read_readings(lab / sample / trial.readings.file, trial.readings, LENGTH_MM, 8.0)
        expected = levels_mm(sample)
        if hand.missing:
            expected[2, 1] = np.nan
        # What was written with a hundredth of a millimetre, or with eight digits of an inch.
        assert profile.repeats_mm is not None
        assert np.allclose(profile.repeats_mm, expected, atol=1e-6, equal_nan=True)
        assert np.allclose(profile.s_mm, S_MM, atol=1e-6)


def test_notes_in_words_and_in_keys_say_the_same(sound):
    trials = [load_trial(sound[2] / sample / "trial.toml") for sample in HANDS]
    assert {str(trial.crack.depth_mm) for trial in trials if trial.crack} == {"8.0", "((0.0, 7.5), (12.0, 8.5))"}
    assert {trial.photo.ends_px for trial in trials if trial.photo} == {((40.0, 101.0), (160.0, 98.0))}
    assert load_trial(sound[2] / "P07" / "trial.toml").path.speed_mm_s == 20.0


def test_nothing_of_the_labs_is_changed_and_its_files_are_kept_byte_for_byte(sound):
    folder, before, lab, _ = sound
    assert _hashes(folder) == before
    with Catalogue.of(lab) as catalogue:
        kept = [(record, file) for record in catalogue.records() for file in record.files]
    assert len(kept) == 30
    for record, file in kept:
        assert before[file.original] == file.sha256
        assert hashlib.sha256((lab / record.folder / file.kept_as).read_bytes()).hexdigest() == file.sha256


def test_a_trial_of_the_lab_is_ready_for_its_stages(sound, tmp_path):
    answer = _sealtwin("digitise", sound[2] / "P05" / "trial.toml", "--out", tmp_path / "run", "--quiet")
    assert answer.exit_code == 0, answer.output


def test_the_fixtures_own_trial_file_is_a_note_and_says_the_same_as_before(tmp_path):
    ingested = ingest(FIXTURE, tmp_path / "lab", QUIET)
    fates = {outcome.sample.name: outcome.fate for outcome in ingested.outcomes}
    assert fates == {"paper-trial": "new", "study-paper": "failed", "trial-paper": "failed"}
    found, before = (load_trial(path) for path in (tmp_path / "lab/paper-trial/trial.toml", FIXTURE / "trial.toml"))
    assert found.photo is not None
    assert found.readings is not None
    assert found.photo.file == Path("inputs/photo.jpg")
    assert found.readings.file == Path("inputs/readings.csv")
    elsewhere = {"photo": {"file"}, "readings": {"file"}}
    assert found.model_dump(exclude=elsewhere) == before.model_dump(exclude=elsewhere)


def test_every_planted_fault_is_named_and_the_rest_goes_on(tmp_path):
    folder = make_lab_folder(tmp_path / "folder")
    for fault in FAULTS:
        fault.plant(folder)
    answer = _sealtwin("ingest", folder, "--out", tmp_path / "lab", "--quiet")
    assert answer.exit_code == 6, answer.output
    assert len(FAULTS) >= 12
    assert not [fault.what for fault in FAULTS if not re.search(fault.says, answer.stdout)]
    # As many sentences as faults, the photo that waits for its sheet, and the two photos without a depth or a picture.
    assert sum(line.startswith("failed: ") for line in answer.stdout.splitlines()) == len(FAULTS) + 2
    assert [row[0] for row in _rows(tmp_path / "lab")] == ["P10"]
    assert "/folder/" not in answer.stdout


def test_ingesting_twice_adds_nothing(sound):
    folder, _, lab, _ = sound
    before, rows = _hashes(lab), _rows(lab)
    again = ingest(folder, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["unchanged"] * 10
    assert _rows(lab) == rows
    assert {name: digest for name, digest in _hashes(lab).items() if name != CATALOGUE} == {
        name: digest for name, digest in before.items() if name != CATALOGUE
    }


def test_a_changed_file_makes_a_revision_and_the_old_one_stays(small, tmp_path):
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    old = _hashes(lab / "P01")
    (small / "P01.csv").write_text((small / "P01.csv").read_text() + "11.5,-1.0,-1.0,-1.0\n")
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["revised", "unchanged"]
    assert _hashes(lab / "P01") == old
    assert (lab / "P01@2" / "inputs" / "readings.csv").read_bytes() == (small / "P01.csv").read_bytes()
    assert [row[:3] for row in _rows(lab)] == [("P01", 1, "P01"), ("P01", 2, "P01@2"), ("P02", 1, "P02")]


def test_a_word_in_lab_toml_revises_all_that_it_is_about_and_a_comment_none(small, tmp_path):
    (small / "P02_Messung.csv").unlink()
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    defaults = small / "lab.toml"
    defaults.write_text(f"# Seen.\n{defaults.read_text()}")
    assert {outcome.fate for outcome in ingest(small, lab, QUIET).outcomes} == {"unchanged"}
    defaults.write_text(defaults.read_text().replace("held-out", "calibrated-on"))
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["revised", "unchanged"]
    defaults.write_text(defaults.read_text().replace("volume_ml = 0.08", "volume_ml = 0.09"))
    assert {outcome.fate for outcome in ingest(small, lab, QUIET).outcomes} == {"revised"}


def test_a_fault_of_lab_toml_is_told_once_and_stops_all(small, tmp_path):
    (small / "lab.toml").write_text('data = "measured"\n[photo]\nmm_per_pxl = 0.1\n')
    with pytest.raises(
        InputError, match=r"lab\.toml: 'photo\.mm_per_pxl': no such key; did you mean 'photo\.mm_per_px'"
    ):
        ingest(small, tmp_path / "lab", QUIET)
    (small / "lab.toml").write_text('data = "measured"\nname = "all"\n')
    with pytest.raises(InputError, match="name is of one sample"):
        ingest(small, tmp_path / "lab", QUIET)


def test_a_value_of_lab_toml_that_fails_all_samples_is_told_in_one_sentence(small, tmp_path):
    (small / "lab.toml").write_text((small / "lab.toml").read_text().replace("mm_per_px = 0.1", "mm_per_px = 100.0"))
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert exit_code(ingested) == 3
    assert [line for line in lines(ingested) if line.startswith("failed: P01, P02: lab.toml: photo.mm_per_px = 100.0")]


def test_what_is_not_declared_is_asked_and_where_to_write_it(small, tmp_path):
    (small / "lab.toml").write_text("[photo]\nmm_per_px = 0.1\n")
    sentences = [fault.sentence for fault in ingest(small, tmp_path / "lab", QUIET).faults if fault.name == "P01"]
    assert len(sentences) == 3
    for key in ("photo.data", "readings.data", "readings.role"):
        assert any(sentence.startswith(f"P01.toml: {key} is not said") for sentence in sentences)


def test_readings_that_a_note_speaks_of_must_be_there(small, tmp_path):
    (small / "P02_Messung.csv").unlink()
    assert not ingest(small, tmp_path / "lab", QUIET).faults  # of lab.toml's readings P02 has none
    (small / "P02_Notiz.csv").write_text("Tiefe;8 mm\nZustand;wet\n")
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert "P02_Notiz.csv, line 2: readings.state of a sample without readings" in fault.sentence


def test_a_traced_trial_beside_its_photo_is_its_note(small, tmp_path):
    """As 'sealtwin trace' writes it: it names its photo, which must be the one beside it."""
    text = 'name = "P01"\n[photo]\nfile = "P01.png"\ndata = "measured"\nmm_per_px = 0.1\n[crack]\ndepth_mm = 8.0\n'
    (small / "P01.toml").write_text(text)
    assert not ingest(small, tmp_path / "lab", QUIET).faults
    (small / "P01.toml").write_text(text.replace("P01.png", "P02.png"))
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert "P01.toml: photo.file = 'P02.png', but P01.png is of this sample by its name" in fault.sentence


def test_a_mask_is_its_samples_by_its_name_and_by_nothing_else(small, tmp_path):
    write_png(small / "P01_mask.png", mortar((200, 200)))
    note = (small / "P01.toml").read_text()
    (small / "P01.toml").write_text(f'{note}mask = "P01_mask.png"\n')
    assert not ingest(small, tmp_path / "lab", QUIET).faults
    trial = load_trial(tmp_path / "lab" / "P01" / "trial.toml")
    assert trial.photo is not None
    assert trial.photo.mask == Path("inputs/mask.png")
    (small / "P01_mask.png").rename(small / "drawn.dat")
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert "P01.toml: photo.mask = 'P01_mask.png', which is not of this sample by its name" in fault.sentence


def test_the_pairing_is_shown_corrected_and_remembered(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "PO2_Messung.csv")
    shutil.copy(small / "P01.png", small / "P01_side.png")
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["failed"] * 3
    pairing = lab / "pairing.csv"
    text = pairing.read_text()
    assert "PO2_Messung.csv,readings,PO2," in text
    # Saved by a German spreadsheet, and in another order.
    text = text.replace("PO2_Messung.csv,readings,PO2", "PO2_Messung.csv,readings,p-02")
    text = text.replace("P01_side.png,photo,P01", "P01_side.png,ignore,")
    head, *rows = [line.split(",")[:3] for line in text.splitlines()]
    corrected = "\r\n".join(";".join(row) for row in (head, *reversed(rows)))
    pairing.write_bytes(corrected.encode("utf-8-sig"))
    with pytest.raises(InputError, match="edited since it was written"):
        ingest(small, lab, QUIET)
    assert pairing.read_bytes() == corrected.encode("utf-8-sig")
    ingested = ingest(small, lab, QUIET, pairing=pairing)
    assert [(outcome.sample.name, outcome.fate) for outcome in ingested.outcomes] == [("P01", "new"), ("P02", "new")]
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["unchanged"] * 2


def test_a_pairing_that_cannot_be_is_refused_with_all_its_rows(small, tmp_path):
    pairing = tmp_path / "pairing.csv"
    pairing.write_text(
        "file,role,sample\nP01.png,readings,P01\ngone.png,photo,P01\nP01.csv,note,\nP02.png,photo,P02\nP02.png,photo,P3\n"
    )
    with pytest.raises(InputError) as refusal:
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)
    told = str(refusal.value).splitlines()
    assert "line 2: P01.png cannot be 'readings'; write one of photo, second_photo, mask, ignore." in told[0]
    assert "line 3: no file 'gone.png'" in told[1]
    assert "line 4: P01.csv is of no sample" in told[2]
    assert "line 6: P02.png stands there twice" in told[3]


def test_a_pairing_that_is_not_there_is_told_of(small, tmp_path):
    with pytest.raises(InputError, match=r"gone\.csv: no such file; 'sealtwin ingest FOLDER --out LAB' writes"):
        ingest(small, tmp_path / "lab", QUIET, pairing=tmp_path / "gone.csv")


def test_a_dry_run_tells_the_same_and_writes_nothing(small, tmp_path):
    dry = _sealtwin("ingest", small, "--out", tmp_path / "lab", "--dry-run", "--json", "--quiet")
    assert dry.exit_code == 0, dry.output
    assert not (tmp_path / "lab").exists()
    samples = json.loads(dry.stdout)["samples"]
    assert [(sample["name"], sample["state"]) for sample in samples] == [("P01", "new"), ("P02", "new")]
    ingest(small, tmp_path / "lab", QUIET)
    before = _hashes(tmp_path / "lab")
    ingest(small, tmp_path / "lab", QUIET, dry_run=True)
    assert _hashes(tmp_path / "lab") == before


def test_the_same_name_from_another_folder_is_another_sample(small, tmp_path):
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    other = shutil.copytree(small, tmp_path / "other")
    write_png(other / "P02.png", mortar((200, 200), seed=99))
    fates = {outcome.sample.name: outcome for outcome in ingest(other, lab, QUIET).outcomes}
    assert fates["P01"].fate == "unchanged"  # the very same files, copied
    assert "a sample P02 with another photo came from" in fates["P02"].faults[0]
    assert len(_rows(lab)) == 2


def test_a_lab_is_not_mixed_up_with_other_files(small, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.docx").touch()
    with pytest.raises(InputError, match="holds files that no ingest wrote"):
        ingest(small, tmp_path / "mine", QUIET)
    for lab in (small, small / "lab", tmp_path):
        with pytest.raises(InputError, match="lie one within the other"):
            ingest(small, lab, QUIET)


def test_a_lab_without_its_catalogue_is_still_whole(small, tmp_path):
    """The folders say all that the rows say."""
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    rows = _rows(lab)
    (lab / CATALOGUE).unlink()
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["unchanged"] * 2
    assert _rows(lab) == rows


@pytest.mark.parametrize("step", ["keep", "add", "rename"])
def test_stopped_at_any_step_the_same_command_completes_the_lab(small, tmp_path, monkeypatch, step):
    lab = tmp_path / "lab"

    def stop(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        place = {"keep": (ingesting, "keep"), "add": (Catalogue, "add"), "rename": (Path, "rename")}[step]
        patched.setattr(*place, stop)
        with pytest.raises(KeyboardInterrupt):
            ingest(small, lab, QUIET)
    assert not ingest(small, lab, QUIET).faults
    unbroken = tmp_path / "unbroken"
    ingest(small, unbroken, QUIET)
    assert _rows(lab) == _rows(unbroken)
    assert sorted(path.name for path in lab.iterdir()) == sorted(path.name for path in unbroken.iterdir())


def test_two_ingests_at_once_lose_nothing(sound, small, tmp_path):
    """Two processes, two folders that share samples: one waits for the other."""
    lab = tmp_path / "lab"
    both = [_start(folder, lab) for folder in (sound[0], small)]
    for process in both:
        _, told = process.communicate(timeout=120)
        assert process.returncode == 0, told
    assert [row[:2] for row in _rows(lab)] == [(sample, 1) for sample in HANDS]
    assert {path.name for path in lab.iterdir() if path.is_dir()} == set(HANDS)


@pytest.mark.slow
def test_killed_again_and_again_an_ingest_loses_nothing(sound, tmp_path):
    """SIGKILL at random moments after one more trial is there, then once to its end: the same as unbroken."""
    chance = random.Random(5)
    lab = tmp_path / "lab"
    kept = [0]
    while kept[-1] < len(HANDS) - 1 and len(kept) < 12:
        process = _start(sound[0], lab)
        while process.poll() is None and _trials(lab) == kept[-1]:
            time.sleep(0.002)
        # A trial takes some hundredths of a second.
        time.sleep(chance.uniform(0, 0.05))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        assert _trials(lab) > kept[-1]
        kept.append(_trials(lab))
    assert len(kept) > 3
    ingested = ingest(sound[0], lab, QUIET)
    assert not ingested.faults
    assert _rows(lab) == _rows(sound[2])
    for sample in HANDS:
        names = ("trial.toml", "inputs")
        found, unbroken = (_hashes(place / sample) for place in (lab, sound[2]))
        assert {n: d for n, d in found.items() if n.startswith(names)} == {
            n: d for n, d in unbroken.items() if n.startswith(names)
        }


def test_a_bug_that_one_sample_wakes_costs_no_other_one(small, tmp_path, monkeypatch):
    real = ingesting.prepare

    def burst(folder, prepared):
        if prepared.sample.name == "P01":
            raise ZeroDivisionError("on purpose")
        real(folder, prepared)

    monkeypatch.setattr(ingesting, "prepare", burst)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert [outcome.fate for outcome in ingested.outcomes] == ["bug", "new"]
    assert "P01: ZeroDivisionError in test_ingest.py, line" in ingested.outcomes[0].faults[0]
    assert exit_code(ingested) == 1


def test_a_file_that_cannot_be_read_is_its_samples_fault_and_a_full_disk_is_nobodys(small, tmp_path, monkeypatch):
    real, lab = ingesting.gather, tmp_path / "lab"

    def failing(at):
        def gather(folder, sample, defaults):
            if sample.name == "P01":
                raise OSError(28, "on purpose", str(at))
            return real(folder, sample, defaults)

        monkeypatch.setattr(ingesting, "gather", gather)

    failing(small / "P01.png")
    outcomes = ingest(small, lab, QUIET).outcomes
    assert outcomes[0].faults == ("P01.png: on purpose. Make it readable.",)
    assert outcomes[1].fate == "new"
    failing(lab / "P01")
    with pytest.raises(OSError, match="on purpose"):
        ingest(small, lab, QUIET)


def test_a_file_that_changes_while_it_is_taken_in_is_not_kept(small, tmp_path, monkeypatch):
    real = ingesting.keep

    def changing(*arguments):
        (small / "P01.csv").write_text("s_mm,level_1_mm\n1,-1\n2,-1\n")
        return real(*arguments)

    monkeypatch.setattr(ingesting, "keep", changing)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert "P01.csv: changed while it was taken in" in ingested.outcomes[0].faults[0]
    assert not (tmp_path / "lab" / "P01").exists()


class TestHostile:
    def test_links_are_not_followed(self, small, tmp_path):
        secret = write_png(tmp_path / "secret.png", mortar((200, 200)))
        (small / "P03.png").symlink_to(secret)
        (small / "loop").symlink_to(small)
        ingested = ingest(small, tmp_path / "lab", QUIET)
        assert [fault.sentence for fault in ingested.faults] == [
            "P03.png: a link; links are not followed: copy the file itself."
        ]
        assert len(ingested.outcomes) == 2

    def test_names_that_would_move_a_terminals_cursor_are_left_out(self, small, tmp_path):
        for name in ("P03\n.png", "P04\x1b[2J.png", "P05\u202egnp.png"):
            (small / name).touch()
        (small / os.fsdecode(b"P06\xff.png")).touch()
        told = "\n".join(lines(ingest(small, tmp_path / "lab", QUIET)))
        assert "P03?.png: a name with control characters" in told
        assert "\\xff" in told
        assert not set(told) & {"\x1b", "\u202e", "\udcff"}

    def test_names_and_notes_that_are_formulas_stay_text_in_tables(self, small, tmp_path):
        (small / "P01.png").rename(small / "=cmd()_P01_photo.png")
        (small / "P02_Notiz.csv").write_text('Tiefe;8 mm\nPrüfer;"=HYPERLINK(""x"")"\n')
        lab = tmp_path / "lab"
        ingest(small, lab, QUIET)
        assert "\n'=cmd()_P01_photo.png,photo," in (lab / "pairing.csv").read_text()
        _sealtwin("lab", "export", lab, "--out", tmp_path / "out.csv")
        assert "\"'=HYPERLINK(" in (tmp_path / "out.csv").read_text()
        assert not ingest(small, lab, QUIET, pairing=lab / "pairing.csv").left_out  # its own cells are read back

    def test_a_note_that_would_move_a_terminals_cursor_moves_none(self, small, tmp_path):
        (small / "P01.toml").write_text(
            'operator = "\\u001b[2J"\nnote = "\\u202e"\ncrack.depth_mm = 8.0\n"\\u009b2J" = 1\n'
        )
        (small / "P02_Notiz.csv").write_bytes(b"Tiefe;8 mm\nBemerkung;\x1b[2J\n\x1b]0;x\n")
        told = "\n".join(lines(ingest(small, tmp_path / "lab", QUIET)))
        assert "P01.toml" in told
        assert "P02_Notiz.csv" in told
        assert not set(told) & {"\x1b", "\u202e", "\x9b"}

    def test_whatever_a_fault_quotes_moves_no_cursor(self, sound):
        told = lines(replace(sound[3], faults=(Fault("P01", "P01.csv: \x1b[2J\n\u202e"),)))
        assert "failed: P01: P01.csv: ?[2J??" in told

    def test_a_sheet_of_a_gigabyte_is_refused_unread(self, small, tmp_path, monkeypatch):
        with (small / "P01.csv").open("wb") as sheet:
            sheet.truncate(1_000_000_000)
        monkeypatch.setattr(
            ingesting.files, "sha256", lambda path: pytest.fail(str(path)) if path.stat().st_size > 1e8 else "x"
        )
        ingested = ingest(small, tmp_path / "lab", QUIET, dry_run=True)
        assert ingested.outcomes[0].faults == ("P01.csv: 1,000 MB; at most 5 MB of such a file are read.",)

    def test_a_note_that_cannot_be_read_is_the_one_fault(self, small, tmp_path):
        (small / "P01.toml").write_text("a." * 60_000 + "b = 1")
        (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
        assert fault.sentence.startswith("P01.toml: a key of more than 16 parts")

    def test_too_many_files_are_refused(self, small, tmp_path, monkeypatch):
        monkeypatch.setattr(finding, "MOST_ENTRIES", 6)
        with pytest.raises(InputError, match="more than 6 files; give one part of it at a time"):
            ingest(small, tmp_path / "lab", QUIET)

    def test_a_catalogue_that_is_none_is_told_of(self, small, tmp_path):
        lab = tmp_path / "lab"
        ingest(small, lab, QUIET)
        (lab / CATALOGUE).write_bytes(b"no database" * 100)
        with pytest.raises(InputError, match="no catalogue that can be read"):
            ingest(small, lab, QUIET)
        (lab / CATALOGUE).unlink()
        with sqlite3.connect(lab / CATALOGUE) as base:
            base.execute("CREATE TABLE facts (name TEXT PRIMARY KEY, value TEXT)")
            base.execute("INSERT INTO facts VALUES ('version', '99')")
        base.close()
        with pytest.raises(InputError, match="written by another version"):
            ingest(small, lab, QUIET)
