"""A server of one page, for the browser of this machine only.

A gate checks every request before its body is read. The standard library's server is used because a web framework would
add dependencies for two routes.
"""

import json
import re
import secrets
import socket
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from email.message import Message
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

DOOR = """<!doctype html>
<meta charset="utf-8"><meta name="referrer" content="no-referrer"><title>sealtwin</title>
<meta http-equiv="refresh" content="0; url={url}">
<a href="{url}">The trace page</a>
"""
Content = tuple[bytes, str]  # Body and media type of the answer to a GET
LARGEST_BODY_BYTES = 400_000  # Largest body of a request: as many drawn walls and strokes as a trial may have
SLOW_S = 10.0  # Longest silence on a connection; requests of the page arrive in milliseconds
SECURITY_HEADERS = {
    # No foreign content, no inline scripts, no frames.
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    # The address contains the token.
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class RequestGate:
    """Check of the token in the page's address and of the host names that are allowed."""

    def __init__(self, port: int) -> None:
        self.token = secrets.token_urlsafe(32)
        # Another name belongs to a foreign site that resolves to this machine (DNS rebinding).
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    def refuses(self, method: str, target: str, headers: Message) -> tuple[HTTPStatus, str] | None:
        """Return status and reason of a refusal; None if the request is allowed."""
        if headers["Host"] not in self._hosts:
            return HTTPStatus.MISDIRECTED_REQUEST, "this page answers to 127.0.0.1 and localhost only"
        token = target.removeprefix("/").partition("/")[0]
        if not secrets.compare_digest(token.encode(), self.token.encode()):
            return HTTPStatus.FORBIDDEN, "the address lacks the token that 'sealtwin trace' printed"
        if method != "POST":
            return None
        # Pages of other sites can post here; browsers then name that site.
        if headers["Origin"] not in {f"http://{host}" for host in self._hosts}:
            return HTTPStatus.FORBIDDEN, "the request is from another page"
        if not re.fullmatch("[0-9]{1,9}", headers.get("Content-Length", "")):
            return HTTPStatus.LENGTH_REQUIRED, "a body needs a Content-Length"
        if int(headers["Content-Length"]) > LARGEST_BODY_BYTES:
            return HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"the body is larger than {LARGEST_BODY_BYTES} bytes"
        return None


class PageServer(ThreadingHTTPServer):
    """A server on 127.0.0.1 only; ``port`` 0 takes a free one. Names are the part of an address after the token."""

    # A thread that is inside a native library at the interpreter's end would crash the process.
    daemon_threads, block_on_close = False, True
    # A browser opens several connections at once, and retries those that find the queue full a second later.
    request_queue_size = 32

    def __init__(self, port: int = 0) -> None:
        self._connections: set[socket.socket] = set()
        super().__init__(("127.0.0.1", port), _Visit)
        self.gate = RequestGate(self.server_port)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/{self.gate.token}/"

    @contextmanager
    def doorway(self) -> Iterator[str]:
        """Yield the address of a file that redirects to the page and that only this user can read.

        Every user of the machine can see a browser's arguments, so the token must not be one of them.
        """
        with TemporaryDirectory(prefix="sealtwin-", ignore_cleanup_errors=True) as folder:
            # The folder is the user's alone, by its mode.
            door = Path(folder) / "trace.html"
            door.write_text(DOOR.format(url=self.url), encoding="utf-8")
            door.chmod(0o600)
            yield door.as_uri()

    def get(self, name: str) -> Content | None:
        """Return the content with a name; None if there is none."""
        raise NotImplementedError

    def post(self, name: str, body: bytes) -> Iterator[dict[str, Any]] | None:
        """Return lines of JSON, each to be sent at once; None for an unknown name. Raises ValueError for a bad body."""
        raise NotImplementedError

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        self._connections.add(request)
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._connections.discard(request)

    def server_close(self) -> None:
        """Finish responses in progress, but do not wait for a browser's idle connections."""
        for connection in tuple(self._connections):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RD)
        super().server_close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        # Clients that disconnect or do not speak HTTP are ignored; a bug keeps its traceback.
        if not isinstance(sys.exception(), OSError):
            traceback.print_exc()


class _Visit(BaseHTTPRequestHandler):
    """One connection, with several requests in turn."""

    protocol_version = "HTTP/1.1"
    timeout = SLOW_S
    server_version, sys_version = "sealtwin", ""
    disable_nagle_algorithm = True

    def parse_request(self) -> bool:
        if not super().parse_request():
            return False
        if refusal := self._page.gate.refuses(self.command, self.path, self.headers):
            self.send_error(*refusal)
        return refusal is None

    def do_GET(self) -> None:
        if (content := self._page.get(self._name)) is None:
            return self.send_error(HTTPStatus.NOT_FOUND, "nothing has that name")
        body, media_type = content
        self._begin(HTTPStatus.OK, media_type, {"Content-Length": str(len(body))})
        self.wfile.write(body)

    def do_POST(self) -> None:
        try:
            answers = self._page.post(self._name, self.rfile.read(int(self.headers["Content-Length"])))
        except ValueError as fault:
            return self.send_error(HTTPStatus.BAD_REQUEST, str(fault))
        if answers is None:
            return self.send_error(HTTPStatus.NOT_FOUND, "nothing has that name")
        self._begin(HTTPStatus.OK, "application/x-ndjson", {"Transfer-Encoding": "chunked"})
        for answer in answers:
            line = json.dumps(answer, allow_nan=False).encode() + b"\n"
            self.wfile.write(b"%x\r\n%b\r\n" % (len(line), line))
        self.wfile.write(b"0\r\n\r\n")

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Answer with the reason in JSON and the security headers, which the library's page lacks."""
        # Without a version in the request, the library would send no headers.
        self.request_version = self.protocol_version
        body = json.dumps({"error": message or HTTPStatus(code).phrase}).encode()
        # The rest of the request is not read, so the connection must close.
        self._begin(code, "application/json", {"Content-Length": str(len(body)), "Connection": "close"})
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: the lines of requests contain the token."""

    @property
    def _page(self) -> PageServer:
        return cast(PageServer, self.server)

    @property
    def _name(self) -> str:
        return self.path.removeprefix("/").partition("/")[2]

    def _begin(self, status: int, media_type: str, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": media_type, **headers, **SECURITY_HEADERS}.items():
            self.send_header(name, value)
        self.end_headers()
