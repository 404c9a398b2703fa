"""The pictures beside a run's files are the same for the same run."""

import re

import numpy as np
from PIL import Image

from sealtwin.core.drawing.snapshots import write_gallery


def test_a_gallery_is_the_same_when_it_is_made_again(scene, frames, health, tmp_path, monkeypatch):
    """But for the last bits of where the layout puts a panel; no file says when it was made, or by what."""
    monkeypatch.setattr("sealtwin.core.drawing.snapshots.DPI", 40)
    for run in ("a", "b"):
        names = write_gallery(tmp_path / run, {"0007.000s": frames[1]}, scene, health)
        assert names == [
            "health.png", "health.svg", "snapshots/0007.000s.png", "snapshots/0007.000s.svg", "snapshots/fill.png",
            "snapshots/fill.svg",
        ]  # fmt: skip
    for stem in ("health", "snapshots/0007.000s", "snapshots/fill"):
        first, again = (pixels(tmp_path / run / f"{stem}.png") for run in ("a", "b"))
        assert np.abs(first - again).mean() < 0.1
        for kind in ("png", "svg"):
            assert not re.search(rb"dc:date|Software|matplotlib\.org", (tmp_path / "a" / f"{stem}.{kind}").read_bytes())


def pixels(path):
    with Image.open(path) as opened:
        return np.asarray(opened.convert("RGB"), dtype=int)
