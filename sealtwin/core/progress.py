"""Progress of long work: a bar on a terminal, plain lines elsewhere."""

import sys
import time
from collections import deque
from contextlib import AbstractContextManager
from typing import Any

LINE_EVERY_S = 10.0  # Time between plain lines in a log
TENTH = 0.1  # Share of the work after which its pace is known


class Pace:
    """The time that work still takes, by the pace of the later half of its steps since the first report.

    What goes before that report, as compiling kernels, is set-up, and says nothing of the steps that follow. Early
    steps may be the cheaper ones: a fill begins with few particles.
    """

    def __init__(self, total: float, done: float = 0.0) -> None:
        self._total, self._before = total, done
        self._first = done
        self._reports: deque[tuple[float, float]] = deque()  # Steps done and time, from half of the way on

    def left_s(self, done: float, now_s: float) -> float | None:
        """Return the expected time left after ``done`` steps; None before a tenth of those that were to do."""
        if not self._reports:
            self._first = done
        if not self._reports or done > self._reports[-1][0]:
            self._reports.append((done, now_s))
        while len(self._reports) > 1 and self._reports[1][0] <= (self._first + done) / 2:
            self._reports.popleft()
        since, since_s = self._reports[0]
        if done <= since or done - self._before < TENTH * (self._total - self._before):
            return None
        return (now_s - since_s) * (self._total - done) / (done - since)


class Progress(AbstractContextManager["Progress"]):
    """Base and silent form; stages call ``start``, ``expect``, ``advance``, ``note`` and ``warn`` and never print."""

    def start(self, title: str, total: int, done: int = 0) -> None:
        """Begin work of ``total`` equal steps, of which an earlier process did ``done``."""

    def expect(self, left_s: float) -> None:
        """Give the time that the current work still takes, where that is known better than by the pace of its steps."""

    def advance(self, done: int, note: str = "") -> None:
        """Report that ``done`` steps of the current work are finished."""

    def note(self, text: str) -> None:
        """Show one line to the user at once."""

    def warn(self, text: str) -> None:
        """Show a warning about a result, also where narration is left out."""
        self.note(text)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the display and leave the terminal clean."""


class _Timed(Progress):
    """Progress that knows the time left."""

    def __init__(self) -> None:
        self._total, self._pace = 0, Pace(0.0)
        self._expected: tuple[float, float] | None = None  # Time left as it was given, and when that was

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._total, self._pace, self._expected = total, Pace(total, done), None

    def expect(self, left_s: float) -> None:
        self._expected = left_s, time.monotonic()

    def _left(self, done: int) -> str:
        """Return the time left in words; empty where it is not known yet, or nothing is left."""
        now_s = time.monotonic()
        left_s = self._pace.left_s(done, now_s)
        if self._expected is not None:
            given_s, at_s = self._expected
            left_s = max(0.0, given_s - (now_s - at_s))
        return "" if left_s is None or done >= self._total else f"about {in_words(left_s)} left"


class QuietProgress(Progress):
    """Warnings alone, as a command with --quiet shows them; Python has warnings of its own."""

    def warn(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


class PlainProgress(_Timed):
    def __init__(self) -> None:
        super().__init__()
        self._title = ""
        self._printed = 0.0

    def start(self, title: str, total: int, done: int = 0) -> None:
        super().start(title, total, done)
        self._title, self._printed = title, time.monotonic()
        self.note(title)

    def advance(self, done: int, note: str = "") -> None:
        left, now_s = self._left(done), time.monotonic()
        if now_s - self._printed < LINE_EVERY_S:
            return
        self._printed = now_s
        told = ", ".join(part for part in (f"{done / self._total:.0%}", left) if part)
        self.note(f"{self._title}: {told}. {note}".rstrip())

    def note(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


class RichProgress(_Timed):
    """Progress as a bar with the time left, on a terminal."""

    def __init__(self) -> None:
        super().__init__()
        from rich import progress
        from rich.console import Console

        self._bar = progress.Progress(
            progress.TextColumn("{task.description:<22}"),
            progress.BarColumn(),
            progress.TaskProgressColumn(),
            progress.TextColumn("{task.fields[left]}"),
            progress.TextColumn("{task.fields[note]}"),
            console=Console(stderr=True),
        )
        self._bar.start()
        self._task: Any = None

    def start(self, title: str, total: int, done: int = 0) -> None:
        super().start(title, total, done)
        self._task = self._bar.add_task(title, total=total, completed=done, left="", note="")

    def advance(self, done: int, note: str = "") -> None:
        self._bar.update(self._task, completed=done, left=self._left(done), note=note)

    def note(self, text: str) -> None:
        self._bar.console.print(text, markup=False, highlight=False)

    def close(self) -> None:
        self._bar.stop()


def progress_for_stderr(quiet: bool) -> Progress:
    """Return silent progress, a bar or lines, according to ``quiet`` and to the kind of stderr."""
    if quiet:
        return Progress()
    return RichProgress() if sys.stderr.isatty() else PlainProgress()


def in_words(time_s: float) -> str:
    """Return a time in seconds below two minutes, in minutes below two hours, else in hours."""
    if time_s < 120:
        return f"{time_s:.0f} s"
    return f"{time_s / 60:.0f} min" if time_s < 7200 else f"{time_s / 3600:.1f} h"
