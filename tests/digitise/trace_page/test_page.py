"""The trace page: its files, requests and end, the check of requests, and its server."""

import http.client
import json
import re
import socket
from contextlib import closing, suppress
from email.message import Message
from importlib.resources import files
from threading import Event, Thread
from time import sleep

import numpy as np
import pytest

from digitise.settings import MAX_VIA
from digitise.trace_page.page import (
    LARGEST_BODY_BYTES,
    MEDIA_TYPES,
    SECURITY_HEADERS,
    Opened,
    RequestGate,
    TracePage,
)
from digitise.trace_page.session import Pyramid
from sealtwin.core.errors import InputError

ASSETS = files("digitise.trace_page") / "assets"


class Session:
    """A session that answers at once and records its requests."""

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

    opened = Opened(Session(), save, {"is_new": True})
    with TracePage(opened) as page:
        yield page


def _posted(page, name, content):
    return list(page.post(name, json.dumps(content).encode()))


def test_all_files_that_the_page_links_to_are_served(page):
    """Imports of modules count too: a missing file leaves a blank page."""
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
    # The server refuses a request with more via points.
    assert f"const MAX_VIA = {MAX_VIA};" in (ASSETS / "tools.js").read_text(encoding="utf-8")


def test_the_page_has_no_external_resources_and_no_inline_scripts():
    """The content security policy forbids both; this test finds them without a browser."""
    for entry in ASSETS.iterdir():
        text = entry.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|@import|url\(", text), entry.name
        assert entry.name[entry.name.rfind(".") :] in MEDIA_TYPES
    page = (ASSETS / "page.html").read_text(encoding="utf-8")
    assert not re.search(r"\son\w+=|\sstyle=|<style|<script(?![^>]*\ssrc=)", page)


def test_only_page_files_and_tiles_inside_the_photo_are_served(page):
    files = ("../page.py", "..%2fpage.py", "assets/main.js", "/etc/passwd", "main.js/", "x")
    tiles = ("0/2/0.jpg", "9/0/0.jpg", "0/0/0.png", "0/-1/0.jpg", "0/0/0.jpg/x")
    for name in (*files, *(f"photo/{tile}" for tile in tiles)):
        assert page.get(name) is None, name
    assert page.get("photo/0/1/1.jpg")[1] == "image/jpeg"


def test_malformed_requests_are_refused_and_save_nothing(page, saved):
    for name, body in (
        ("trace", b"\xff\xfe"),
        ("trace", b'{"hints": {}, "revision": 1}'),
        ("trace", b'{"hints": {}, "revision": -1, "until": "path"}'),
        ("trace", b'{"hints": {}, "revision": 1, "until": "all"}'),
        ("trace", b'{"hints": {"file": "x"}, "revision": 1, "until": "path"}'),
        ("save", b'{"hints": {}, "shape": {"depth_mm": Infinity}}'),
        ("save", b'{"hints": {}, "out": "/tmp"}'),
        ("save", b"[" * 60_000),
    ):
        with pytest.raises(ValueError, match="not a request of this page"):
            page.post(name, body)
    assert not saved
    assert page.post("session", b"{}") is None


def test_saving_stores_the_hints_and_closes_the_page(page, saved):
    answers = _posted(page, "save", {"hints": {"mm_per_px": 0.1}, "shape": {"depth_mm": 16}})
    assert answers == [{"saved": {"file": "crack.toml"}}]
    page.wait()
    assert page.saved == {"file": "crack.toml"}
    assert [(hints.entries(), depth_mm) for hints, depth_mm in saved] == [({"mm_per_px": 0.1}, 16.0)]


def test_a_failed_save_gives_its_reason_and_can_be_repeated(page, saved):
    for depth_mm, why in ((-1, "crack.toml: depth_mm: too shallow."), (999, "lab/crack.toml: Permission denied")):
        (answer,) = _posted(page, "save", {"hints": {}, "shape": {"depth_mm": depth_mm}})
        assert answer["refused"].startswith(why)
        assert (page._ended.is_set(), saved) == (False, [])
    _posted(page, "save", {"hints": {}, "shape": {"depth_mm": 16}})
    assert len(saved) == 1


def test_quitting_ends_the_page_without_saving(page, saved):
    assert _posted(page, "quit", {}) == [{"left": True}]
    page.wait()
    assert (page.saved, saved) == (None, [])


PORT = 8123
OWN = f"127.0.0.1:{PORT}"


@pytest.fixture
def gate():
    return RequestGate(PORT)


def _own_post(**changed):
    """The headers of the page's own POST, some of them changed or (None) left out."""
    headers = Message()
    for name, value in ({"Host": OWN, "Origin": f"http://{OWN}", "Content_Length": "2"} | changed).items():
        if value is not None:
            headers[name.replace("_", "-")] = value
    return headers


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ({}, None),
        ({"Host": f"localhost:{PORT}", "Origin": f"http://localhost:{PORT}"}, None),
        ({"Content_Length": str(LARGEST_BODY_BYTES)}, None),
        # DNS rebinding: a site whose name resolves to 127.0.0.1 still sends its own name.
        *(({"Host": host}, 421) for host in (None, f"evil.example:{PORT}", "127.0.0.1", f"127.0.0.1:{PORT + 1}")),
        # Another site's page cannot post.
        *(({"Origin": origin}, 403) for origin in (None, "null", f"https://{OWN}", f"http://{OWN}.evil.example")),
        # A body is refused by its stated length if that is too large or unclear.
        *(({"Content_Length": length}, 413) for length in (str(LARGEST_BODY_BYTES + 1), "9" * 30, None, "-1", "²")),
    ],
)
def test_only_requests_from_the_page_itself_are_accepted(gate, changed, status):
    refusal = gate.refuses("POST", f"/{gate.token}/trace", _own_post(**changed))
    assert (refusal and refusal[0].value) == status


