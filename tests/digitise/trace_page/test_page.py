"""The trace page's own names: files, tiles, questions, and how it ends."""

import json
import re
from importlib.resources import files

import numpy as np
import pytest

from digitise.settings import MOST_VIA
from digitise.trace_page.page import MEDIA_TYPES, Opened, Sheet, TracePage
from digitise.trace_page.session import Pyramid
from sealtwin.core.errors import InputError

ASSETS = files("digitise.trace_page") / "assets"


class Session:
    """Answers at once, and remembers what it was asked."""

    def __init__(self):
        self.pyramid = Pyramid(np.full((600, 700, 3), 120, np.uint8))
        self.asked = []

    def opening(self):
        return {"name": "crack.jpg"}

    def end(self):
        pass

    def trace(self, hints, revision, until):
        self.asked.append((hints, revision, until))
        yield {"scale": {}}


@pytest.fixture
def saved():
    return []


@pytest.fixture
def page(saved):
    def save(hints, shape):
        depth_mm = shape.depth_mm
        if depth_mm is not None and depth_mm < 0:
            raise InputError("crack.toml: depth_mm: too shallow.")
        if depth_mm == 999:
            raise PermissionError(13, "Permission denied", "lab/crack.toml")
        saved.append((hints, depth_mm))
        return {"file": "crack.toml"}

    opened = Opened(Session(), save, {"is_new": True})  # pyright: ignore[reportArgumentType]
    with TracePage([Sheet("crack.jpg", lambda: opened, lambda: False)]) as page:
        yield page


def _posted(page, name, content):
    return list(page.post(name, json.dumps(content).encode()))


def test_the_page_and_all_that_it_names_are_there(page):
    """Also what modules import: one that is missing leaves a blank page."""
    whole = page.get("")
    assert whole[1].startswith("text/html")
    named = set(re.findall(r'(?:href|src)="([^"#]+)"', whole[0].decode()))
    for entry in ASSETS.iterdir():
        if entry.name.endswith(".js"):
            named |= set(re.findall(r'from "\./([^"]+)"', entry.read_text(encoding="utf-8")))
    assert {"main.js", "page.css", "draft.js"} <= named
    for name in named:
        assert page.get(name) is not None, name
    assert {entry.name for entry in ASSETS.iterdir()} - named == {"page.html"}


