"""'sealtwin trace' with a scripted browser in place of the user's."""

import http.client
import json
import re
import shutil
import socket
import webbrowser
from contextlib import closing
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import pytest

from sealtwin.core.errors import present
from sealtwin.trial.starter_files import SEALANT
from sealtwin.trial.trial_file import load_trial
from tests.support.paths import FIXTURE
from tests.support.processes import refusal, sealtwin

ENDS = [[719.3, 658.4], [1402.7, 258.9]]


@pytest.fixture
def trial(tmp_path):
    """A copy of the fixture that a test may change."""
    shutil.copytree(FIXTURE, tmp_path / "lab")
    return tmp_path / "lab" / "trial.toml"


@pytest.fixture
def browser(monkeypatch):
    """Browser that opens in place of the user's, sends its ``posts`` and keeps the answers."""

    class Browser:
        posts: tuple = ()
        answers: tuple = ()
        door = Path()

        def open(self, url):
            self.door = Path(url2pathname(urlsplit(url).path))
            assert self.door.stat().st_mode & 0o077 == 0
            (page,) = re.findall('url=(http://[^"]+)', self.door.read_text())
            assert page.rstrip("/").rpartition("/")[2] not in url, "the token, for all to see in the list of processes"
            self.answers = tuple(_posted(page, *post) for post in self.posts)
            return True

    browser = Browser()
    monkeypatch.setattr(webbrowser, "open", browser.open)
    return browser


def _posted(url, name, content):
    parts = urlsplit(url)
    assert parts.hostname == "127.0.0.1"
    headers = {"Origin": f"http://{parts.netloc}", "Content-Type": "application/json"}
    with closing(http.client.HTTPConnection(parts.netloc, timeout=30)) as connection:
        connection.request("POST", parts.path + name, json.dumps(content), headers)
        return [json.loads(line) for line in connection.getresponse()]


def test_points_clicked_on_the_trace_page_are_saved_in_the_trial(trial, browser):
    hints = {"ends_px": ENDS[::-1], "via_px": [[1000.0, 498.0]], "face_mm": [160, 40]}
    browser.posts = (("trace", {"hints": hints, "revision": 1, "until": "walls"}), ("save", {"hints": hints}))
    answer = sealtwin("trace", trial)
    assert answer.exit_code == 0, answer.output
    traced, saved = browser.answers
    assert [next(iter(line)) for line in traced] == ["scale", "path", "walls"]
    # The fixture's truth, within the tracing benchmark's 0.5 %.
    assert traced[2]["walls"]["length"] == pytest.approx(80, rel=0.01)
    # The page shows the two lines of the command's answer.
    summary, following = answer.stdout.splitlines()
    shown = {"summary": summary, "next": following.removeprefix("Next: ")}
    assert saved == [{"saved": {"file": str(trial), "changed": ["ends_px", "via_px"], **shown}}]
    assert shown["next"] == f"sealtwin run {trial}"
    photo = present(load_trial(trial).photo, "photo")
    assert photo.ends_px == tuple(tuple(end) for end in hints["ends_px"])
    assert photo.markers == load_trial(FIXTURE / "trial.toml").photo.markers
    assert answer.stderr.startswith("Trace page: http://127.0.0.1:")


def test_tracing_a_photo_writes_a_trial_beside_the_photo(trial, browser):
    photo = trial.parent / "photo.jpg"
    hints = {"ends_px": ENDS, "face_mm": [160, 40], "frame": [16, "4x4_50", 8, None]}
    browser.posts = (("save", {"hints": hints}), ("save", {"hints": hints, "shape": {"depth_mm": 16}}))
    answer = sealtwin("trace", photo, "--json", "--quiet")
    assert "crack.depth_mm is missing" in browser.answers[0][0]["refused"]
    written = photo.with_suffix(".toml")
    saved = json.loads(answer.stdout)
    assert (saved["version"], saved["saved"]) == (1, str(written))
    assert saved["changed"][:4] == ["ends_px", "face_mm", "markers", "depth_mm"]
    new = load_trial(written)
    assert present(new.photo, "photo").markers == present(load_trial(trial).photo, "photo").markers
    assert present(new.photo, "photo").file.name == "photo.jpg"
    assert new.fluid is not None, "the starter's, so that the next command can run"
    assert {*SEALANT, "crack.tilt"} <= {*new.assumptions}
    assert "sealtwin run" in browser.answers[1][0]["saved"]["next"]


def test_an_unusable_target_of_trace_is_refused_before_the_page_opens(trial, browser, tmp_path):
    photo, mesh = trial.with_name("photo.jpg"), tmp_path / "mesh.toml"
    mesh.write_text('name = "m"\n[mesh]\nfile = "m.stl"\ndata = "measured"\nunits = "mm"\n')
    trial.with_name("photo.toml").touch()
    for path, named in (
        (tmp_path, f"{tmp_path}: file not found, or not a regular file"),
        (tmp_path / "none.jpg", "not found"),
        (tmp_path / "none.toml", "no such file"),
        (photo, "already exists"),
        (mesh, "no photo to trace"),
    ):
        assert named in refusal("trace", path)
    photo.write_bytes(b"no photo")
    assert "not a readable photo" in refusal("trace", trial)


def test_the_error_for_a_port_in_use_names_the_port(trial):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert f"--port {port}: Address already in use" in refusal("trace", trial, "--port", port)
