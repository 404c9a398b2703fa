"""Progress of long work: a bar on a terminal, plain lines elsewhere."""

import math
import sys
import time
from bisect import bisect_right
from contextlib import AbstractContextManager
from typing import Literal

from sealtwin.core.facts import Fact

LINE_EVERY_S = 10.0  # Time between plain lines in a log
TENTH = 0.1  # Share of the work after which the remaining time is estimated

Word = Literal["note", "warning", "fault"]
"""Word before a fact that is shown during the work."""


class Pace:
    """Estimate of the remaining time, from the pace of the later half of the steps since the first report.

    Time before the first report is set-up, such as compiling kernels, and does not count. Early steps do not count
    either, since they may be quicker: a fill begins with few particles.
    """

    def __init__(self, total: float, done: float = 0.0) -> None:
        self._total, self._before = total, done
        self._reports = list[tuple[float, float]]()  # Steps done and time, if steps were done since the last report

    def left_s(self, done: float, now_s: float) -> float | None:
        """Return the expected time left after ``done`` steps, or None until a tenth of the remaining steps is done."""
        if not self._reports or done > self._reports[-1][0]:
            self._reports.append((done, now_s))
        half = (self._reports[0][0] + done) / 2
        since, since_s = self._reports[bisect_right(self._reports, (half, math.inf)) - 1]
        if done <= since or done - self._before < TENTH * (self._total - self._before):
            return None
        return (now_s - since_s) * (self._total - done) / (done - since)


class Progress(AbstractContextManager["Progress"]):
    """Base class, which shows nothing.

    Stages call ``start``, ``expect``, ``advance``, ``note`` and ``warn``, and never print.
    """

    def start(self, title: str, total: int, done: int = 0) -> None:
        """Begin work of ``total`` equal steps, including ``done`` steps by an earlier process."""

    def expect(self, left_s: float) -> None:
        """Set the remaining time of the current work, if there is a better estimate than the pace of its steps."""

    def advance(self, done: int, note: str = "") -> None:
        """Report that ``done`` steps of the current work are finished."""

    later_s, later_times = 0.0, 0
    """Expected time of what the command does after the current work, in s and in times of the current work's own time.
    Both are part of the time left."""

    def later(self, left_s: float, times: int = 0) -> None:
        self.later_s, self.later_times = left_s, times

    def note(self, text: str) -> None:
        """Show a line to the user at once."""

    warned: tuple[Fact, ...] = ()
    """Facts that were shown until now."""

    def warn(self, fact: Fact, word: Word = "note") -> None:
        """Show a fact about a result, even if notes are not shown."""
        self.warned = (*self.warned, fact)
        self.note(f"{word}: {fact}")

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the display and restore the terminal."""


class _Timed(Progress):
    """Progress with an estimate of the remaining time."""

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._total, self._pace = total, Pace(total, done)
        self._ends_s: float | None = None  # Moment of the end of the work, from ``expect``

    def expect(self, left_s: float) -> None:
        self._ends_s = time.monotonic() + left_s

    def _left(self, done: int) -> str:
        """Return the command's remaining time in words, or an empty text without an estimate or if the work is done."""
        now_s = time.monotonic()
        by_pace_s = self._pace.left_s(done, now_s)
        left_s = by_pace_s if self._ends_s is None else max(0.0, self._ends_s - now_s)
        if left_s is None or done >= self._total:
            return ""
        whole_s = left_s * self._total / (self._total - done)
        return f"about {in_words(left_s + self.later_times * whole_s + self.later_s)} left"


class QuietProgress(Progress):
    """Progress that shows warnings only, for a command with --quiet. The Python interface uses ``warnings``."""

    def warn(self, fact: Fact, word: Word = "note") -> None:
        super().warn(fact, word)
        print(f"{word}: {fact}", file=sys.stderr, flush=True)


class PlainProgress(_Timed):
    def start(self, title: str, total: int, done: int = 0) -> None:
        super().start(title, total, done)
        self._title, self._printed = title, time.monotonic()
        self.note(title)

    def advance(self, done: int, note: str = "") -> None:
        left, now_s = self._left(done), time.monotonic()
        if now_s - self._printed < LINE_EVERY_S:
            return
        self._printed = now_s
        state = ", ".join(part for part in (f"{done / self._total:.0%}", left) if part)
        self.note(f"{self._title}: {state}. {note}".rstrip())

    def note(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


class RichProgress(_Timed):
    """Progress bar on a terminal, with the remaining time."""

    def __init__(self) -> None:
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

    def start(self, title: str, total: int, done: int = 0) -> None:
        super().start(title, total, done)
        self._task = self._bar.add_task(title, total=total, completed=done, left="", note="")

    def advance(self, done: int, note: str = "") -> None:
        self._bar.update(self._task, completed=done, left=self._left(done), note=note)

    def note(self, text: str) -> None:
        self._bar.console.print(text, markup=False, highlight=False)

    def close(self) -> None:
        self._bar.stop()


def progress_for_stderr() -> Progress:
    """Return a bar if stderr is a terminal, else lines."""
    return RichProgress() if sys.stderr.isatty() else PlainProgress()


def wanted(progress: bool | None) -> bool:
    """Return ``progress``; if it is None, True if a person looks: stderr is a terminal, or this is a notebook."""
    if progress is not None:
        return progress
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


def in_words(time_s: float) -> str:
    """Return a time as text: in seconds below two minutes, in minutes below two hours, else in hours."""
    if time_s < 120:
        return f"{time_s:.0f} s"
    return f"{time_s / 60:.0f} min" if time_s < 7200 else f"{time_s / 3600:.1f} h"
