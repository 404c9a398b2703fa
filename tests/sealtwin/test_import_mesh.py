"""'sealtwin import-mesh', and a trial whose sample is a mesh, from file to report."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.cli.app import app
from tests.coarse import make_coarse
from tests.meshes import mesh_of, slotted
from tests.shapes import wandering_crack


def write(path: Path, inches: bool = False) -> Path:
    vertices, faces = mesh_of(slotted())
    trimesh.Trimesh(vertices / (25.4 if inches else 1.0), faces, process=False).export(path)
    return path


def test_a_mesh_becomes_a_run_folder_like_any_other(tmp_path):
    scan = write(tmp_path / "scan.stl", inches=True)
    done = CliRunner().invoke(
        app, ["import-mesh", str(scan), "--units", "inch", "--out", str(tmp_path / "run"), "--json"]
    )
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert result["sample"]["cavity_volume_mm3"] == pytest.approx(2400.0, abs=0.1)
    assert (result["sample"]["path_source"], result["sample"]["scale_source"]) == ("mesh", "mesh in inch: scan.stl")
    made = {path.name for path in (tmp_path / "run").iterdir()}
    assert made >= {
        "crack.stl",
        "crack.ply",
        "solid.json",
        "outline.json",
        "overlay.png",
        "trajectory.csv",
        "trial.toml",
    }
    assert trimesh.load_mesh(tmp_path / "run" / "crack.stl").is_watertight
    again = CliRunner().invoke(app, ["import-mesh", str(scan), "--units", "inch", "--out", str(tmp_path / "run")])
    assert "nothing to redo" in again.stderr


def test_units_are_never_guessed(tmp_path):
    done = CliRunner().invoke(app, ["import-mesh", str(write(tmp_path / "scan.stl"))])
    assert done.exit_code == 2
    assert "--units" in done.output


def test_a_wrong_unit_is_refused_with_the_right_one(tmp_path):
    scan = write(tmp_path / "scan.stl")
    done = CliRunner().invoke(app, ["import-mesh", str(scan), "--units", "m", "--out", str(tmp_path / "run")])
    assert done.exit_code == 3
    assert "The file is probably in mm" in done.stderr
    assert not (tmp_path / "run" / "trial.toml").exists()


def test_a_mesh_has_a_depth_of_its_own(tmp_path):
    write(tmp_path / "scan.stl")
    trial = tmp_path / "trial.toml"
    trial.write_text(
        'name = "both"\n[mesh]\nfile = "scan.stl"\ndata = "synthetic"\nunits = "mm"\n[crack]\ndepth_mm = 9.0\n'
    )
    done = CliRunner().invoke(app, ["digitise", str(trial)])
    assert done.exit_code == 3
    assert "[mesh] with" in done.stderr


@pytest.mark.slow
def test_a_scan_is_injected_and_reported(tmp_path):
    """The paper's crack as a mesh in inches that stands on its side: no particle leaves it."""
    outline = wandering_crack()
    solid = build_solid(outline, CrackShape(depth_mm=16.0, tilt="flare", wall_angle_deg=5.5))
    stands = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    trial = make_coarse(tmp_path / "lab")
    trimesh.Trimesh(solid.vertices_mm @ stands.T / 25.4, solid.faces, process=False).export(trial.with_name("scan.stl"))
    text = trial.read_text(encoding="utf-8")
    mesh = '[mesh]\nfile = "scan.stl"\ndata = "synthetic"\nunits = "inch"\nup = "y"\n\n'
    trial.write_text(text[: text.index("[photo]")] + mesh + text[text.index("[path]") :], encoding="utf-8")
    done = CliRunner().invoke(app, ["run", str(trial), "--out", str(tmp_path / "run"), "--device", "cpu", "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert result["fluid"]["escaped_particles"] == 0
    assert result["fluid"]["spilled_particles"] == 0
    assert result["sample"]["cavity_volume_mm3"] == pytest.approx(solid.cavity_volume_mm3, rel=1e-3)
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "The walls stand as they do in the mesh" in page
    assert "the mesh is synthetic" in page