@pytest.mark.parametrize(
    "target",
    ["/", "/trace", "//trace", "/{other}/trace", "/{start}/trace", "/{token}x/", "/é/", "http://{own}/{token}/"],
)
def test_a_request_without_the_exact_token_is_refused(gate, target):
    """Refused are another session's token, a part of the token, letters that no token has, and a full address."""
    written = target.format(other=RequestGate(PORT).token, start=gate.token[:-1], token=gate.token, own=OWN)
    refusal = gate.refuses("GET", written, _own_post())
    assert refusal is not None
    assert refusal[0] == 403


class Echo(TracePage):
    """A page that answers hello and returns the content of each request."""

    def __init__(self):
        opened = Opened(Session(), dict, {})
        super().__init__(opened)

    def get(self, name):
        return (b"hello", "text/plain") if name == "" else None

    def post(self, name, body):
        if name == "bug":
            raise RuntimeError("a bug")
        if name != "echo":
            return None
        sent = json.loads(body)
        return ({"line": number, "sent": sent} for number in (1, 2))


@pytest.fixture
def server():
    with Echo() as running:
        yield running


def _ask(server, method="GET", name="", body=None, **headers):
    """Status, headers, body."""
    sent = {"Origin": f"http://127.0.0.1:{server.server_port}", "Content-Type": "application/json"} if body else {}
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=5)) as connection:
        connection.request(method, f"/{server.gate.token}/{name}", body, sent | headers)
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()


def _wire(server):
    return socket.create_connection(("127.0.0.1", server.server_port), timeout=5)


def _head_of_a_post(server, length) -> bytes:
    host = f"127.0.0.1:{server.server_port}"
    lines = f"POST /{server.gate.token}/echo HTTP/1.1", f"Host: {host}", f"Origin: http://{host}"
    return "\r\n".join([*lines, "Content-Type: application/json", f"Content-Length: {length}", "", ""]).encode()


