"""A small web server for one page on this machine: every answer passes the gate, and nothing but answers leaves it."""

import json
import socket
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import BoundedSemaphore
from typing import Any, NamedTuple, Protocol, cast

from digitise.trace_page.gate import Gate, Refusal

SLOW_S = 10.0
"""A request that takes longer to arrive is not this page's; on its own machine one takes milliseconds."""
MOST_CONNECTIONS = 32
"""A browser keeps six; several windows on one page fit."""
SECURITY_HEADERS = {
    # Nothing from elsewhere, nothing inline, in no frame.
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    # The address holds the token.
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Content(NamedTuple):
    """What a GET is answered with."""

    body: bytes
    media_type: str


class Site(Protocol):
    """What is served. Names are what follows the token in an address."""

    def get(self, name: str) -> Content | None:
        """None where there is nothing of that name."""
        ...

    def post(self, name: str, body: bytes) -> Iterator[dict[str, Any]] | None:
        """Answers, each sent as a line of JSON when it is there. Raises ValueError for a body that cannot be."""
        ...


class PageServer(ThreadingHTTPServer):
    """On 127.0.0.1 only. ``port`` 0 takes a free one."""

    # A thread that is still inside a native library as the interpreter ends takes the whole process down with it.
    daemon_threads, block_on_close = False, True
    # A browser opens several connections in one breath; those that find no place in the queue try again a second later.
    request_queue_size = MOST_CONNECTIONS

    def __init__(self, site: Site, port: int = 0) -> None:
        self._room = BoundedSemaphore(MOST_CONNECTIONS)
        self._connections: set[socket.socket] = set()
        super().__init__(("127.0.0.1", port), _Visit)
        self.site = site
        self.gate = Gate(self.server_port)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/{self.gate.token}/"

    def verify_request(self, request: Any, client_address: Any) -> bool:
        return self._room.acquire(blocking=False)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        self._connections.add(request)
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._connections.discard(request)
            self._room.release()

    def server_close(self) -> None:
        """Let answers that are under way be finished; a browser's idle connections are not waited for."""
        for connection in tuple(self._connections):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RD)
        super().server_close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        # A client that went away or never spoke HTTP is no news; a bug keeps its traceback.
        if not isinstance(sys.exception(), OSError):
            traceback.print_exc()


class _Visit(BaseHTTPRequestHandler):
    """One connection; several requests, one after the other."""

    protocol_version = "HTTP/1.1"
    timeout = SLOW_S
    server_version, sys_version = "sealtwin", ""

    def do_GET(self) -> None:
        if not self._let_in():
            return
        content = self._page.site.get(self._name)
        if content is None:
            self._refuse(Refusal(HTTPStatus.NOT_FOUND, "there is nothing of that name"))
            return
        self._begin(HTTPStatus.OK, content.media_type, {"Content-Length": str(len(content.body))})
        self.wfile.write(content.body)

    def do_POST(self) -> None:
        if not self._let_in():
            return
        body = self._body()
        if body is None:
            self._refuse(Refusal(HTTPStatus.REQUEST_TIMEOUT, "the body did not arrive"))
            return
        try:
            answers = self._page.site.post(self._name, body)
        except ValueError as fault:
            self._refuse(Refusal(HTTPStatus.BAD_REQUEST, str(fault)))
            return
        if answers is None:
            self._refuse(Refusal(HTTPStatus.NOT_FOUND, "there is nothing of that name"))
            return
        self._begin(HTTPStatus.OK, "application/x-ndjson", {"Transfer-Encoding": "chunked"})
        for answer in answers:
            line = json.dumps(answer, allow_nan=False).encode() + b"\n"
            self.wfile.write(b"%x\r\n%b\r\n" % (len(line), line))
        self.wfile.write(b"0\r\n\r\n")

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """For what never became a request: the library's own page would echo it, without the headers above."""
        # What names no version gets no headers from the library, not even these.
        self.request_version = self.protocol_version
        self._refuse(Refusal(HTTPStatus(code), HTTPStatus(code).phrase))

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are no news, and their lines hold the token."""

    @property
    def _page(self) -> PageServer:
        return cast(PageServer, self.server)

    @property
    def _name(self) -> str:
        return self.path.removeprefix("/").partition("/")[2]

    def _let_in(self) -> bool:
        refusal = self._page.gate.refuses(self.command, self.path, self.headers)
        if refusal is not None:
            self._refuse(refusal)
        return refusal is None

    def _body(self) -> bytes | None:
        """All of it, or None where it does not arrive in time."""
        expected, deadline = int(self.headers["Content-Length"]), time.monotonic() + SLOW_S
        body = b""
        try:
            while len(body) < expected and time.monotonic() < deadline:
                part = self.rfile.read1(expected - len(body))
                if not part:
                    return None
                body += part
        except TimeoutError:
            return None
        return body if len(body) == expected else None

    def _refuse(self, refusal: Refusal) -> None:
        body = json.dumps({"error": refusal.reason}).encode()
        # What may still arrive of the request is not read: the connection goes with it.
        self._begin(refusal.status, "application/json", {"Content-Length": str(len(body)), "Connection": "close"})
        if self.command != "HEAD":
            self.wfile.write(body)

    def _begin(self, status: HTTPStatus, media_type: str, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": media_type, **headers, **SECURITY_HEADERS}.items():
            self.send_header(name, value)
        self.end_headers()

    def setup(self) -> None:
        super().setup()
        # Small answers must not wait for each other.
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, True)