def test_nothing_is_fetched_from_elsewhere_or_run_inline():
    """The content security policy forbids both; here it is seen before a browser is."""
    for entry in ASSETS.iterdir():
        text = entry.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|@import|url\(", text), entry.name
        assert entry.name[entry.name.rfind(".") :] in MEDIA_TYPES
    page = (ASSETS / "page.html").read_text(encoding="utf-8")
    assert not re.search(r"\son\w+=|\sstyle=|<style|<script(?![^>]*\ssrc=)", page)


def test_the_page_knows_how_many_via_points_there_may_be():
    """A click more would be refused as nothing that this page sends."""
    assert f"const MOST_VIA = {MOST_VIA};" in (ASSETS / "tools.js").read_text(encoding="utf-8")


def test_no_other_file_and_no_tile_outside_the_photo_is_served(page):
    files = ("../page.py", "..%2fpage.py", "assets/main.js", "/etc/passwd", "main.js/", "x")
    tiles = ("0/2/0.jpg", "9/0/0.jpg", "0/0/0.png", "0/-1/0.jpg", "0/0/0.jpg/x")
    for name in (*files, *(f"photo/{tile}" for tile in tiles)):
        assert page.get(name) is None, name
    assert page.get("photo/0/1/1.jpg")[1] == "image/jpeg"


def test_a_question_is_handed_on(page):
    answers = _posted(page, "trace", {"hints": {"mm_per_px": 0.1}, "revision": 3, "until": "path"})
    assert answers == [{"scale": {}}]
    hints, revision, until = page._opened.session.asked[0]
    assert (hints.mm_per_px, revision, until) == (0.1, 3, "path")


def test_what_the_page_never_sends_is_refused(page, saved):
    for name, body in (
        ("trace", b""),
        ("trace", b"\xff\xfe"),
        ("trace", b"[]"),
        ("trace", b'{"hints": {}, "revision": 1}'),
        ("trace", b'{"hints": {}, "revision": -1, "until": "path"}'),
        ("trace", b'{"hints": {}, "revision": 1, "until": "all"}'),
        ("trace", b'{"hints": {}, "revision": 1, "until": "path", "file": "x"}'),
        ("trace", b'{"hints": {"file": "x"}, "revision": 1, "until": "path"}'),
        ("save", b'{"hints": {}, "shape": {"depth_mm": "16"}}'),
        ("save", b'{"hints": {}, "shape": {"depth_mm": Infinity}}'),
        ("save", b'{"hints": {}, "out": "/tmp"}'),
        ("save", b"[" * 60_000),
    ):
        with pytest.raises(ValueError, match="not a request of this page"):
            page.post(name, body)
    assert not saved
    assert page.post("session", b"{}") is None


def test_saving_hands_the_hints_over_and_ends_it(page, saved):
    answers = _posted(page, "save", {"hints": {"mm_per_px": 0.1}, "shape": {"depth_mm": 16}})
    assert answers == [{"saved": {"file": "crack.toml"}, "photos": []}]
    page.wait()
    assert page.saved == [{"file": "crack.toml"}]
    assert [(hints.said(), depth_mm) for hints, depth_mm in saved] == [({"mm_per_px": 0.1}, 16.0)]


def test_a_save_that_fails_says_why_and_costs_no_click(page, saved):
    for depth_mm, why in ((-1, "crack.toml: depth_mm: too shallow."), (999, "lab/crack.toml: Permission denied")):
        (answer,) = _posted(page, "save", {"hints": {}, "shape": {"depth_mm": depth_mm}})
        assert answer["refused"].startswith(why)
        assert not page._ended.is_set()
        assert not saved
    _posted(page, "save", {"hints": {}, "shape": {"depth_mm": 16}})
    assert len(saved) == 1


def _opening(page):
    return json.loads(page.get("session")[0])


def _sheet(name, done, bad=()):
    def opened():
        if name in bad:
            raise InputError(f"{name}: not a readable photo")
        return Opened(Session(), lambda *_: done.append(name) or {"file": name}, {"here": name})  # pyright: ignore

    return Sheet(name, opened, lambda: name in done)


def test_a_folder_is_gone_through_and_what_is_done_is_marked():
    """It begins with the first that is open and can be read, and ends when the user leaves."""
    done = ["a.jpg"]
    with TracePage([_sheet(name, done, bad=("b.jpg",)) for name in ("a.jpg", "b.jpg", "c.jpg", "d.jpg")]) as page:
        opening = _opening(page)
        assert opening["here"] == "c.jpg"
        assert [one["name"] for one in opening["photos"] if one["here"]] == ["c.jpg"]
        assert [one["name"] for one in opening["photos"] if not one["done"]] == ["b.jpg", "c.jpg", "d.jpg"]
        (answer,) = _posted(page, "save", {"hints": {}})
        assert [one["done"] for one in answer["photos"]] == [True, False, True, False]
        assert not page._ended.is_set()
        assert "not a readable photo" in _posted(page, "turn", {"photo": 1})[0]["refused"]
        assert _opening(page)["here"] == "c.jpg", "it stays where it is"
        assert _posted(page, "turn", {"photo": 3}) == [{"turned": True}]
        assert _opening(page)["here"] == "d.jpg"
        assert "refused" in _posted(page, "turn", {"photo": 4})[0]
        _posted(page, "quit", {})
        page.wait()
        assert page.saved == [{"file": "c.jpg"}]


def test_a_folder_of_bad_photos_is_refused():
    with pytest.raises(InputError, match=r"b\.jpg"):
        TracePage([_sheet(name, [], bad=("a.jpg", "b.jpg")) for name in ("a.jpg", "b.jpg")])
