"""The trace page's server: what comes in over a socket, and what goes out."""

import http.client
import json
import socket
import threading
import time
from contextlib import closing

import pytest

from digitise.trace_page import page as trace_page
from digitise.trace_page.page import LARGEST_BODY_BYTES, SECURITY_HEADERS, Opened, Sheet, TracePage


class Session:
    def end(self):
        pass


class Echo(TracePage):
    """Says hello, and gives back what it is sent."""

    def __init__(self):
        opened = Opened(Session(), dict, {})  # pyright: ignore[reportArgumentType]
        super().__init__([Sheet("crack.jpg", lambda: opened, lambda: False)])

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
    own = {"Origin": f"http://127.0.0.1:{server.server_port}", "Content-Type": "application/json"} if body else {}
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=5)) as connection:
        connection.request(method, f"/{server.gate.token}/{name}", body, own | headers)
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()


def _sent(server, raw, patience_s=5.0):
    """All that comes back for raw bytes."""
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=patience_s) as wire:
        wire.sendall(raw)
        answer = b""
        while part := wire.recv(65536):
            answer += part
    return answer


def _head_of_a_post(server, length):
    lines = (
        f"POST /{server.gate.token}/echo HTTP/1.1",
        f"Host: 127.0.0.1:{server.server_port}",
        f"Origin: http://127.0.0.1:{server.server_port}",
        "Content-Type: application/json",
        f"Content-Length: {length}",
    )
    return "\r\n".join(lines) + "\r\n\r\n"


def test_it_listens_on_this_machine_only_and_answers_there(server):
    assert server.server_address[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.server_port}/{server.gate.token}/"
    status, headers, body = _ask(server)
    assert (status, headers["Content-Type"], body) == (200, "text/plain", b"hello")
    status, _, body = _ask(server, "POST", "echo", b'{"x": 1}')
    assert status == 200
    assert [json.loads(line) for line in body.splitlines()] == [{"line": n, "sent": {"x": 1}} for n in (1, 2)]


def test_lines_leave_as_soon_as_they_are_there(server):
    """The path is seen while the walls are still measured: the first line must not wait for the second."""
    go_on = threading.Event()

    def slow(name, body):
        yield {"path": 1}
        go_on.wait(5)
        yield {"walls": 2}

    server.post = slow
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=5) as wire:
        wire.sendall(_head_of_a_post(server, length=2).encode() + b"{}")
        lines = wire.makefile("rb")
        assert any(line == b'{"path": 1}\n' for line in lines)
        go_on.set()
        assert any(line == b'{"walls": 2}\n' for line in lines)


REFUSED = {
    "nothing of that name": (404, {"name": "missing"}),
    "nothing to post to": (404, {"method": "POST", "name": "missing", "body": b"{}"}),
    "no JSON": (400, {"method": "POST", "name": "echo", "body": b"{"}),
    "too large": (413, {"method": "POST", "name": "echo", "body": b" " * (LARGEST_BODY_BYTES + 1)}),
    "another host": (421, {"Host": "evil.example"}),
    "another origin": (403, {"method": "POST", "name": "echo", "body": b"{}", "Origin": "http://evil.example"}),
    **{method: (501, {"method": method}) for method in ("PUT", "DELETE", "PATCH", "OPTIONS", "HEAD", "TRACE", "FOO")},
}


@pytest.mark.parametrize("fault", REFUSED)
def test_whatever_is_refused_says_so_and_leaks_nothing(server, fault):
    status, request = REFUSED[fault]
    answered, headers, body = _ask(server, **request)
    assert answered == status
    assert headers["Connection"] == "close"
    assert b"hello" not in body
    assert server.gate.token.encode() not in body
    assert _ask(server)[0] == 200


@pytest.mark.parametrize(
    "request_line", ["GET /{token}/", "GET / ", "POST /{token}/echo", "PUT /", "nonsense", "GET /{long}"]
)
def test_every_answer_carries_the_security_headers(server, request_line):
    """A library's own error page would carry none, and echo what it was sent."""
    line = request_line.format(token=server.gate.token, long="x" * 70_000)
    raw = f"{line} HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\nConnection: close\r\n\r\n"
    head = _sent(server, raw.encode()).partition(b"\r\n\r\n")[0].decode()
    for name, value in SECURITY_HEADERS.items():
        assert f"{name}: {value}" in head, head
    assert "Python" not in head


@pytest.mark.parametrize(
    "sent",
    [
        *(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"\x00" * 5000, b"GET\r\n\r\n"),
        *(b"GET / HTTP/9.9\r\n\r\n", b"\r\n" * 99),
        # Whoever leaves in the middle of a head, or of a body.
        *(0.1, 0.5, 1.0),
    ],
)
def test_garbage_and_whoever_leaves_do_not_kill_it(server, sent, capfd):
    head = _head_of_a_post(server, length=50)
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=5) as wire:
        wire.sendall(sent if isinstance(sent, bytes) else head[: int(sent * len(head))].encode() + b'{"x"')
    assert _ask(server)[0] == 200
    assert "Traceback" not in capfd.readouterr().err


def test_a_silent_client_is_dropped_and_holds_nobody_up(server, monkeypatch, capfd):
    monkeypatch.setattr(trace_page._Visit, "timeout", 0.3)
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=5) as wire:
        wire.sendall(_head_of_a_post(server, length=50).encode() + b" ")
        began = time.monotonic()
        assert _ask(server)[0] == 200
        assert wire.recv(100) == b""
        # 0.3 s of its own, and a machine that is busy elsewhere.
        assert time.monotonic() - began < 3
    assert "Traceback" not in capfd.readouterr().err


def test_it_ends_at_once_but_not_in_the_middle_of_an_answer():
    """Ten seconds of an idle browser's patience are not waited for; a computation in native code is."""
    server = Echo()
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
    working, done = threading.Event(), threading.Event()

    def slow(name, body):
        working.set()
        time.sleep(0.3)
        done.set()
        yield {"late": True}

    server.post = slow
    with (
        socket.create_connection(("127.0.0.1", server.server_port), timeout=5) as idle,
        socket.create_connection(("127.0.0.1", server.server_port), timeout=5) as busy,
    ):
        idle.sendall(f"GET /{server.gate.token}/ HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\n\r\n".encode())
        assert idle.recv(100).startswith(b"HTTP/1.1 200")
        busy.sendall(_head_of_a_post(server, length=2).encode() + b"{}")
        assert working.wait(5)
        began = time.monotonic()
        server.shutdown()
        server.server_close()
        assert done.is_set()
        assert time.monotonic() - began < 5, "half of an idle connection's patience"


def test_a_bug_keeps_its_traceback_and_the_server_goes_on(server, capfd):
    with pytest.raises((http.client.HTTPException, ConnectionError)):
        _ask(server, "POST", "bug", b"{}")
    assert _ask(server)[0] == 200
    assert "RuntimeError: a bug" in capfd.readouterr().err
