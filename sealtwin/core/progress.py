"""Progress of long work: a bar on a terminal, plain lines elsewhere."""

import sys
import time
from contextlib import AbstractContextManager
from typing import Any

LINE_EVERY_S = 10.0  # Time between plain lines in a log


class Progress(AbstractContextManager["Progress"]):
    """Base and silent form; stages call ``start``, ``advance`` and ``note`` and never print."""

    def start(self, title: str, total: int, done: int = 0) -> None:
        """Begin work of ``total`` equal steps, of which an earlier process did ``done``."""

    def advance(self, done: int, note: str = "") -> None:
        """Report that ``done`` steps of the current work are finished."""

    def note(self, text: str) -> None:
        """Show one line to the user at once."""

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the display and leave the terminal clean."""


class PlainProgress(Progress):
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
    """Progress as a bar with the time left, on a terminal."""

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
    """Return silent progress, a bar or lines, according to ``quiet`` and to the kind of stderr."""
    if quiet:
        return Progress()
    return RichProgress() if sys.stderr.isatty() else PlainProgress()