def test_the_server_answers_on_the_loopback_address_only(server):
    assert server.server_address[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.server_port}/{server.gate.token}/"
    status, headers, body = _ask(server)
    assert (status, headers["Content-Type"], body) == (200, "text/plain", b"hello")
    status, _, body = _ask(server, "POST", "echo", b'{"x": 1}')
    assert status == 200
    assert [json.loads(line) for line in body.splitlines()] == [{"line": n, "sent": {"x": 1}} for n in (1, 2)]


REFUSED = {
    "nothing of that name": (404, {"name": "missing"}),
    "nothing to post to": (404, {"method": "POST", "name": "missing", "body": b"{}"}),
    "no JSON": (400, {"method": "POST", "name": "echo", "body": b"{"}),
    "too large": (413, {"method": "POST", "name": "echo", "body": b" " * (LARGEST_BODY_BYTES + 1)}),
    "another host": (421, {"Host": "evil.example"}),
    **{method: (501, {"method": method}) for method in ("PUT", "OPTIONS", "HEAD", "FOO")},
}


@pytest.mark.parametrize("fault", REFUSED)
def test_a_refused_request_gets_an_error_status_and_no_content(server, fault):
    status, request = REFUSED[fault]
    answered, headers, body = _ask(server, **request)
    assert answered == status
    assert headers["Connection"] == "close"
    assert b"hello" not in body
    assert server.gate.token.encode() not in body
    assert _ask(server)[0] == 200


@pytest.mark.parametrize("request_line", ["GET /{token}/", "GET / ", "nonsense"])
def test_every_response_has_the_security_headers(server, request_line):
    """The HTTP library's own error page would lack them and repeat the request."""
    line = request_line.format(token=server.gate.token, long="x" * 70_000)
    raw = f"{line} HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\nConnection: close\r\n\r\n"
    with _wire(server) as wire:
        wire.sendall(raw.encode())
        head = wire.makefile("rb").read().partition(b"\r\n\r\n")[0].decode()
    for name, value in SECURITY_HEADERS.items():
        assert f"{name}: {value}" in head, head
    assert "Python" not in head


@pytest.mark.parametrize("sent", [b"\x16\x03\x01\x02\x00", b"\x00" * 5000, b"GET / HTTP/9.9\r\n\r\n", 0.5, 1.0])
def test_invalid_requests_and_broken_connections_do_not_stop_the_server(server, sent, capfd):
    """A number is the fraction of the request's head after which the client leaves; 1 is in the body."""
    head = _head_of_a_post(server, length=50)
    with _wire(server) as wire:
        wire.sendall(sent if isinstance(sent, bytes) else head[: int(sent * len(head))] + b'{"x"')
    assert _ask(server)[0] == 200
    assert "Traceback" not in capfd.readouterr().err


def test_a_bug_prints_its_traceback_without_stopping_the_server(server, capfd):
    with pytest.raises((http.client.HTTPException, ConnectionError)):
        _ask(server, "POST", "bug", b"{}")
    assert _ask(server)[0] == 200
    assert "RuntimeError: a bug" in capfd.readouterr().err


def test_a_client_that_sends_a_byte_now_and_then_does_not_delay_the_end(monkeypatch):
    """With a byte a second, the program lived as long as the bytes came."""
    monkeypatch.setattr("digitise.trace_page.page.SLOW_S", 0.5)
    opened = Opened(Session(), lambda hints, shape: {}, {})
    server = TracePage(opened)
    sent = Event()

    def trickle(client):
        client.sendall(b"GET /x HTTP/1.1\r\n")
        with suppress(OSError):
            for _ in range(2000):
                client.sendall(b"X")
                sent.set()
                sleep(0.05)

    with closing(socket.create_connection(("127.0.0.1", server.server_port))) as client:
        server.__enter__()
        Thread(target=trickle, args=(client,), daemon=True).start()
        assert sent.wait(5)
        end = Thread(target=server.__exit__, daemon=True)
        end.start()
        end.join(5)
        assert not end.is_alive()
