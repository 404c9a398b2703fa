"""Responses of the trace page: the pipeline's results in order, hints of a trial, and tiles of a photo."""

import io
import json
import re
import threading
import time
from contextlib import suppress
from itertools import count, takewhile
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from pydantic import ValidationError

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.settings import Marker, MarkerBoard, PhotoInput
from digitise.trace_page import session as page_session
from digitise.trace_page.session import (
    TILE_PX,
    Hints,
    OutdatedError,
    Pyramid,
    TraceSession,
    rest_of,
    scale_settings,
)
from sealtwin.core.errors import InputError
from tests.support.photos import edge_of_patch, evenly_scaled, mortar, with_crack, write_png

ENDS = ((50.0, 201.0), (450.0, 101.0))


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    picture = with_crack(mortar(), [(50, 200), (180, 150), (300, 160), (450, 100)])
    return write_png(tmp_path_factory.mktemp("photo") / "crack.png", picture)


@pytest.fixture
def session(file):
    return _session(file)


def _session(file, hints=None):
    settings = PhotoInput(file=Path(file.name), data="synthetic", mm_per_px=1.0)
    return TraceSession(settings, file.parent, hints or Hints())


def _asked(session, hints, until="walls", revision=None):
    """All answers in one dictionary, in their order."""
    answers = {}
    for answer in session.trace(hints, time.monotonic() if revision is None else revision, until):
        json.dumps(answer, allow_nan=False)
        answers |= answer
    return answers


@pytest.fixture(scope="module")
def in_px(file):
    return _asked(_session(file), Hints(ends_px=ENDS))


@pytest.fixture(scope="module")
def in_mm(file):
    return _asked(_session(file), Hints(ends_px=ENDS, mm_per_px=0.1))


def test_the_trace_page_shows_the_same_path_and_walls_as_the_pipeline(in_mm, file):
    """Tolerance: a hundredth of a pixel, to which points are rounded; figures are exact."""
    photo = evenly_scaled(file)
    path = find_path(photo, ENDS)
    outline = trace_outline(photo, path)
    assert list(in_mm) == ["scale", "path", "walls"]
    assert in_mm["scale"]["mm_per_px"] == 0.1
    assert np.allclose(in_mm["path"]["points_px"], path.points_px, atol=0.0051)
    walls = in_mm["walls"]
    assert (walls["unit"], walls["length"], walls["mean_width"]) == ("mm", outline.length_mm, outline.mean_width_mm)
    assert np.allclose(walls["left_px"], outline.left_wall_px, atol=0.0051)
    assert np.allclose(walls["outline_px"], outline.outline_px, atol=0.0051)
    # A crack's area is its length times its mean width, less its tips.
    assert 0.95 < walls["area"] / (outline.length_mm * outline.mean_width_mm) < 1.02


def test_the_page_shows_all_lengths_in_pixels_if_the_scale_is_unknown(in_px, in_mm):
    """The internal millimetre is then a pixel, which a user would take for a real millimetre."""
    assert in_px["scale"]["mm_per_px"] is None
    assert in_px["walls"]["unit"] == "px"
    for name, power in (("length", 1), ("mean_width", 1), ("area", 2)):
        assert in_px["walls"][name] == pytest.approx(in_mm["walls"][name] * 10**power, rel=1e-3)
    assert " mm" not in json.dumps(in_px)


def test_an_invalid_scale_is_refused_but_the_crack_is_still_shown(session):
    answers = _asked(session, Hints(ends_px=ENDS, ruler_px=((10.0, 10.0), (10.5, 10.0)), ruler_mm=4.0))
    assert "ruler_px" in answers["scale"]["refused"]  # the name that the tool shows, too
    assert answers["scale"]["mm_per_px"] is None
    assert answers["walls"]["unit"] == "px"


def test_the_trace_page_uses_via_points_and_the_region_of_interest(session):
    """A refusal gives the name of the photo without its folder."""
    answers = _asked(session, Hints(ends_px=ENDS, via_px=((300.0, 161.0),)), "path")
    assert answers["path"]["source"] == "via"
    away = _asked(session, Hints(ends_px=ENDS, roi_px=((0.0, 0.0), (499.0, 60.0))))
    assert re.match("crack.png: .*roi_px", away["refused"])


def test_a_single_line_is_offered_for_confirmation(tmp_path):
    offered = _asked(_session(write_png(tmp_path / "edge.png", edge_of_patch())), Hints(), revision=1.0)
    assert list(offered) == ["scale", "cracks", "refused"]
    assert len(offered["cracks"]) == 1
    assert "This line may be the crack" in offered["refused"]


