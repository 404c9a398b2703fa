"""Commands of samples: digitise with meshes and drawings, export and markers."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

from tests.support.meshes import mesh_of, slotted
from tests.support.processes import refusal, sealtwin
from tests.support.tiny_study import TRIAL, tiny_lab


def write(path: Path, inches: bool = False) -> Path:
    vertices, faces = mesh_of(slotted())
    trimesh.Trimesh(vertices / (25.4 if inches else 1.0), faces, process=False).export(path)
    return path


def test_a_mesh_becomes_a_digitised_run_folder(tmp_path):
    scan, run = write(tmp_path / "scan.stl", inches=True), tmp_path / "run"
    command = ("digitise", scan, "--units", "inch", "--out", run)
    done = sealtwin(*command, "--json")
    assert done.exit_code == 0, done.output
    sample = json.loads(done.stdout)["sample"]
    assert sample["cavity_volume_mm3"] == pytest.approx(2400.0, abs=0.1)
    assert (sample["path_source"], sample["scale_source"]) == ("mesh", "mesh in inch: scan.stl")
    names = "crack.stl crack.ply solid.json outline.json overlay.png trajectory.csv trial.toml"
    assert {path.name for path in run.iterdir()} >= {*names.split()}
    assert trimesh.load_mesh(run / "crack.stl").is_watertight
    assert "nothing to redo" in sealtwin(*command).stderr
    assert "nothing to redo" in sealtwin("digitise", run / "trial.toml").stderr
    scan.unlink()
    assert f"sealtwin simulate {run}'" in refusal("run", run / "trial.toml")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A digitised run of a crack of 50 mm."""
    trial = tiny_lab(tmp_path_factory.mktemp("lab")).with_name("trial.toml")
    trial.write_text(TRIAL.replace("mm_per_px = 0.1", "mm_per_px = 0.4"))
    assert sealtwin("digitise", trial, "--out", trial.with_name("run")).exit_code == 0
    return trial.with_name("run")


def test_a_crack_exported_to_dxf_and_imported_again_is_the_same(run, tmp_path):
    written = sealtwin("export", run, "--format", "mask,dxf", "--out", tmp_path / "out", "--json")
    assert written.exit_code == 0, written.output
    names = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert names == ["crack.dxf", "crack_mask.png"]
    before = json.loads((run / "run.json").read_text())["sample"]
    for number, layers in enumerate((("WALL_LEFT", "WALL_RIGHT"), ("WALL_RIGHT", "WALL_LEFT"))):
        folder, how = tmp_path / f"drawn{number}", ("--walls", *layers)
        drawn = sealtwin("digitise", tmp_path / "out/crack.dxf", "--depth-mm", 8, *how, "--out", folder, "--json")
        assert drawn.exit_code == 0, drawn.output
        after = json.loads(drawn.stdout)["sample"]
        assert after["length_mm"] == pytest.approx(before["length_mm"], rel=0.03)
        assert after["mean_width_mm"] == pytest.approx(before["mean_width_mm"], rel=0.05)
        assert (folder / "trial.toml").is_file()


@pytest.mark.parametrize("kind", ["photo", "mesh", "drawing"])
def test_a_process_leaves_no_line_of_a_library_on_the_terminal(run, tmp_path, kind):
    """Nanobind writes the objects that a process leaks as it ends."""
    depth, given = ("--depth-mm", "8"), {"photo": [run / "trial.toml"], "mesh": [write(tmp_path / "scan.stl")]}
    if kind == "drawing":
        assert sealtwin("export", run, "--format", "dxf", "--out", tmp_path).exit_code == 0
        given[kind] = [tmp_path / "crack.dxf", *depth, "--walls", "WALL_LEFT", "WALL_RIGHT"]
    elif kind == "mesh":
        given[kind] += ["--units", "mm"]
    line = [Path(sys.executable).with_name("sealtwin"), "digitise", *given[kind], "--out", tmp_path / "run", "--quiet"]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    assert [text for text in done.stderr.splitlines() if not text.startswith("note: ")] == []


def test_the_export_command_refuses_foreign_folders_and_existing_files(run, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "crack_mask.png").write_text("mine")
    for folder, out, named in (
        (tmp_path, "out", "not a run folder"),
        (run, "mine", "crack_mask.png: already exists"),
    ):
        assert named in refusal("export", folder, "--format", "mask", "--out", tmp_path / out)
    assert not (tmp_path / "out").exists()
    assert [(file.name, file.read_text()) for file in mine.iterdir()] == [("crack_mask.png", "mine")]


@pytest.mark.parametrize("options", ["", "--line L", "--line A --width-mm 3 --walls B C", "--walls B C --depth-mm 1e9"])
def test_invalid_settings_of_a_drawing_are_refused(tmp_path, options):
    (tmp_path / "a.dxf").write_text("")
    answer = sealtwin("digitise", tmp_path / "a.dxf", "--depth-mm", 8, "--out", tmp_path / "out", *options.split())
    assert answer.exit_code == (2 if options.count("depth") else 3)


@pytest.mark.parametrize(("name", "content"), [("a.dxf", b"\x00\xff" * 50), ("a.dwg", b"AC1032"), ("b", None)])
def test_a_file_that_is_not_a_drawing_is_refused(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert name in refusal("digitise", tmp_path / name, "--depth-mm", 8, "--walls", "A", "B", "--out", tmp_path / "out")


FRAME = ("markers", "--face-mm", "160x40", "--out")


@pytest.mark.parametrize("names", [("mine.pdf", "board.toml"), ("frame.pdf", "mine.pdf")])
def test_a_marker_frame_or_its_table_overwrites_no_existing_file(tmp_path, names):
    """A user who gives the trial's name to --toml must not lose the trial."""
    (tmp_path / "mine.pdf").write_text("mine")
    frame, table = (tmp_path / name for name in names)
    assert "mine.pdf: already exists" in refusal(*FRAME, frame, "--toml", table)
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("mine.pdf", "mine")]


@pytest.mark.parametrize(
    ("arguments", "code", "named"),
    [
        ("--face-mm 160", 3, "--face-mm"),
        ("--face-mm 160x40 --out frame.png", 3, ".pdf"),
        ("--face-mm 160x40 --toml frame.pdf", 3, "same file"),
    ],
)
def test_a_marker_frame_that_cannot_be_printed_is_refused(tmp_path, monkeypatch, arguments, code, named):
    monkeypatch.chdir(tmp_path)
    answer = sealtwin("markers", *arguments.split(), *([] if "--out" in arguments else ["--out", "frame.pdf"]))
    assert answer.exit_code == code
    assert named in " ".join(answer.stderr.replace("│", " ").split())
    assert not list(tmp_path.iterdir())
