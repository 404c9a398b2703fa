"""The trace page: it shows photos in this machine's browser, one after the other, and takes the user's hints.

It writes no file itself.
"""

import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from threading import Event, Lock, Thread
from typing import Annotated, Any, NamedTuple, Self

from pydantic import Field, ValidationError

from digitise.trace_page.server import Content, PageServer
from digitise.trace_page.session import Hints, OutdatedError, Shape, TraceSession, Until
from sealtwin.core.errors import InputError
from sealtwin.core.settings import Settings

MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
TILE = re.compile(r"photo/(\d{1,2})/(\d{1,3})/(\d{1,3})\.jpg")

# Saves hints and shape; returns the texts of the last view. The page shows an InputError or OSError.
Save = Callable[[Hints, Shape], dict[str, Any]]


class Opened(NamedTuple):
    """A photo on the page."""

    session: TraceSession
    save: Save
    facts: dict[str, Any]
    """Further fields of the page's initial state."""


@dataclass(frozen=True)
class Sheet:
    """A photo that the page can show."""

    name: str
    open: Callable[[], Opened]
    """Reads the photo; raises InputError for a bad one."""
    done: Callable[[], bool]
    """True if the trial file has the crack's ends."""


class Question(Settings):
    """Request for the crack that these hints give."""

    hints: Hints
    revision: Annotated[float, Field(ge=0)]
    until: Until


class Farewell(Settings):
    """Request to save hints and shape."""

    hints: Hints
    shape: Shape = Shape()


class Turn(Settings):
    """Request to show another photo. The photo is given by its place in the list."""

    photo: Annotated[int, Field(ge=0)]


class TracePage(PageServer):
    """Serves the photos until the user has saved the only one, or quits."""

    def __init__(self, sheets: Sequence[Sheet], port: int = 0) -> None:
        """Begin with the first photo that is not done. Raises InputError if all are bad, OSError for a used port."""
        self._sheets = tuple(sheets)
        self._here, self._opened = self._first()
        self._files = {
            entry.name: (entry.read_bytes(), media_type)
            for entry in (files("digitise.trace_page") / "assets").iterdir()
            if (media_type := MEDIA_TYPES.get(entry.name[entry.name.rfind(".") :]))
        }
        self._ended, self._turning = Event(), Lock()
        self.saved: list[dict[str, Any]] = []
        """Results of ``save`` so far."""
        super().__init__(port)

    def __enter__(self) -> Self:
        Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.session.end()
        self.shutdown()
        self.server_close()

    def wait(self) -> None:
        """Wait until the user has finished."""
        # On Windows, the keyboard cannot interrupt a wait without a timeout.
        while not self._ended.wait(0.5):
            pass

    def _first(self) -> tuple[int, Opened]:
        numbers = sorted(range(len(self._sheets)), key=lambda number: self._sheets[number].done())
        for number in numbers[:-1]:
            with suppress(InputError):
                return number, self._sheets[number].open()
        return numbers[-1], self._sheets[numbers[-1]].open()

    @property
    def photos(self) -> list[dict[str, Any]]:
        """Photos in the page's list. The list is empty if there is only one photo."""
        if len(self._sheets) == 1:
            return []
        return [
            {"name": sheet.name, "done": sheet.done(), "here": number == self._here}
            for number, sheet in enumerate(self._sheets)
        ]

    def get(self, name: str) -> Content | None:
        session, _, facts = self._opened
        if name == "session":
            opening = {**session.opening(), **facts, "photos": self.photos}
            return json.dumps(opening, allow_nan=False).encode(), "application/json"
        if tile_name := TILE.fullmatch(name):
            level, column, row = (int(number) for number in tile_name.groups())
            tile = session.pyramid.tile(level, column, row)
            return None if tile is None else (tile, "image/jpeg")
        return self._files.get(name or "page.html")

    def post(self, name: str, body: bytes) -> Iterator[dict[str, Any]] | None:
        try:
            if name == "trace":
                return self._traced(Question.model_validate_json(body))
            if name == "save":
                return self._saving(Farewell.model_validate_json(body))
            if name == "turn":
                return self._turned(Turn.model_validate_json(body).photo)
            if name == "quit":
                return self._leaving()
        except ValidationError as fault:
            raise ValueError(f"not a request of this page: {fault.errors()[0]['msg']}") from None
        return None

    def _traced(self, question: Question) -> Iterator[dict[str, Any]]:
        try:
            yield from self._opened.session.trace(question.hints, question.revision, question.until)
        except OutdatedError:
            yield {"outdated": True}

    def _saving(self, farewell: Farewell) -> Iterator[dict[str, Any]]:
        try:
            saved = self._opened.save(farewell.hints, farewell.shape)
        except InputError as fault:
            yield {"refused": str(fault)}
            return
        except OSError as fault:
            # The page keeps its points when the disk is full or the folder is read-only.
            yield {"refused": f"{fault.filename}: {fault.strerror}; make the folder writable, and save again."}
            return
        self.saved.append(saved)
        yield {"saved": saved, "photos": self.photos}
        if len(self._sheets) == 1:
            self._ended.set()

    def _turned(self, number: int) -> Iterator[dict[str, Any]]:
        if number >= len(self._sheets):
            yield {"refused": f"photo {number + 1} does not exist; there are {len(self._sheets)} photos"}
            return
        # Two clicks must not open two photos at once.
        with self._turning:
            try:
                opened = self._sheets[number].open()
            except InputError as fault:
                yield {"refused": str(fault)}
                return
            self._opened.session.end()
            self._here, self._opened = number, opened
        yield {"turned": True}

    def _leaving(self) -> Iterator[dict[str, Any]]:
        yield {"left": True}
        self._ended.set()