CRACK = [(120, 40), (220, 70), (300, 50), (440, 80)]
JOINTS = [(60, -10), (60, 310)], [(-10, 200), (510, 200)]
APART = [(40, 250), (90, 262)], [(420, 262), (470, 250)]


@pytest.mark.parametrize(
    ("lines", "ends_px", "last"),
    [
        (JOINTS, ((60, 40), (430, 200)), "walls"),
        (APART, ((45, 251), (465, 251)), "refused"),
        ((), (CRACK[0], CRACK[-1]), "walls"),
    ],
    ids=["along joints", "over bare ground", "along the crack"],
)
def test_lines_are_offered_by_number_unless_the_path_is_without_a_doubt(tmp_path, lines, ends_px, last):
    picture = with_crack(mortar(), CRACK, 5)
    for line in lines:
        picture = with_crack(picture, line, 4)
    answers = _asked(_session(write_png(tmp_path / "tiles.png", picture)), Hints(ends_px=ends_px))
    assert [*answers][-1] == last
    assert "no crack between the ends" in answers.get("refused", "no crack between the ends")
    offered = [line["ends_px"] for line in answers.get("cracks", ())]
    assert offered == ([pytest.approx(np.array([CRACK[0], CRACK[-1]]), abs=4)] if lines else [])


def test_the_page_opens_with_the_hints_of_the_trial(file):
    hints = Hints(ends_px=ENDS, mm_per_px=0.1)
    opening = _session(file, hints).opening()
    assert (opening["name"], tuple(opening["size_px"])) == ("crack.png", (500, 300))
    assert opening["hints"] == {"ends_px": [list(end) for end in ENDS], "mm_per_px": 0.1, "frame": (16, "", 8, None)}
    assert (opening["markers"], opening["painted"], opening["seen"]) == (False, False, 0)


def test_a_request_older_than_the_latest_is_dropped(session):
    assert list(_asked(session, Hints(ends_px=ENDS), "scale", revision=7.0)) == ["scale"]
    with pytest.raises(OutdatedError):
        next(session.trace(Hints(ends_px=ENDS), 6.9, "scale"))


def test_a_request_stops_when_the_session_ends(session):
    question = session.trace(Hints(ends_px=ENDS), 1.0, "walls")
    next(question)
    next(question)
    session.end()
    with pytest.raises(OutdatedError):
        next(question)


def test_a_search_of_the_whole_photo_does_not_delay_a_click(session, monkeypatch):
    """The search may take seconds, in which the user may click the ends."""
    searching, may_end = threading.Event(), threading.Event()

    def endless(*_):
        searching.set()
        assert may_end.wait(10)
        raise InputError("nothing")

    monkeypatch.setattr(page_session.CrackSearch, "of", endless)
    search = threading.Thread(target=lambda: list(session.trace(Hints(), 1.0, "walls")))
    search.start()
    assert searching.wait(10)
    assert "walls" in _asked(session, Hints(ends_px=ENDS), revision=2.0)
    may_end.set()
    search.join(10)


def test_only_the_newest_of_several_waiting_searches_is_run(session, monkeypatch):
    """Each field that is filled in starts a search; all of them together would slow down the last."""
    made, go_on = [], threading.Event()

    def search(photo, *_):
        made.append(photo.mm_per_px)
        assert go_on.wait(10)
        raise InputError("nothing")

    monkeypatch.setattr(page_session.CrackSearch, "of", search)
    answered = []

    def ask(mm_per_px, revision):
        with suppress(OutdatedError):
            for answer in session.trace(Hints(mm_per_px=mm_per_px), revision, "walls"):
                answered.append((revision, *answer))

    asking = [threading.Thread(target=ask, args=(0.1 * revision, float(revision))) for revision in (1, 2, 3)]
    for revision, thread in enumerate(asking, start=1):
        thread.start()
        while (revision, "scale") not in answered or not made:
            time.sleep(0.001)
    go_on.set()
    for thread in asking:
        thread.join(10)
    assert made == pytest.approx([0.1, 0.3])
    assert answered == [(1, "scale"), (2, "scale"), (3, "scale"), (1, "refused"), (3, "refused")]


