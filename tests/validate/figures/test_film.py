"""A film shows every frame, in its colours and for its time."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image, ImageSequence

from sealtwin.core.errors import InputError
from validate.figures.film import Painter, write_film


def film(path, scene, frames):
    numbers = []
    write_film(path, [frame.t_s for frame in frames], lambda number: frames[number], scene, numbers.append)
    assert numbers == list(range(1, len(frames) + 1))


@pytest.mark.broad
def test_a_gif_shows_each_frame_for_as_long_as_it_lasts(scene, frames, tmp_path):
    """In the run's own time, where players can show that: 6.5 s between two frames are shown as one."""
    timed = [replace(frame, t_s=t_s) for frame, t_s in zip(frames, (0.5, 0.6, 7.1), strict=True)]
    film(tmp_path / "fill.gif", scene, timed)
    with Image.open(tmp_path / "fill.gif") as opened:
        shown = [
            (picture.info["duration"], np.asarray(picture.convert("RGB"), dtype=int))
            for picture in ImageSequence.Iterator(opened)
        ]
    assert [duration for duration, _ in shown] == [100, 1000, 1500]
    painted = Painter(scene).paint(timed[1]).astype(int)
    # 128 colours for all: neighbours on the scales become one.
    assert np.abs(shown[1][1] - painted).mean() < 2.0
    assert np.abs(shown[1][1] - shown[0][1]).mean() > 4.0


def test_an_mp4_can_be_read_back(scene, frames, tmp_path):
    timed = [replace(frame, t_s=k / 10) for k, frame in enumerate(frames[::2])]
    film(tmp_path / "fill.mp4", scene, timed)
    read = cv2.VideoCapture(str(tmp_path / "fill.mp4"))
    assert read.get(cv2.CAP_PROP_FRAME_COUNT) == 2
    assert read.get(cv2.CAP_PROP_FPS) == pytest.approx(10, rel=1e-3)
    painter = Painter(scene)
    for frame in timed:
        was_read, picture = read.read()
        assert was_read
        painted = painter.paint(frame).astype(int)
        coloured = np.ptp(painted, axis=2) > 60
        # Of 255, where something is coloured: red for blue would be 80 off.
        assert np.abs(picture[:, :, ::-1].astype(int) - painted)[coloured].mean() < 30.0


def test_a_film_that_cannot_be_made_is_one_sentence_and_no_file(scene, frames, tmp_path, monkeypatch):
    for name, shown, words in (("fill.avi", frames, r"\.gif or \.mp4"), ("fill.gif", frames[:1], "needs two frames")):
        with pytest.raises(InputError, match=words):
            write_film(tmp_path / name, [f.t_s for f in shown], lambda number: frames[number], scene, lambda _: None)
    monkeypatch.setattr(cv2.VideoWriter, "isOpened", lambda _: False, raising=False)
    with pytest.raises(InputError, match=r"no encoder for MP4.* \.gif"):
        film(tmp_path / "fill.mp4", scene, frames)
    assert not list(tmp_path.iterdir())
