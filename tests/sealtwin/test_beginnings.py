"""One photo, depth, scale and the same two clicks by the six beginnings: one cavity, one volume, one path."""

import json
import re
import shutil

import pytest

import sealtwin as st
from digitise.trace_page.session import Shape
from sealtwin.core.record_files import read_record, read_trajectory
from sealtwin.core.solid_figures import SolidFigures
from sealtwin.trial.starter_files import SEALANT
from sealtwin.trial.trace_photo import opened
from sealtwin.trial.trial_file import UNMEASURED
from tests.support.processes import sealtwin
from tests.support.tiny_study import tiny_lab

ENDS = [[40.0, 101.0], [160.0, 98.0]]
OPTIONS = ("--depth-mm", 12, "--mm-per-px", 0.4, "--ends", "40,101", "160,98")
PHOTO = {"photo.mm_per_px": 0.4, "photo.ends_px": ENDS, "crack.depth_mm": 12.0}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Run folder, and the names of what was assumed, by the beginning."""
    home = tmp_path_factory.mktemp("home")
    tiny_lab(home / "given")
    photo = home / "given" / "photo.png"
    shutil.move(home / "given" / "crack.png", photo)
    (home / "given" / "trial.toml").unlink()

    def made(*line, out):
        answer = sealtwin(*line, "--out", out)
        assert answer.exit_code == 0, answer.output
        return out

    made("digitise", photo, *OPTIONS, out=home / "digitise")
    made("quick", photo, *OPTIONS, "--set", "solver.model=slot", out=home / "quick")
    page = opened(photo, PHOTO)
    page.save(page.session.hints, Shape(depth_mm=12.0))
    made("digitise", photo.with_suffix(".toml"), out=home / "trace")
    sealtwin("init", home / "S31")
    trial = home / "S31" / "trial.toml"
    text = re.sub(r"(?m)^mm_per_px = 0.1 ", "mm_per_px = 0.4 ", trial.read_text()).replace(
        "depth_mm = 16.0", "depth_mm = 12.0"
    )
    trial.write_text(text.replace('file = "photo.jpg"', f'file = "../given/photo.png"\nends_px = {ENDS}'))
    made("digitise", trial, out=home / "init")
    (home / "lab").mkdir()
    shutil.copy(photo, home / "lab" / "P01.png")
    note = f'data = "synthetic"\n[photo]\nmm_per_px = 0.4\nends_px = {ENDS}\n[crack]\ndepth_mm = 12.0\n'
    (home / "lab" / "lab.toml").write_text(note)
    made("ingest", home / "lab", out=home / "taken")
    return {name: home / name for name in ("digitise", "quick", "trace", "init")} | {"ingest": home / "taken/P01/run"}


def _figures(folder):
    """Cavity and poured volume in mm3, length of the nozzle's path in mm."""
    path = read_trajectory(folder)
    figures = read_record(SolidFigures, folder / "solid.json")
    volume_mm3 = json.loads((folder / "solid.json").read_text())["cavity_volume_mm3"]
    assert figures.sealant_mm3 == pytest.approx(path.dispensed_mm3, rel=1e-6)
    return volume_mm3, path.dispensed_mm3, path.length_mm


def test_six_beginnings_have_one_cavity_one_volume_and_one_path(results):
    photo = st.read_photo(results["digitise"].parent / "given" / "photo.png", mm_per_px=0.4)
    path = st.plan_path(st.build_solid(st.trace_crack(photo, ENDS), depth_mm=12))
    python = path.solid.cavity_volume_mm3, path.dispensed_mm3, path.length_mm
    for name, folder in results.items():
        assert _figures(folder) == pytest.approx(python, rel=1e-6), name


def test_five_beginnings_assume_the_same_settings_in_the_same_words(results):
    words = {
        name: {text for text in json.loads((folder / "run.json").read_text())["assumed"] if "origin" not in text}
        for name, folder in results.items()
    }
    assert all(each == words["digitise"] for each in words.values()), words
    assert len(words["digitise"]) == len({*SEALANT, *UNMEASURED})