def test_a_wall_drawn_in_an_open_session_gives_the_result_of_a_new_session(file):
    session, plain = _session(file), Hints(ends_px=ENDS)
    drawn = plain.model_copy(update={"walls_px": (((170.0, 170.0), (190.0, 168.0)),)})
    _asked(session, plain)
    answer = _asked(session, drawn)
    assert answer == _asked(_session(file), drawn)
    assert any("lines drawn by hand" in warning for warning in answer["walls"]["warnings"])
    assert any("wall by drawn" in text for *_, text in answer["walls"]["why"])


def _clouds(width, height):
    """Soft spots of some pixels: a shift by half a pixel changes them by 3 of 255 on average."""
    noise = np.random.default_rng(1).standard_normal((height, width)).astype(np.float32)
    soft = cv2.GaussianBlur(noise, (0, 0), 5.0)
    grey = np.clip(128 + 40 * soft / soft.std(), 0, 255).round().astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def _assembled(pyramid, level) -> np.ndarray:
    rows = []
    while tiles := [*takewhile(bool, (pyramid.tile(level, column, len(rows)) for column in count()))]:
        rows.append(np.hstack([np.array(Image.open(io.BytesIO(tile))) for tile in tiles]))
    return np.vstack(rows)


@pytest.mark.parametrize("size", [(1024, 512), (1301, 703), (2049, 130)])
def test_the_tiles_of_every_zoom_level_are_block_means_of_the_photo(size):
    """Tolerance: 3 of 255, of which JPEG and rounding take 2.5.

    If an odd side is squeezed into half its length, the far end is off by 4 to 20.
    """
    photo = _clouds(*size)
    pyramid = Pyramid(photo)
    assert pyramid.levels == 1 + int(np.ceil(np.log2(max(size) / TILE_PX)))
    for level in range(1, pyramid.levels):
        block = 2**level
        width, height = (side // block * block for side in size)
        blocks = photo[:height, :width, 0].reshape(height // block, block, width // block, block)
        expected = blocks.astype(float).mean(axis=(1, 3))
        seen = _assembled(pyramid, level)[: height // block, : width // block, 0]
        assert np.abs(seen - expected)[:, -100:].mean() < 3


HINTED_ENDS = ((1.0, 2.0), (300.0, 4.5))
BOARD = MarkerBoard(size_mm=16.0, markers=tuple(Marker(id=n, x_mm=float(n), y_mm=0.0) for n in range(4)))


def _trial(**changed):
    return PhotoInput(**{"file": Path("photo.jpg"), "data": "synthetic", **changed})


def test_splitting_a_trial_into_hints_and_settings_loses_no_setting():
    """Defaults are not among the hints: a save would write them into a file that never had them."""
    trial = _trial(markers=BOARD, face_mm=(160.0, 40.0), ends_px=HINTED_ENDS, via_px=((5.0, 6.0),), edge_fraction=0.7)
    hints = Hints.of(trial)
    assert set(hints.entries()) == {"ends_px", "via_px", "face_mm"}
    together = scale_settings(rest_of(trial), hints)
    assert together is not None
    assert together.model_dump(exclude={"ends_px", "via_px"}) == trial.model_dump(exclude={"ends_px", "via_px"})


@pytest.mark.parametrize(
    ("hints", "named"),
    [
        (Hints(ruler_mm=30.0, mm_per_px=0.1), "ruler"),
        (Hints(ruler_px=HINTED_ENDS), "ruler_mm"),
        (Hints(mm_per_px=-1.0), "mm_per_px"),
        (Hints(face_mm=(160.0, 0.5)), "face_mm"),
        (Hints(face_corners_px=((0, 9), (9, 9), (9, 0), (0, 0))), "face_mm"),
    ],
)
def test_an_incomplete_double_or_invalid_scale_is_refused(hints, named):
    with pytest.raises(InputError, match=named):
        scale_settings(rest_of(_trial(mm_per_px=0.1)), hints)


@pytest.mark.parametrize(
    "body",
    [
        '{"file": "/etc/passwd"}',
        '{"ends_px": [[1, 2]]}',
        '{"ends_px": [["1", "2"], ["3", "4"]]}',
        '{"ends_px": [[1, NaN], [3, 4]]}',
        '{"via_px": %s}' % ([[1, 2]] * 51),
        '{"roi_px": %s}' % ([[1, 2]] * 201),
        '{"scale_is": "guessed"}',
        "[" * 5000,
        "null",
    ],
)
def test_hints_with_unknown_fields_or_invalid_values_are_refused(body):
    """The page must not name a file, and numbers must be finite and of the right count."""
    with pytest.raises(ValidationError):
        Hints.model_validate_json(body)
