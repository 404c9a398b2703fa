"""How far a long piece of work has come: a bar on a terminal, plain lines elsewhere."""

import sys
import time
from types import TracebackType
from typing import Any, Self

LINE_EVERY_S = 10.0
"""Between plain lines: seldom enough for a log, often enough to show life."""


class Progress:
    """Base and silent form. Stages call ``start``, ``advance`` and ``note``; they never print."""

    def start(self, title: str, total: int, done: int = 0) -> None:
        """A new piece of work of ``total`` equal steps, of which ``done`` were done in an earlier process."""

    def advance(self, done: int, note: str = "") -> None:
        """``done`` steps of the current piece are behind us."""

    def note(self, text: str) -> None:
        """One line that a person should read now."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leave the terminal clean."""


class OfOne(Progress):
    """The progress of one among several: every piece of work says of which, and the others' goes on."""

    def __init__(self, whole: Progress, name: str) -> None:
        self._whole, self._name = whole, name

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._whole.start(f"{title} {self._name}", total, done)

    def advance(self, done: int, note: str = "") -> None:
        self._whole.advance(done, note)

    def note(self, text: str) -> None:
        self._whole.note(text)


class PlainProgress(Progress):
    """Lines on stderr, for logs and pipes."""

    def __init__(self) -> None:
        self._title, self._total, self._before = "", 0, 0
        self._began = self._printed = 0.0

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._title, self._total, self._before = title, total, done
        self._began = self._printed = time.monotonic()
        self.note(title)

    def advance(self, done: int, note: str = "") -> None:
        now = time.monotonic()
        if now - self._printed < LINE_EVERY_S or done == self._before:
            return
        self._printed = now
        left_s = (now - self._began) * (self._total - done) / (done - self._before)
        self.note(f"{self._title}: {done / self._total:.0%}, about {left_s:.0f} s left. {note}".rstrip())

    def note(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


class RichProgress(Progress):
    """A bar with the time left, on a terminal."""

    def __init__(self) -> None:
        from rich import progress
        from rich.console import Console

        self._bar = progress.Progress(
            progress.TextColumn("{task.description:<22}"),
            progress.BarColumn(),
            progress.TaskProgressColumn(),
            progress.TimeRemainingColumn(),
            progress.TextColumn("{task.fields[note]}"),
            console=Console(stderr=True),
        )
        self._bar.start()
        self._task: Any = None

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._task = self._bar.add_task(title, total=total, completed=done, note="")

    def advance(self, done: int, note: str = "") -> None:
        self._bar.update(self._task, completed=done, note=note)

    def note(self, text: str) -> None:
        self._bar.console.print(text, markup=False, highlight=False)

    def close(self) -> None:
        self._bar.stop()


def progress_for_stderr(quiet: bool) -> Progress:
    """The form that fits where stderr goes."""
    if quiet:
        return Progress()
    return RichProgress() if sys.stderr.isatty() else PlainProgress()
