"""What the trace page is told: the pipeline's own numbers, in their order, for the newest question only."""

import json
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.settings import PhotoInput
from digitise.trace_page import session as page_session
from digitise.trace_page.session import Hints, OutdatedError, TraceSession
from sealtwin.core.errors import InputError
from tests.support.photos import edge_of_patch, evenly_scaled, mortar, wandering, with_crack, write_png

ENDS = ((50.0, 201.0), (450.0, 101.0))


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    picture = with_crack(mortar(), [(50, 200), (180, 150), (300, 160), (450, 100)])
    return write_png(tmp_path_factory.mktemp("photo") / "crack.png", picture)


@pytest.fixture
def session(file):
    return _session(file)


def _session(file, hints=None, **settings):
    settings = {"mm_per_px": 1.0, **settings}
    return TraceSession(PhotoInput(file=Path(file.name), data="synthetic", **settings), file.parent, hints or Hints())


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


def test_the_page_shows_what_the_pipeline_finds(in_mm, file):
    """To a hundredth of a pixel, to which points are rounded; numbers exactly."""
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


def test_without_a_scale_lengths_are_pixels_and_no_sentence_speaks_of_millimetres(in_px, in_mm):
    """A millimetre is a pixel then, and a reader would take it for one of the sample's."""
    assert in_px["scale"]["mm_per_px"] is None
    assert in_px["walls"]["unit"] == "px"
    for name, power in (("length", 1), ("mean_width", 1), ("area", 2)):
        assert in_px["walls"][name] == pytest.approx(in_mm["walls"][name] * 10**power, rel=1e-3)
    assert " mm" not in json.dumps(in_px)


def test_a_scale_that_cannot_be_is_said_and_the_crack_still_shown(session):
    answers = _asked(session, Hints(ends_px=ENDS, ruler_px=((10.0, 10.0), (10.5, 10.0)), ruler_mm=4.0))
    assert "ruler_px" in answers["scale"]["refused"]  # the name that the tool shows, too
    assert answers["scale"]["mm_per_px"] is None
    assert answers["walls"]["unit"] == "px"


def test_via_points_and_region_are_followed(session):
    answers = _asked(session, Hints(ends_px=ENDS, via_px=((300.0, 161.0),)), "path")
    assert answers["path"]["source"] == "via"
    away = _asked(session, Hints(ends_px=ENDS, roi_px=((0.0, 0.0), (499.0, 60.0))))
    assert away["refused"].startswith("crack.png: ")  # no folder of the user's
    assert "roi_px" in away["refused"]


def test_without_ends_the_crack_is_proposed(tmp_path):
    """The page asks itself whether a proposal is the crack; it has no overlay, of which a run would tell."""
    picture = with_crack(mortar(), wandering([(50, 200), (180, 150), (300, 160), (450, 100)]))
    answers = _asked(_session(write_png(tmp_path / "crack.png", picture)), Hints(mm_per_px=0.1))
    assert answers["path"]["source"] == "automatic"
    assert not answers["walls"]["warnings"]
    ends = np.array([answers["path"]["points_px"][0], answers["path"]["points_px"][-1]])
    # Round ends, which no line of that width reaches: within one width of 14 px, as a click may be.
    assert np.linalg.norm(ends - np.array(ENDS), axis=1).max() < 14


def test_one_line_that_is_not_sure_is_offered_and_asked_about(tmp_path):
    offered = _asked(_session(write_png(tmp_path / "edge.png", edge_of_patch())), Hints(), revision=1.0)
    assert list(offered) == ["scale", "cracks", "refused"]
    assert len(offered["cracks"]) == 1
    assert "not sure" in offered["refused"]


def test_it_starts_with_the_trials_hints(file):
    hints = Hints(ends_px=ENDS, mm_per_px=0.1)
    opening = _session(file, hints).opening()
    assert opening["name"] == "crack.png"
    assert tuple(opening["size_px"]) == (500, 300)
    assert opening["hints"] == {"ends_px": [list(end) for end in ENDS], "mm_per_px": 0.1, "frame": (16, "", 8, None)}
    assert (opening["markers"], opening["painted"], opening["seen"]) == (False, False, 0)


def test_an_older_question_is_dropped(session):
    assert list(_asked(session, Hints(ends_px=ENDS), "scale", revision=7.0)) == ["scale"]
    with pytest.raises(OutdatedError):
        next(session.trace(Hints(ends_px=ENDS), 6.9, "scale"))


def test_in_the_end_nothing_goes_on(session):
    question = session.trace(Hints(ends_px=ENDS), 1.0, "walls")
    next(question)
    next(question)
    session.end()
    with pytest.raises(OutdatedError):
        next(question)


def test_a_search_of_the_whole_photo_holds_no_click_up(session, monkeypatch):
    """It may take seconds, and the user may well know better before it ends."""
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


def test_of_several_searches_only_the_newest_is_made(session, monkeypatch):
    """Each field that is filled in asks for another; all at once they would slow down the one that counts."""
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


def test_a_stroke_gives_what_a_new_session_gives(file):
    session, plain = _session(file), Hints(ends_px=ENDS)
    stroked = plain.model_copy(update={"crack_strokes_px": (((170.0, 154.0), (190.0, 152.0)),)})
    _asked(session, plain)
    answer = _asked(session, stroked)
    assert answer == _asked(_session(file), stroked)
    assert any("strokes drawn by hand" in warning for warning in answer["walls"]["warnings"])
    assert any(text.startswith("left wall by drawn") for *_, text in answer["walls"]["why"])
