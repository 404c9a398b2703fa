"""The pictures beside a run's files are the same for the same run."""

import re

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from PIL import Image

from validate.figures.snapshots import write_gallery


def test_a_gallery_is_the_same_when_it_is_made_again(scene, frames, health, tmp_path, monkeypatch):
    """But for the last bits of where the layout puts a panel; no file says when it was made, or by what."""
    monkeypatch.setattr("validate.figures.snapshots.DPI", 40)
    for run in ("a", "b"):
        names = write_gallery(tmp_path / run, {"0007.000s": frames[1]}, scene, health)
        assert names == ["health.png", "snapshots/0007.000s.png", "snapshots/fill.png"]
    for stem in ("health", "snapshots/0007.000s", "snapshots/fill"):
        first, again = (pixels(tmp_path / run / f"{stem}.png") for run in ("a", "b"))
        assert np.abs(first - again).mean() < 0.1
        assert not re.search(rb"Software|matplotlib\.org", (tmp_path / "a" / f"{stem}.png").read_bytes())


def pixels(path):
    with Image.open(path) as opened:
        return np.asarray(opened.convert("RGB"), dtype=int)


def test_snapshots_of_one_run_have_their_panels_at_the_same_places_and_one_layout(scene, frames, tmp_path, monkeypatch):
    drawn, laid_out = dict[str, Figure](), list[str]()

    def written(_, name, figure):
        drawn[name] = figure
        if isinstance(engine := figure.get_layout_engine(), ConstrainedLayoutEngine):
            laid_out.append(name)
            engine.execute(figure)
        return [name]

    monkeypatch.setattr("validate.figures.snapshots._write", written)
    monkeypatch.setattr("validate.figures.snapshots.draw_health", lambda _: Figure())
    named = {f"{frame.t_s:08.3f}s": frame for frame in frames}
    last, *others = (f"snapshots/{name}" for name in reversed(named))
    assert write_gallery(tmp_path, named, scene, {}) == ["health", last, *others, "snapshots/fill"]
    assert laid_out == [last, "snapshots/fill"]
    for name in others:
        assert all(map(alike, drawn[name].axes, drawn[last].axes))


def alike(one, other):
    return np.array_equal(one.get_position(original=True).bounds, other.get_position(original=True).bounds)
