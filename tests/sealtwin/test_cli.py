"""The command as a user meets it: answers, exit codes, one sentence for each thing that is wrong."""

import json
import os
import shlex
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
import typer

from sealtwin.cli.answer import Command, ending
from tests.support.paths import FIXTURE
from tests.support.photos import mortar, wandering, with_crack, write_png
from tests.support.processes import refusal, sealtwin, start_interruptible
from tests.support.tiny_study import tiny_lab


@pytest.fixture
def trial(tmp_path):
    """A copy of the fixture that a test may spoil."""
    shutil.copytree(FIXTURE, tmp_path / "lab")
    return tmp_path / "lab" / "trial.toml"


def _png_bomb() -> bytes:
    """The begin of a greyscale PNG of 40,000 x 40,000 pixels: decoded it would be 1.6 GB, in colour 4.8 GB."""

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header, row = struct.pack(">IIBBBBB", 40_000, 40_000, 8, 0, 0, 0, 0), zlib.compress(bytes(40_001))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", row) + chunk(b"IEND", b"")


def _encoded(image):
    return cv2.imencode(".png", image)[1].tobytes()


BAD_PHOTOS = {
    "missing": (None, "not found"),
    "a text file": (b"This is no photo.\n" * 100, "photo"),
    "a bomb": (_png_bomb(), "million pixels allowed"),
    "without a crack": (_encoded(np.full((200, 500, 3), 150, np.uint8)), ""),
}


@pytest.mark.parametrize("fault", BAD_PHOTOS)
def test_a_bad_photo_gets_one_sentence(trial, tmp_path, fault):
    content, named = BAD_PHOTOS[fault]
    photo = trial.parent / "photo.jpg"
    if content is None:
        photo.unlink()
    else:
        photo.write_bytes(content)
    sentence = refusal("digitise", trial, "--out", tmp_path / "run", "--quiet")
    assert named in sentence
    assert "photo.jpg" in sentence
    assert fault != "missing" or not (tmp_path / "run").exists()


def test_a_bad_sheet_gets_one_sentence_before_the_long_run(tmp_path):
    """Minutes of simulation must not pass before a typo in the sheet is found."""
    sheet = tiny_lab(tmp_path).with_name("readings.csv")
    sheet.write_text("s_mm,height\n0,-16\n")
    sentence = refusal("run", tmp_path / "trial.toml", "--out", tmp_path / "run", "--quiet")
    assert f"{sheet}: column B" in sentence
    assert "height" in sentence
    assert not (tmp_path / "run" / "particles.csv").exists()


def test_an_absent_device_is_refused_and_never_replaced(tmp_path):
    trial = tiny_lab(tmp_path).with_name("trial.toml")
    assert "cuda:7" in refusal("run", trial, "--out", tmp_path / "run", "--device", "cuda:7", "--quiet")


def test_a_place_that_cannot_be_written_is_named(trial, tmp_path):
    (tmp_path / "dangling").symlink_to(tmp_path / "none" / "there")
    (tmp_path / "mine").write_text("mine")
    for out in (Path("/proc/nowhere"), tmp_path / ("x" * 300), tmp_path / "dangling", tmp_path / "mine"):
        assert out.name in refusal("run", trial, "--out", out, "--quiet")
    assert (tmp_path / "mine").read_text() == "mine"


def test_the_demo_overwrites_nothing_of_the_users(tmp_path):
    mine = tmp_path / "mine" / "trial" / "caliper.csv"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    assert "caliper.csv" in refusal("demo", "--out", tmp_path / "mine")
    assert [file for file in (tmp_path / "mine").rglob("*") if file.is_file()] == [mine]
    assert mine.read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("digitise", "photo.png"), "--depth-mm"),
        (("digitise", "photo.png", "--depth-mm", "16", "--ends", "12;340", "1,2"), "--ends"),
        (("digitise", "scan.stl", "--depth-mm", "16"), "sealtwin import-mesh scan.stl"),
        (("import-mesh", "scan.stl"), "--units"),
        (("robot", "run", "--speed", "4"), "--speed"),
        (("sweep", "study.toml", "--jobs", "1.5"), "--jobs: jobs = 1.5: should be a whole number"),
        (("plan", "trial.toml", "--from", "levels.csv", "--seeds", "1"), "--from"),
        (("export", "run", "--format", "mask,dwg", "--out", "x"), "--format: formats.1 = 'dwg'"),
        (("fly",), "fly"),
    ],
)
def test_a_program_reads_what_was_wrong_with_its_command_line(arguments, named):
    """Faults that the parser finds, and those that a command finds; broken on purpose, stdout stays empty."""
    answer = sealtwin(*arguments, "--json")
    error = json.loads(answer.stdout)
    assert (error["version"], error["exit_code"], answer.exit_code) == (1, 2, 2)
    assert named in error["error"]
    assert named in answer.stderr
    assert not sealtwin(*arguments).stdout


