"""A run folder belongs to one trial file, or to one photo, mesh or drawing."""

import shutil

import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.core.record_files import read_outline
from tests.support.tiny_study import tiny_lab

OPTIONS = ("--depth-mm", "8", "--mm-per-px", "0.4", "--ends", "40,101", "160,98")


@pytest.fixture
def samples(tmp_path, monkeypatch):
    """Two folders with a photo of the same name. The second crack is the first one, upside down."""
    import cv2

    monkeypatch.chdir(tmp_path)
    tiny_lab(tmp_path / "S31")
    photo = cv2.imread(str(tmp_path / "S31/crack.png"))
    for name, picture in {"S31": photo, "S50": cv2.flip(photo, 0)}.items():
        (tmp_path / name).mkdir(exist_ok=True)
        cv2.imwrite(str(tmp_path / name / "photo.png"), picture)
    return tmp_path


def _call(*words):
    return CliRunner().invoke(app, list(map(str, words)))


def _trial(folder):
    """Write a trial without a name, as 'sealtwin init' does."""
    (folder / "trial.toml").write_text(
        '[photo]\nfile = "photo.png"\ndata = "synthetic"\nmm_per_px = 0.4\nends_px = [[40, 101], [160, 98]]\n'
        "[crack]\ndepth_mm = 8.0\n"
    )
    return folder / "trial.toml"


def test_two_photos_and_two_trials_of_the_same_name_keep_both_results(samples):
    for name in ("S31", "S50"):
        assert _call("digitise", f"{name}/photo.png", *OPTIONS).exit_code == 0
    first, second = (read_outline(samples / "reports" / name) for name in ("S31", "S50"))
    assert abs(first.centreline_px - second.centreline_px).max() > 1
    shutil.rmtree("reports")
    for name in ("S31", "S50"):
        assert _call("digitise", _trial(samples / name).relative_to(samples)).exit_code == 0
    assert {path.name for path in (samples / "reports").iterdir()} == {"S31", "S50"}


@pytest.mark.parametrize("kind", ["photo", "trial"])
def test_a_folder_with_the_results_of_another_file_is_refused_and_unchanged(samples, kind):
    files = {name: f"{name}/photo.png" if kind == "photo" else _trial(samples / name) for name in ("S31", "S50")}
    more = OPTIONS if kind == "photo" else ()
    assert _call("digitise", files["S31"], *more, "--out", "same").exit_code == 0
    before = {path.name: path.read_bytes() for path in (samples / "same").iterdir() if path.name != ".lock"}
    refused = _call("digitise", files["S50"], *more, "--out", "same")
    assert refused.exit_code == 3
    assert all(part in refused.stderr for part in ("S31", "S50", "--out"))
    assert {path.name: path.read_bytes() for path in (samples / "same").iterdir() if path.name != ".lock"} == before


def test_a_moved_project_and_a_renamed_photo_are_not_locked_out(samples):
    assert _call("digitise", "S31/photo.png", *OPTIONS, "--out", "S31/run").exit_code == 0
    shutil.move("S31", "archive")
    assert "nothing to redo" in _call("digitise", "archive/photo.png", *OPTIONS, "--out", "archive/run").stderr
    shutil.move("archive/photo.png", "archive/again.png")
    assert _call("digitise", "archive/again.png", *OPTIONS, "--out", "archive/run").exit_code == 0


def test_stages_take_a_trial_file_and_its_changed_settings(samples):
    trial = _trial(samples / "S31")
    trial.write_text(
        trial.read_text() + '[fluid]\nviscosity_pa_s = 0.3\nyield_stress_pa = 3.0\nfreeze_after_s = "never"\n'
        '[solver]\nmodel = "slot"\n'
    )
    assert _call("digitise", trial).exit_code == 0
    assert _call("simulate", trial).exit_code == 0
    trial.write_text(trial.read_text().replace("= 3.0", "= 4.0"))
    assert "fluid" in _call("validate", trial).stderr, "the run has another yield stress"
    assert _call("simulate", trial).exit_code == 0
    assert "yield_stress_pa = 4.0" in (samples / "reports/S31/trial.toml").read_text()
