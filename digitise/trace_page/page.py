"""Serve the trace page, which shows photos one after the other in this machine's browser and reads the user's hints.

The page writes no files. Every request is checked before its body is read. The standard library's server is used
because a web framework would add dependencies for two routes.
"""

import json
import re
import secrets
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from email.message import Message
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from socket import SHUT_RDWR
from tempfile import TemporaryDirectory
from threading import Event, Thread, Timer
from typing import Annotated, Any, NamedTuple, Self, cast

from pydantic import Field, ValidationError

from digitise.trace_page.session import Answer, Hints, OutdatedError, Shape, TraceSession, Until
from sealtwin.core.errors import InputError
from sealtwin.core.settings import Settings

DOOR = """<!doctype html>
<meta charset="utf-8"><meta name="referrer" content="no-referrer"><title>sealtwin</title>
<meta http-equiv="refresh" content="0; url={url}">
<a href="{url}">The trace page</a>
"""
Content = tuple[bytes, str]  # Body and media type of the response to a GET
LARGEST_BODY_BYTES = 400_000  # Largest body of a request: a trial may have as many drawn walls
SLOW_S = 2.0  # Longest silence on a connection in s; requests of the page arrive in milliseconds
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
    # Idle connections of a browser would delay the end of the program.
    "Connection": "close",
}


MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
TILE = re.compile(r"photo/(\d{1,2})/(\d{1,3})/(\d{1,3})\.jpg")

# Function that saves hints and shape, and returns texts for the page to show. The page also shows an InputError or
# OSError.
Save = Callable[[Hints, Shape], dict[str, Any]]


class Opened(NamedTuple):
    """A photo that is open on the page."""

    session: TraceSession
    save: Save
    facts: dict[str, Any]
    """Additional fields of the page's initial state."""


class Question(Settings):
    """A request to trace the crack with hints, up to the step ``until``."""

    hints: Hints
    revision: Annotated[float, Field(ge=0)]
    until: Until


class Farewell(Settings):
    """A request to save hints and shape."""

    hints: Hints
    shape: Shape = Shape()


class RequestGate:
    """Checks requests: the token in the page's address, the host name, the origin, and the size."""

    def __init__(self, port: int) -> None:
        self.token = secrets.token_urlsafe(32)
        # Any other host name belongs to a foreign site that resolves to this machine (DNS rebinding).
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    def refuses(self, method: str, target: str, headers: Message) -> tuple[HTTPStatus, str] | None:
        """Return status and reason of a refusal, or None if the request is allowed."""
        if headers["Host"] not in self._hosts:
            return HTTPStatus.MISDIRECTED_REQUEST, "this page answers only to 127.0.0.1 and localhost"
        token = target.removeprefix("/").partition("/")[0]
        if not secrets.compare_digest(token.encode(), self.token.encode()):
            return HTTPStatus.FORBIDDEN, "the address does not contain the token that 'sealtwin trace' printed"
        if method != "POST":
            return None
        # Pages of other sites can post here. Browsers then state that site as the origin.
        if headers["Origin"] not in {f"http://{host}" for host in self._hosts}:
            return HTTPStatus.FORBIDDEN, "the request comes from another page"
        length = headers.get("Content-Length", "")
        if not (length.isdecimal() and len(length) < 10 and int(length) <= LARGEST_BODY_BYTES):
            return HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a body needs a Content-Length of at most {LARGEST_BODY_BYTES}"
        return None


