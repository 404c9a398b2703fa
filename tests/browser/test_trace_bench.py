"""Walls, depth and tilt that a user draws or sets on the trace page."""

import numpy as np
import pytest

from digitise.geometry.polyline import signed_area
from sealtwin.core.progress import Progress
from sealtwin.core.record_files import read_outline
from sealtwin.core.run_folder import open_folder
from sealtwin.study.pipeline import run_stages
from sealtwin.trial.job import start_job
from sealtwin.trial.trial_file import load_trial

pytestmark = pytest.mark.browser


def draw(bench, trail_px):
    bench.page.mouse.move(*bench.at(trail_px[0]))
    bench.page.mouse.down()
    for place in trail_px[1:]:
        bench.page.mouse.move(*bench.at(place))
    bench.page.mouse.up()


def bulge(bench, aside_px):
    """Return a line that leaves the left wall outward by ``aside_px`` and returns to the wall."""
    wall, middle = (np.array(bench.probe("line", name)) for name in ("left-wall", "way"))
    part = wall[len(wall) // 3 : len(wall) // 2]
    outward = part - middle[np.linalg.norm(part[:, None] - middle[None], axis=2).argmin(axis=1)]
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    hump = np.sin(np.linspace(0, np.pi, len(part)))[:, None]
    line = part + aside_px * hump * outward
    return line[:: max(1, len(line) // 25)]


def test_a_drawn_wall_replaces_the_traced_wall_and_can_be_undone(bench, shot):
    bench.give_ends(shot)
    before = bench.number("area")
    bench.page.keyboard.press("w")
    draw(bench, bulge(bench, 12.0))
    bench.await_state("walls")
    bench.until("window.probe.number('area') > given[0]", before)
    assert bench.page.locator("#lines .drawn").count() == 1
    assert "drawn by hand" in bench.text("#warnings")
    wider = bench.number("area")
    bench.page.keyboard.press("Control+z")
    bench.until("window.probe.number('area') === given[0]", before)
    bench.page.keyboard.press("Control+Shift+z")
    bench.until("window.probe.number('area') === given[0]", wider)
    bench.page.click("#drawn button")
    bench.until("window.probe.number('area') === given[0]", before)
    assert bench.page.locator("#lines .drawn").count() == 0


def test_a_run_of_the_saved_trial_has_the_drawn_wall(open_page, shot, tmp_path):
    """The wall is erased by a click and drawn again. Then the trial is run."""
    photo = tmp_path / "crack.jpg"
    photo.write_bytes(shot.file.read_bytes())
    bench = open_page(photo)
    bench.give_ends(shot)
    before = bench.number("area")
    bench.page.keyboard.press("w")
    draw(bench, bulge(bench, 7.0))
    bench.await_state("walls")
    bench.until("window.probe.number('area') > given[0]", before)
    wider = bench.number("area")
    bench.click(np.array(bench.probe("line", "drawn-0"))[0])
    bench.until("window.probe.number('area') === given[0]", before)
    bench.page.keyboard.press("Control+z")
    bench.until("window.probe.number('area') === given[0]", wider)
    bench.give_scale_and_depth()
    bench.page.locator(":focus").blur()
    bench.until("document.querySelector('#area').innerText.includes('mm')")
    bench.await_state("walls")
    shown_mm2 = bench.number("area")
    bench.page.keyboard.press("Control+s")
    bench.page.wait_for_selector("#farewell[open]")
    trial = load_trial(photo.with_suffix(".toml"))
    assert trial.photo is not None
    assert len(trial.photo.walls_px or ()) == 1
    with open_folder(tmp_path / "run", create=True) as folder:
        run_stages(start_job(trial, tmp_path, folder, "cpu", Progress()), ("digitise",))
    assert abs(signed_area(read_outline(folder.path).outline_mm)) == pytest.approx(shown_mm2, abs=0.51)
