"""'sealtwin robot': programs written from a run folder, and refusals."""

import json
import shutil
from pathlib import Path

import pytest

from digitise.robots.cell import LANGUAGES
from sealtwin.core import files
from sealtwin.core.files import sha256
from sealtwin.trial.starter_files import CELL
from tests.digitise.robots.test_cell import uncommented
from tests.support.ingested_lab import edit
from tests.support.paths import FIXTURE
from tests.support.processes import sealtwin
from tests.support.robot_cells import PHOTO_CELL, TAUGHT_CELL

EVERY = {language.file for language in LANGUAGES.values()} | {"robot.json"}


@pytest.fixture(scope="module")
def digitised(tmp_path_factory) -> Path:
    lab = tmp_path_factory.mktemp("lab")
    answer = sealtwin("digitise", FIXTURE / "trial.toml", "--out", lab / "run", "--quiet")
    assert answer.exit_code == 0, answer.stderr
    return lab / "run"


@pytest.fixture
def run(digitised, tmp_path) -> Path:
    """A copy that a test may spoil."""
    return Path(shutil.copytree(digitised, tmp_path / "run"))


@pytest.fixture
def cell(tmp_path) -> Path:
    """The example, with all its tables."""
    text = TAUGHT_CELL
    for old, new in uncommented("plunger", *LANGUAGES):
        text = text.replace(old, new, 1)
    path = tmp_path / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _left(folder: Path) -> dict[str, str]:
    """Every file below a folder but its lock, with its hash."""
    return {
        path.relative_to(folder).as_posix(): sha256(path)
        for path in folder.rglob("*")
        if path.is_file() and path.name != ".lock"
    }


def _refusal(run: Path, *arguments) -> str:
    """The sentences of a command that must end with exit code 3 and leave the run as it was."""
    before = _left(run)
    answer = sealtwin("robot", run, *arguments)
    assert answer.exit_code == 3, answer.output
    assert "Traceback" not in answer.output
    assert answer.stdout == ""
    assert _left(run) == before
    return answer.stderr


def _written(run: Path, cell: Path, formats: str) -> set[str]:
    """Names of the files that a command leaves in the run's folder of the robot."""
    answer = sealtwin("robot", run, "--cell", cell, "--format", formats)
    assert answer.exit_code == 0, answer.stderr
    return {path.name for path in (run / "robot").iterdir()}


def test_every_robot_program_states_its_origin(run, cell):
    assert _written(run, cell, ",".join(LANGUAGES)) == EVERY
    report = files.read_json(run / "robot" / "robot.json")
    for name, mark in (("path.prg", "'"), ("path.gcode", ";"), ("path.script", "#")):
        head = (run / "robot" / name).read_text(encoding="utf-8")
        assert f"{mark} trial paper-trial, run run\n" in head
        assert f"{mark} path found by: ends\n" in head
        assert f"{mark} trajectory.csv sha256 {sha256(run / 'trajectory.csv')}\n" in head
        assert f"{mark} frame: 3 taught points, worst residual 0.000 mm, scale 1.00000, face 0.00 degrees" in head
        assert f"{mark} Units: " in head
        assert report["files"][name] == sha256(run / "robot" / name)
    assert report["inputs"]["cell.toml"] == sha256(cell)


def test_only_the_requested_robot_formats_are_written(run, cell):
    answer = sealtwin("robot", run, "--cell", cell, "--format", "csv,gcode")
    assert {path.name for path in (run / "robot").iterdir()} == {"path.csv", "path.gcode", "robot.json"}
    report = json.loads((run / "robot" / "robot.json").read_text())
    # 80 mm of crack, less two trims of 10, at 4 mm/s; an open end is good to a millimetre.
    assert report["length_mm"] == pytest.approx(60.0, abs=2.0)
    assert report["duration_s"] == pytest.approx(report["length_mm"] / 4.0, rel=1e-6)
    assert answer.stdout.startswith(f"Path: {report['length_mm']:.1f} mm in {report['duration_s']:.1f} s, 4.8 ml;")
    assert sealtwin("robot", run, "--cell", cell, "--format", "csv,krl").exit_code == 3
    assert sealtwin("robot", run).exit_code == 2


def test_a_refused_format_leaves_no_file_of_any_format(run, cell):
    edit(cell, "blend_mm = 0.4", "blend_mm = 0.9")
    assert "urscript.blend_mm is 0.9" in _refusal(run, "--cell", cell, "--format", "csv,urscript")
    cell.write_text(TAUGHT_CELL, encoding="utf-8")
    assert "the format gcode requires a table [gcode]" in _refusal(run, "--cell", cell, "--format", "gcode")


def test_a_robot_program_names_the_paths_source_and_files_edited_by_hand(run, cell):
    outline = files.read_json(run / "outline.json")
    files.write_json(run / "outline.json", {**outline, "path_source": "choice"})
    assert sealtwin("robot", run, "--cell", cell).exit_code == 0
    assert files.read_json(run / "robot" / "robot.json")["edited_by_hand"] == ["outline.json"]
    assert "path found by: choice" in (run / "robot" / "path.prg").read_text()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("robot_mm = [210.0, -80.0, 55.0]", "robot_mm = [290.0, -80.0, 55.0]", "the taught points are mirrored"),
        ("high_mm = [350.0, 150.0, 200.0]", "high_mm = [350.0, 0.0, 200.0]", "out of the reach box"),
        ("acceleration_mm_s2", "acceleration", "motion.acceleration: no such key; did you mean 'acceleration_mm_s2'?"),
    ],
)
def test_an_unusable_robot_cell_is_refused_with_the_reason(run, cell, old, new, says):
    edit(cell, old, new)
    stderr = _refusal(run, "--cell", cell)
    assert "cell.toml: " in stderr
    assert says in stderr


