"""The command line: answers, exit codes, and one sentence for each fault."""

import errno
import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from sealtwin.cli.answer import Command, ending
from sealtwin.core import files
from tests.support.paths import FIXTURE
from tests.support.photos import mortar, with_crack, write_png
from tests.support.processes import refusal, sealtwin
from tests.support.robot_cells import PHOTO_CELL
from tests.support.tiny_study import tiny_lab

LINE = [(40, 150), (460, 140)]


@pytest.fixture
def trial(tmp_path):
    return tiny_lab(tmp_path).with_name("trial.toml")


@pytest.mark.parametrize(
    ("file", "content", "named"),
    [
        ("crack.png", None, "crack.png: not found"),
        ("readings.csv", "s_mm,height\n0,-16\n", "readings.csv: column B 'height'"),
    ],
)
def test_an_unusable_input_file_is_refused_before_the_simulation(trial, tmp_path, file, content, named):
    """Minutes of simulation must not pass before a typo in the sheet is found."""
    trial.with_name(file).unlink()
    if content is not None:
        trial.with_name(file).write_text(content)
    assert named in refusal("run", trial, "--out", tmp_path / "run", "--quiet")
    assert not (tmp_path / "run" / "particles.csv").exists()
    assert content is not None or not (tmp_path / "run").exists()


def test_the_error_for_an_absent_device_names_the_device(trial, tmp_path):
    assert "cuda:7" in refusal("run", trial, "--out", tmp_path / "run", "--device", "cuda:7", "--quiet")


def test_the_error_for_an_output_folder_that_cannot_be_written_names_the_folder(trial, tmp_path):
    (tmp_path / "dangling").symlink_to(tmp_path / "none" / "there")
    (tmp_path / "mine").write_text("mine")
    for out in (Path("/proc/nowhere"), tmp_path / ("x" * 300), tmp_path / "dangling", tmp_path / "mine"):
        assert out.name in refusal("run", trial, "--out", out, "--quiet")
    assert (tmp_path / "mine").read_text() == "mine"


def test_the_demo_does_not_overwrite_files_of_the_user(tmp_path):
    mine = tmp_path / "mine" / "trial" / "caliper.csv"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    assert "caliper.csv" in refusal("demo", "--out", tmp_path / "mine")
    assert {file: file.read_text() for file in (tmp_path / "mine").rglob("*") if file.is_file()} == {mine: "mine"}


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("digitise photo.png --depth-mm 16 --ends 12 340 1 2", "--ends"),
        ("sweep study.toml --jbs 2", "--jbs"),
    ],
)
def test_a_wrong_command_line_with_json_gives_the_error_as_json(line, named):
    """The parser finds some of these faults, and commands the others. Without --json stdout stays empty."""
    answer = sealtwin(*shlex.split(line), "--json")
    error = json.loads(answer.stdout)
    assert (error["version"], error["exit_code"], answer.exit_code) == (1, 2, 2)
    assert named in error["error"]
    assert named in answer.stderr
    assert not sealtwin(*shlex.split(line)).stdout


def test_a_second_digitise_command_for_the_same_trial_changes_no_file(trial, tmp_path):
    """The JSON answer equals run.json. Files of the run folder contain no path of this machine."""
    run = tmp_path / "run"
    answer = sealtwin("digitise", trial, "--out", run, "--json")
    assert answer.exit_code == 0, answer.output
    result = json.loads(answer.stdout)
    assert result == json.loads((run / "run.json").read_text())
    assert result["version"] == 2
    before = {path: path.stat().st_mtime_ns for path in run.iterdir() if not path.name.startswith(".")}
    assert "nothing to redo" in sealtwin("digitise", trial, "--out", run).stderr
    assert before == {path: path.stat().st_mtime_ns for path in before}
    for name in ("manifest.json", "trial.toml", "outline.json", "solid.json"):
        text = (run / name).read_text()
        assert [place for place in (str(tmp_path), str(Path.home())) if place in text] == [], name


@pytest.fixture
def thin(tmp_path):
    """Arguments for the photo of a crack 5 px wide, and its run folder."""
    photo = write_png(tmp_path / "crack.png", with_crack(mortar(), LINE, width_px=4))
    ends = ("--ends", "40,150", "460,140")
    return (photo, "--mm-per-px", 0.1, *ends, "--out", tmp_path / "run", "--quiet"), tmp_path / "run"


def test_a_crack_path_without_a_depth_cannot_be_simulated(thin, tmp_path):
    arguments, out = thin
    answer = sealtwin("digitise", *arguments, "--set", "photo.path_only=true", "--set", "path.volume_ml=0.5")
    assert answer.exit_code == 0, answer.output
    assert (out / "trajectory.csv").is_file()
    assert not list(out.glob("crack.*"))
    for command in ("simulate", "validate"):
        assert "has only the crack's path" in refusal(command, out)
    cell = tmp_path / "cell.toml"
    cell.write_text(PHOTO_CELL)
    for line in (("robot", out, "--cell", cell), ("digitise", *arguments, "--depth-mm", 16)):
        answer = sealtwin(*line)
        assert answer.exit_code == 0, answer.output
    result, outline = (json.loads((out / name).read_text()) for name in ("run.json", "outline.json"))
    assert result["sample"]["width_source"] == outline["width_source"] == "fit"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a file that is always full")
def test_a_full_disk_at_stdout_gives_a_message_without_a_traceback(tmp_path):
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "sealtwin", "init", "lab"]
        answer = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, cwd=tmp_path, text=True, check=False)
    assert (answer.returncode, "standard output" in answer.stderr, "Traceback" in answer.stderr) == (3, True, False)


@pytest.mark.parametrize("text", ["x.so: failed to map segment from shared object", "x.so: Cannot allocate memory"])
def test_an_import_error_for_lack_of_memory_gives_exit_code_3(text, capsys):
    with pytest.raises(typer.Exit) as end, ending(Command()):
        raise ImportError(text)
    assert (end.value.exit_code, "not enough memory" in capsys.readouterr().err) == (3, True)
    with pytest.raises(ImportError, match="no such name"), ending(Command()):
        raise ImportError("no such name")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process without a signal")
def test_sigterm_ends_a_command_as_ctrl_c_does(tmp_path):
    """Docker stop and a cluster's scheduler send it; the command ended without a word."""
    shutil.copy(FIXTURE / "photo.jpg", tmp_path)
    command = [sys.executable, "-m", "sealtwin", "trace", tmp_path / "photo.jpg", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("Trace page")
        process.terminate()
        _, stderr = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "sealtwin: interrupted" in stderr


def test_after_a_full_disk_the_same_init_completes_the_folder(tmp_path, monkeypatch):
    """The first file stayed, and the second call refused to continue."""
    kept = files.write_bytes

    def full(path, content):
        if path.suffix == ".xlsx":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        kept(path, content)

    with monkeypatch.context() as patch:
        patch.setattr(files, "write_bytes", full)
        assert "Free some space" in refusal("init", tmp_path / "new")
    assert sealtwin("init", tmp_path / "new").exit_code == 0
    assert {file.name for file in (tmp_path / "new").iterdir()} >= {"trial.toml", "caliper.xlsx"}
    (tmp_path / "new" / "trial.toml").write_text("# mine\n")
    assert "already exists" in refusal("init", tmp_path / "new")