def test_the_module_is_the_command():
    """Run as a module, a file that only defines would do nothing, and say so by code 0."""
    command = [sys.executable, "-m", "sealtwin.cli.app", "--version"]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    assert answer.stdout == sealtwin("--version").stdout != ""


INTERRUPTED_WHERE_CPYTHON_NOTES_IT = """
import typer
from sealtwin.cli.answer import CheckedCommand, answers

app = typer.Typer()

@app.command(cls=CheckedCommand)
@answers()
def command(command):
    exec("import signal; signal.raise_signal(signal.SIGINT); done = 1")

app()
"""


def test_an_interrupt_in_the_making_of_a_class_ends_with_130_too(tmp_path):
    (tmp_path / "interrupted.py").write_text(INTERRUPTED_WHERE_CPYTHON_NOTES_IT)
    ended = start_interruptible([sys.executable, "-m", "interrupted"], cwd=tmp_path)
    narration = ended.communicate()[1]
    assert ended.returncode == 130, narration


def test_digitise_answers_in_json_and_then_redoes_nothing(tmp_path):
    """The folder names no home and no place of this machine."""
    trial, run = tiny_lab(tmp_path).with_name("trial.toml"), tmp_path / "run"
    answer = sealtwin("digitise", trial, "--out", run, "--json")
    assert answer.exit_code == 0, answer.output
    result = json.loads(answer.stdout)
    assert result["version"] == 2
    assert result == json.loads((run / "run.json").read_text())
    before = {path: path.stat().st_mtime_ns for path in run.iterdir() if not path.name.startswith(".")}
    again = sealtwin("digitise", trial, "--out", run)
    assert "nothing to redo" in again.stderr
    assert before == {path: path.stat().st_mtime_ns for path in before}
    walls = json.loads(sealtwin("digitise", run, "--explain", 5, "--json").stdout)["walls"]
    assert [walls[side]["method"] for side in ("left", "right")] == ["edge", "edge"]
    assert "--explain asks about a run folder" in sealtwin("digitise", trial, "--explain", 5).stderr
    assert "mm long" in refusal("digitise", run, "--explain", 500)
    for name in ("manifest.json", "trial.toml", "outline.json", "solid.json"):
        text = (run / name).read_text()
        assert str(tmp_path) not in text
        assert str(Path.home()) not in text


def test_a_proposed_crack_is_named_as_one(tmp_path):
    """Nobody must take a proposal for a crack that was seen."""
    photo, out = tmp_path / "wide.png", tmp_path / "run"
    write_png(photo, with_crack(mortar(), wandering([(40, 150), (460, 140)])))
    answer = sealtwin("digitise", photo, "--depth-mm", 16, "--mm-per-px", 0.1, "--out", out, "--json")
    assert any("found automatically" in warning["text"] for warning in json.loads(answer.stdout)["sample"]["warnings"])
    assert json.loads((out / "manifest.json").read_text())["stages"]["digitise"]["path_source"] == "automatic"


def test_a_refusal_shows_what_was_found(tmp_path):
    """A piece of a wide crack: seen, followed, and too short to be measured."""
    wide = with_crack(mortar(), [(40, 150), (460, 140)], width_px=50)
    photo, out = write_png(tmp_path / "crack.png", wide), tmp_path / "run"
    ends = ("--ends", "190,146", "310,144")
    sentence = refusal("digitise", photo, "--depth-mm", 16, "--mm-per-px", 0.1, "--out", out, *ends)
    assert sentence.endswith(f"Look at {out / 'refused.png'}.")
    picture = np.asarray(cv2.imread(str(out / "refused.png")))
    assert np.abs(picture.astype(int) - (60, 235, 250)).max(axis=2).min() < 40, "the way, in its yellow"