@pytest.mark.parametrize("taught_in", ["sample", "photo"])
@pytest.mark.parametrize(("scale_residual_mm", "face_mm"), [(0.01, None), (None, [0, 0, 160, 40]), (None, None)])
def test_a_path_is_refused_if_its_points_were_taught_in_another_frame(run, cell, taught_in, scale_residual_mm, face_mm):
    """Markers have a residual, and a ruler has neither. In the photo's frame, the path lay 108 mm beside the crack."""
    outline = files.read_json(run / "outline.json") | {"scale_residual_mm": scale_residual_mm, "face_mm": face_mm}
    files.write_json(run / "outline.json", outline)
    cell.write_text(PHOTO_CELL if taught_in == "photo" else TAUGHT_CELL, encoding="utf-8")
    has_origin = scale_residual_mm is not None or face_mm is not None
    if has_origin == (taught_in == "sample"):
        assert sealtwin("robot", run, "--cell", cell).exit_code == 0
    else:
        assert "taught_in" in _refusal(run, "--cell", cell)


def test_a_missing_robot_cell_and_an_unfinished_run_are_refused(run, cell, tmp_path):
    assert "'sealtwin robot --example cell.toml' writes an example" in _refusal(run, "--cell", tmp_path / "none.toml")
    manifest = files.read_json(run / "manifest.json")
    files.write_json(run / "manifest.json", {**manifest, "stages": {}})
    assert "digitise is not finished" in _refusal(run, "--cell", cell)
    (tmp_path / "empty").mkdir()
    assert sealtwin("robot", tmp_path / "empty", "--cell", cell).exit_code == 3


def test_robot_files_in_another_folder_replace_only_earlier_robot_files(run, cell, tmp_path):
    out = tmp_path / "stick"
    for kind, name in (("csv", "path.csv"), ("csv", "path.csv"), ("spel", "path.prg")):
        assert sealtwin("robot", run, "--cell", cell, "--format", kind, "--out", out).exit_code == 0
        # Files of the previous call could be taken for those of this call.
        assert {path.name for path in out.iterdir()} == {name, "robot.json"}
    assert not (run / "robot").exists()
    (out / "path.csv").write_text("mine")
    (out / "notes.txt").write_text("mine")
    assert "path.csv: 'sealtwin robot' did not write this file, or it was changed" in _refusal(
        run, "--cell", cell, "--format", "csv", "--out", out
    )
    assert sealtwin("robot", run, "--cell", cell, "--format", "spel", "--out", out).exit_code == 0
    (out / "path.prg").write_text("edited")
    refusal = _refusal(run, "--cell", cell, "--format", "gcode", "--out", out)
    assert "path.prg: 'sealtwin robot' did not write this file, or it was changed" in refusal
    left = {path.name: path.read_text() for path in out.iterdir() if path.name != "robot.json"}
    assert left == {"path.csv": "mine", "notes.txt": "mine", "path.prg": "edited"}


def test_a_forged_robot_json_deletes_no_other_files(run, cell, tmp_path):
    (tmp_path / "diary.txt").write_text("mine")
    forged = {"files": {"../diary.txt": sha256(tmp_path / "diary.txt")}}
    files.write_json(tmp_path / "stick" / "robot.json", forged)
    call = ("robot", run, "--cell", cell, "--format", "spel", "--out", tmp_path / "stick")
    assert sealtwin(*call).exit_code == 0
    assert (tmp_path / "diary.txt").read_text() == "mine"
    (tmp_path / "stick" / "robot.json").write_text("[]")
    assert sealtwin(*call).exit_code == 3


@pytest.mark.slow
def test_a_new_path_removes_the_robot_programs_of_the_old_path(run, cell):
    """A robot must not follow the old path while the report shows the new path."""
    assert sealtwin("robot", run, "--cell", cell).exit_code == 0
    listed = files.read_json(run / "manifest.json")["stages"]["robot"]["outputs"]
    assert set(listed) == {"robot/path.prg", "robot/path.csv", "robot/robot.json"}
    (run / "robot" / "path.prg").write_text("' mine now\n")
    answer = sealtwin("digitise", FIXTURE / "trial.toml", "--set", "path.reverse=true", "--out", run)
    assert answer.exit_code == 0, answer.stderr
    assert {path.name for path in (run / "robot").iterdir()} == {"path.changed.prg"}
    assert "robot" not in files.read_json(run / "manifest.json")["stages"]


def test_the_example_option_of_robot_writes_a_cell_file_without_a_run_folder(tmp_path, run):
    answer = sealtwin("robot", "--example", tmp_path / "mine.toml")
    assert answer.exit_code == 0
    assert (tmp_path / "mine.toml").read_text() == CELL.replace("{file}", "mine.toml")
    (fault,) = _refusal(run, "--cell", tmp_path / "mine.toml").splitlines()
    assert "mine.toml: taught is missing" in fault
    (tmp_path / "mine.toml").write_text("# mine\n")
    assert sealtwin("robot", "--example", tmp_path / "mine.toml").exit_code == 3
    assert sealtwin("robot", run, "--example", tmp_path / "other.toml").exit_code == 2
    assert not (tmp_path / "other.toml").exists()