class TracePage(ThreadingHTTPServer):
    """Server of a photo on 127.0.0.1. It ends when the user saves or quits."""

    # A thread that is in a native library when the interpreter ends would crash the process.
    daemon_threads, block_on_close = False, True
    # A browser opens several connections at once. If the queue is full, it waits a second before it tries again.
    request_queue_size = 32

    def __init__(self, opened: Opened, port: int = 0) -> None:
        """Serve an open photo on ``port`` or, if it is 0, on any free port. Raises OSError if the port is in use."""
        self._opened = opened
        self._files = {
            entry.name: (entry.read_bytes(), media_type)
            for entry in (files("digitise.trace_page") / "assets").iterdir()
            if (media_type := MEDIA_TYPES.get(entry.name[entry.name.rfind(".") :]))
        }
        self._ended = Event()
        self._connections = set[Any]()
        self.saved: dict[str, Any] | None = None
        """Result of ``save``. None if nothing was saved."""
        super().__init__(("127.0.0.1", port), _Visit)
        self.gate = RequestGate(self.server_port)

    def __enter__(self) -> Self:
        Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.session.end()
        self.shutdown()
        # A client that sends a byte now and then would keep its thread, for which the end waits.
        cut = Timer(SLOW_S, self._cut_connections)
        cut.daemon = True
        cut.start()
        self.server_close()

    def process_request(self, request: Any, client_address: Any) -> None:
        self._connections.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        self._connections.discard(request)
        super().shutdown_request(request)

    def _cut_connections(self) -> None:
        for connection in tuple(self._connections):
            with suppress(OSError):
                connection.shutdown(SHUT_RDWR)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/{self.gate.token}/"

    @contextmanager
    def doorway(self) -> Iterator[str]:
        """Yield the address of a file that redirects to the page and that only this user can read.

        Every user of the machine can see a browser's arguments, so the token must not be one of them.
        """
        with TemporaryDirectory(prefix="sealtwin-", ignore_cleanup_errors=True) as folder:
            # Only this user can read the folder.
            door = Path(folder) / "trace.html"
            door.write_text(DOOR.format(url=self.url), encoding="utf-8")
            door.chmod(0o600)
            yield door.as_uri()

    def wait(self) -> None:
        """Wait until the user has finished."""
        # On Windows, the keyboard cannot interrupt a wait without a timeout.
        while not self._ended.wait(0.5):
            pass

    def get(self, name: str) -> Content | None:
        """Return the content for a name, which follows the token in the address. None if there is nothing."""
        session, _, facts = self._opened
        if name == "session":
            return json.dumps({**session.opening(), **facts}, allow_nan=False).encode(), "application/json"
        if tile_name := TILE.fullmatch(name):
            tile = session.pyramid.tile(*map(int, tile_name.groups()))
            return None if tile is None else (tile, "image/jpeg")
        return self._files.get(name or "page.html")

    def post(self, name: str, body: bytes) -> Iterator[Answer] | None:
        """Yield answers, each of which is sent at once. None for an unknown name. Raises ValueError for a bad body."""
        try:
            if name == "trace":
                return self._traced(Question.model_validate_json(body))
            if name == "save":
                return self._saving(Farewell.model_validate_json(body))
            if name == "quit":
                return self._leaving()
        except ValidationError as fault:
            raise ValueError(f"not a request of this page: {fault.errors()[0]['msg']}") from None
        return None

    def _traced(self, question: Question) -> Iterator[Answer]:
        try:
            yield from self._opened.session.trace(question.hints, question.revision, question.until)
        except OutdatedError:
            yield {"outdated": True}

    def _saving(self, farewell: Farewell) -> Iterator[Answer]:
        try:
            self.saved = self._opened.save(farewell.hints, farewell.shape)
        except InputError as fault:
            yield {"refused": str(fault)}
            return
        except OSError as fault:
            # If the disk is full or the folder is read-only, the points stay on the page.
            yield {"refused": f"{fault.filename}: {fault.strerror}. Make the folder writable, and save again."}
            return
        yield {"saved": self.saved}
        self._ended.set()

    def _leaving(self) -> Iterator[Answer]:
        yield {"left": True}
        self._ended.set()

    def handle_error(self, request: Any, client_address: Any) -> None:
        # Clients that disconnect or do not use HTTP are ignored. A bug prints its traceback.
        if not isinstance(sys.exception(), OSError):
            traceback.print_exc()


class _Visit(BaseHTTPRequestHandler):
    """One connection that carries one request."""

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
        self._send(HTTPStatus.OK, *content)

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
        """Answer with the reason in JSON, and with the security headers, which the standard library would not send."""
        # If the request has no version, the library would send no headers.
        self.request_version = self.protocol_version
        body = json.dumps({"error": message or HTTPStatus(code).phrase}).encode()
        self._send(code, body, "application/json")

    def log_message(self, format: str, *args: Any) -> None:
        """Write no log, because the addresses of requests contain the token."""

    @property
    def _page(self) -> TracePage:
        return cast(TracePage, self.server)

    @property
    def _name(self) -> str:
        return self.path.removeprefix("/").partition("/")[2]

    def _send(self, status: int, body: bytes, media_type: str) -> None:
        self._begin(status, media_type, {"Content-Length": str(len(body))})
        self.wfile.write(body)

    def _begin(self, status: int, media_type: str, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": media_type, **headers, **SECURITY_HEADERS}.items():
            self.send_header(name, value)
        self.end_headers()