@pytest.fixture
def thin(tmp_path):
    """Arguments of a photo of a crack 5 px wide, and of its run folder."""
    photo = write_png(tmp_path / "crack.png", with_crack(mortar(), [(40, 150), (460, 140)], width_px=4))
    ends = ("--ends", "40,150", "460,140")
    return (photo, "--mm-per-px", 0.1, *ends, "--out", tmp_path / "run", "--quiet"), tmp_path / "run"


def test_a_path_alone_is_a_robot_s_and_no_simulation_s_until_it_has_a_depth(thin, tmp_path):
    arguments, out = thin
    answer = sealtwin("digitise", *arguments, "--set", "photo.path_only=true", "--set", "path.volume_ml=0.5")
    assert answer.exit_code == 0, answer.output
    assert (out / "trajectory.csv").is_file()
    assert not list(out.glob("crack.*"))
    for command in ("simulate", "validate"):
        assert "has only the crack's path" in refusal(command, out)
    cell = tmp_path / "cell.toml"
    assert sealtwin("robot", "--example", cell).exit_code == 0
    answer = sealtwin("robot", out, "--cell", cell)
    assert answer.exit_code == 0, answer.output
    assert sealtwin("digitise", *arguments, "--depth-mm", 16).exit_code == 0
    result, outline = (json.loads((out / name).read_text()) for name in ("run.json", "outline.json"))
    assert result["sample"]["width_source"] == outline["width_source"] == "fit"


def test_a_gauge_s_widths_are_taken_as_given(thin, tmp_path):
    arguments, out = thin
    table = tmp_path / "widths.csv"
    table.write_text("s_mm,width_mm\n0,0.2\n42,0.4\n")
    answer = sealtwin("digitise", *arguments, "--depth-mm", 16, "--width-mm", table)
    assert answer.exit_code == 0, answer.output
    assert json.loads((out / "run.json").read_text())["sample"]["mean_width_mm"] == pytest.approx(0.3, abs=0.01)
    path_alone = ("--set", "photo.path_only=true", "--width-mm", 0.3)
    assert "path_only cannot be combined with width_mm" in refusal("digitise", *arguments, *path_alone)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a file that is always full")
def test_a_full_disk_behind_stdout_is_one_sentence(tmp_path):
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "sealtwin", "init", "lab"]
        answer = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, cwd=tmp_path, text=True, check=False)
    assert (answer.returncode, "standard output" in answer.stderr, "Traceback" in answer.stderr) == (3, True, False)


@pytest.mark.parametrize("text", ["x.so: failed to map segment from shared object", "x.so: Cannot allocate memory"])
def test_a_library_that_finds_no_memory_is_one_sentence_and_another_fault_a_bug(text, capsys):
    with pytest.raises(typer.Exit) as end, ending(Command()):
        raise ImportError(text)
    assert (end.value.exit_code, "not enough memory" in capsys.readouterr().err) == (3, True)
    with pytest.raises(ImportError, match="no such name"), ending(Command()):
        raise ImportError("no such name")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="a shell that can close a stream")
def test_without_an_open_stderr_the_answer_is_the_same(tmp_path):
    """A file opened next would take the closed stream's number, and all narration."""
    command = f"exec {shlex.quote(sys.executable)} -m sealtwin validate nowhere --json 2>&-"
    answer = subprocess.run(command, shell=True, stdout=subprocess.PIPE, cwd=tmp_path, text=True, check=False)
    assert answer.returncode == 3
    assert "nowhere: not a run folder" in json.loads(answer.stdout)["error"]
    digits = f"exec {shlex.quote(sys.executable)} -m sealtwin init lab >&- 2>&-"
    assert subprocess.run(digits, shell=True, cwd=tmp_path, check=False).returncode == 0
    assert (tmp_path / "lab" / "trial.toml").is_file()
