"""'sealtwin import-mesh', and a trial whose sample is a mesh, from file to report."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from tests.support.coarse_trial import make_coarse
from tests.support.meshes import mesh_of, slotted
from tests.support.processes import refusal, sealtwin
from tests.support.shapes import wandering_crack


def write(path: Path, inches: bool = False) -> Path:
    vertices, faces = mesh_of(slotted())
    trimesh.Trimesh(vertices / (25.4 if inches else 1.0), faces, process=False).export(path)
    return path


def test_a_mesh_becomes_a_run_folder_like_any_other(tmp_path):
    scan = write(tmp_path / "scan.stl", inches=True)
    done = sealtwin("import-mesh", scan, "--units", "inch", "--out", tmp_path / "run", "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert result["sample"]["cavity_volume_mm3"] == pytest.approx(2400.0, abs=0.1)
    assert (result["sample"]["path_source"], result["sample"]["scale_source"]) == ("mesh", "mesh in inch: scan.stl")
    names = "crack.stl crack.ply solid.json outline.json overlay.png trajectory.csv trial.toml"
    assert {path.name for path in (tmp_path / "run").iterdir()} >= {*names.split()}
    assert trimesh.load_mesh(tmp_path / "run" / "crack.stl").is_watertight
    again = sealtwin("import-mesh", scan, "--units", "inch", "--out", tmp_path / "run")
    assert "nothing to redo" in again.stderr
    assert f"sealtwin simulate {tmp_path / 'run'}'" in refusal("run", tmp_path / "run" / "trial.toml")


def test_a_wrong_unit_is_refused_with_the_right_one(tmp_path):
    scan = write(tmp_path / "scan.stl")
    assert "The file is probably in mm" in refusal("import-mesh", scan, "--units", "m", "--out", tmp_path / "run")
    assert not (tmp_path / "run" / "trial.toml").exists()
    none = tmp_path / "none.stl"
    assert "none.stl: not found" in refusal("import-mesh", none, "--units", "mm", "--out", tmp_path / "new")
    assert not (tmp_path / "new").exists()


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
    done = sealtwin("run", trial, "--out", tmp_path / "run", "--device", "cpu", "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert (result["fluid"]["escaped_particles"], result["fluid"]["spilled_particles"]) == (0, 0)
    assert result["sample"]["cavity_volume_mm3"] == pytest.approx(solid.cavity_volume_mm3, rel=1e-3)
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "The walls are those of the mesh" in page
    assert "the mesh is synthetic" in page
