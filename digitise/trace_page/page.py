"""The trace page: a photo in this machine's browser, and the hints that come back. It writes nothing itself."""

import json
import re
from collections.abc import Callable, Iterator
from importlib.resources import files
from threading import Event, Thread
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError

from digitise.trace_page.hints import Hints
from digitise.trace_page.server import Content, PageServer
from digitise.trace_page.session import OutdatedError, TraceSession, Until
from sealtwin.errors import InputError
from sealtwin.settings import Settings

MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
TILE = re.compile(r"photo/(\d{1,2})/(\d{1,3})/(\d{1,3})\.jpg")

Save = Callable[[Hints, float | None], dict[str, Any]]
"""Takes the hints, and the depth in mm where the page asked for it; gives what the page says in the end. Raises
InputError or OSError where they cannot be saved: the page says why, and stays.
"""


class Question(Settings):
    """Where the crack is, with these hints."""

    hints: Hints
    revision: Annotated[float, Field(ge=0)]
    until: Until


class Farewell(Settings):
    """What is to be saved."""

    hints: Hints
    depth_mm: float | None = None


class TracePage:
    """Serves ``session`` until the user has saved or left."""

    def __init__(self, session: TraceSession, save: Save, *, facts: dict[str, Any], port: int = 0) -> None:
        """``facts``: what the page is told of where it saves. Raises OSError where ``port`` is taken."""
        self._session, self._save, self._facts = session, save, facts
        self._files = {
            entry.name: Content(entry.read_bytes(), media_type)
            for entry in (files("digitise.trace_page") / "assets").iterdir()
            if (media_type := MEDIA_TYPES.get(entry.name[entry.name.rfind(".") :]))
        }
        self._ended = Event()
        self._saved: dict[str, Any] | None = None
        self._server = PageServer(self, port)
        self.url = self._server.url

    def __enter__(self) -> Self:
        Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._session.end()
        self._server.shutdown()
        self._server.server_close()

    def wait(self) -> dict[str, Any] | None:
        """Until the user is done: what ``save`` gave, or None where nothing was saved."""
        # A wait without an end cannot be interrupted from the keyboard on Windows.
        while not self._ended.wait(0.5):
            pass
        return self._saved

    def get(self, name: str) -> Content | None:
        if name == "session":
            return Content(_json({**self._session.opening(), **self._facts}), "application/json")
        if found := TILE.fullmatch(name):
            level, column, row = (int(number) for number in found.groups())
            tile = self._session.pyramid.tile(level, column, row)
            return None if tile is None else Content(tile, "image/jpeg")
        return self._files.get(name or "page.html")

    def post(self, name: str, body: bytes) -> Iterator[dict[str, Any]] | None:
        try:
            if name == "trace":
                return self._traced(Question.model_validate_json(body))
            if name == "save":
                return self._saving(Farewell.model_validate_json(body))
            if name == "quit":
                return self._leaving()
        except ValidationError as fault:
            raise ValueError(f"not what this page sends: {fault.errors()[0]['msg']}") from None
        return None

    def _traced(self, question: Question) -> Iterator[dict[str, Any]]:
        try:
            yield from self._session.trace(question.hints, question.revision, question.until)
        except OutdatedError:
            yield {"outdated": True}

    def _saving(self, farewell: Farewell) -> Iterator[dict[str, Any]]:
        try:
            saved = self._save(farewell.hints, farewell.depth_mm)
        except InputError as fault:
            yield {"refused": str(fault)}
            return
        except OSError as fault:
            # A full disk, or a folder of somebody else's: what was clicked must not be lost by that.
            yield {"refused": f"{fault.filename}: {fault.strerror}. Make that place writable, and save again."}
            return
        yield {"saved": saved}
        self._saved = saved
        self._ended.set()

    def _leaving(self) -> Iterator[dict[str, Any]]:
        yield {"left": True}
        self._ended.set()


def _json(content: dict[str, Any]) -> bytes:
    return json.dumps(content, allow_nan=False).encode()
