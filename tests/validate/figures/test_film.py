"""A film shows every frame, in its colours and for its time."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageSequence

from sealtwin.core.errors import InputError
from validate.figures.snapshots import FILM_DPI, Snapshot, write_film
from validate.figures.theme import as_picture


def film(path, scene, frames):
    numbers = []
    write_film(path, [frame.t_s for frame in frames], lambda number: frames[number], scene, numbers.append)
    assert numbers == list(range(1, len(frames) + 1))


def test_a_gif_shows_each_frame_for_as_long_as_it_lasts(scene, frames, tmp_path, monkeypatch):
    """In the run's own time, where players can show that: 6.5 s between two frames are shown as one."""
    monkeypatch.setattr("validate.figures.snapshots.FILM_IN", (4.0, 5.0))
    timed = [replace(frame, t_s=t_s) for frame, t_s in zip(frames, (0.5, 0.6, 7.1), strict=True)]
    film(tmp_path / "fill.gif", scene, timed)
    with Image.open(tmp_path / "fill.gif") as opened:
        shown = [
            (picture.info["duration"], np.asarray(picture.convert("RGB"), dtype=int))
            for picture in ImageSequence.Iterator(opened)
        ]
    assert [duration for duration, _ in shown] == [100, 1000, 1500]
    painted = np.asarray(as_picture(Snapshot(scene, film=True).draw(timed[1]), FILM_DPI), dtype=int)
    # 128 colours for all: neighbours on the scales become one.
    assert np.abs(shown[1][1] - painted).mean() < 2.0
    assert np.abs(shown[1][1] - shown[0][1]).mean() > 4.0


def test_a_film_that_cannot_be_made_is_one_sentence_and_no_file(scene, frames, tmp_path):
    for name, shown, words in (("fill.mp4", frames, r"\.gif"), ("fill.gif", frames[:1], "needs two frames")):
        with pytest.raises(InputError, match=words):
            write_film(tmp_path / name, [f.t_s for f in shown], lambda number: frames[number], scene, lambda _: None)
    assert not list(tmp_path.iterdir())
