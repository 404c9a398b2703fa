"""Ends of the trace page: a trial is saved, saving is refused, or the command stops."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from sealtwin.trial.trial_file import load_trial
from tests.support.paths import FIXTURE

pytestmark = pytest.mark.browser
SAID = {
    "a ruler": "ruler_px = [[261.4, 657.8], [1861.3, 659.7]]\nruler_mm = 160",
    "corners of the face": "face_mm = [160.0, 40.0]\n"
    "face_corners_px = [[265.6, 657.8], [1861.3, 659.7], [1864.6, 258.4], [261.4, 260.2]]",
    "an assumed scale": 'mm_per_px = 0.1\nscale_is = "assumed"',
    "a box and via points": "mm_per_px = 0.1\nvia_px = [[900.25, 550.125]]\nroi_px = [[200, 200], [1900, 700]]",
    "a polygon": "mm_per_px = 0.1\nroi_px = [[200, 200], [1900, 210.5], [1900, 700], [210, 690]]",
}


def test_saving_the_page_writes_the_trial_and_ends_the_command(open_page, tmp_path):
    shutil.copytree(FIXTURE, tmp_path / "lab")
    trial = tmp_path / "lab" / "trial.toml"
    before = trial.read_text()
    bench = open_page(trial)
    bench.await_state("walls")
    bench.page.click("#swap")
    bench.await_state("walls")
    bench.page.keyboard.press("Control+s")
    bench.page.wait_for_selector("#farewell[open]")
    assert "ends_px" in bench.text("#farewell-text")
    assert bench.text("#farewell-next") == f"sealtwin run {trial}"
    assert bench.command.wait(10) == 0
    changed = [line for line in trial.read_text().splitlines() if line not in before.splitlines()]
    assert changed == ["ends_px = [[1402.7, 258.9], [719.3, 658.4]]"]


@pytest.mark.parametrize("hints", SAID)
def test_opening_and_saving_a_trial_leaves_its_bytes_unchanged(open_page, tmp_path, hints):
    shutil.copy(FIXTURE / "photo.jpg", tmp_path)
    trial = tmp_path / "trial.toml"
    ends = "ends_px = [[719.3, 658.4], [1402.7, 258.9]]"
    trial.write_text(
        f'name = "x"\n[photo]\nfile = "photo.jpg"\ndata = "synthetic"\n{ends}\n{SAID[hints]}\n[crack]\ndepth_mm = 16\n'
    )
    before = trial.read_bytes()
    bench = open_page(trial)
    bench.await_state("walls", "refused")
    assert bench.text("#refusal") == ""
    assert bench.text("#length").endswith("mm")
    bench.page.click("#save")
    bench.page.wait_for_selector("#farewell[open]")
    assert "nothing had changed" in bench.text("#farewell-text")
    assert trial.read_bytes() == before


def test_a_traced_photo_can_be_saved_only_with_scale_and_depth(open_page, shot, tmp_path):
    photo = Path(shutil.copy(shot.file, tmp_path))
    bench = open_page(photo)
    bench.give_ends(shot)
    for missing, selector, value in (("depth", "#depth-mm", "16"), ("scale", "#mm-per-px", f"{shot.mm_per_px:.5f}")):
        bench.page.click("#save")
        lacks = bench.text("#save-refused").lower()
        assert missing in lacks
        assert "scale" in lacks, "all that is missing is said at once"
        if missing == "scale":
            bench.page.check("input[value=mm_per_px]")
        bench.page.fill(selector, value)
        bench.page.keyboard.press("Enter")
    bench.page.click("#save")
    bench.page.wait_for_selector("#farewell[open]")
    assert bench.command.wait(10) == 0
    new = load_trial(photo.with_suffix(".toml"))
    assert new.photo is not None
    assert new.crack is not None
    assert new.photo.ends_px is not None
    assert (new.crack.depth_mm, new.photo.mm_per_px) == (16.0, pytest.approx(shot.mm_per_px, abs=1e-5))
    # One screen pixel is two or three of the photo.
    assert np.allclose(new.photo.ends_px, [shot.along(0.05), shot.along(0.95)], atol=4)


def test_the_page_reports_that_its_command_has_stopped(bench, shot):
    bench.await_state("refused")
    bench.command.terminate()
    bench.command.wait(10)
    bench.click(shot.along(0.05))
    bench.click(shot.along(0.95))
    bench.page.wait_for_selector("#farewell[open]")
    assert "has stopped" in bench.text("#farewell-text")
    bench.complaints.clear()  # Chromium logs the refused connections
