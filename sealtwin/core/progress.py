"""Show the progress of long computations: a bar on a terminal, plain lines elsewhere."""

import math
import sys
import time
from bisect import bisect_right
from contextlib import AbstractContextManager
from typing import Literal

from sealtwin.core.facts import Fact, Facts

LINE_EVERY_S = 10.0  # Time between two lines in a log, in s
TENTH = 0.1  # Fraction of the work after which the remaining time is shown

Word = Literal["note", "warning", "fault"]
"""Word that is printed before a fact during the work."""


class Pace:
    """Estimate the remaining time from the speed of the later half of the finished steps.

    The time before the first report is not counted, since it is set-up such as compiling kernels. The earlier half of
    the steps is not counted either, since early steps may be faster: a fill begins with few particles.
    """

    def __init__(self, total: float) -> None:
        self._total = total
        self._reports = list[tuple[float, float]]()  # Finished steps and time of each report with new steps

    def left_s(self, done: float, now_s: float) -> float | None:
        """Return the expected remaining time in s after ``done`` steps.

        ``now_s`` is the current time. Returns None if no step is finished.
        """
        if not self._reports or done > self._reports[-1][0]:
            self._reports.append((done, now_s))
        half = (self._reports[0][0] + done) / 2
        since, since_s = self._reports[bisect_right(self._reports, (half, math.inf)) - 1]
        if done <= since:
            return None
        return (now_s - since_s) * (self._total - done) / (done - since)


class Progress(AbstractContextManager["Progress"]):
    """Base class of progress displays. It shows nothing itself.

    Stages call ``start``, ``expect``, ``advance``, ``note`` and ``warn``, and never print.
    """

    def start(self, title: str, total: int, done: int = 0) -> None:
        """Begin work of ``total`` equal steps, of which an earlier process has finished ``done``."""

    def expect(self, left_s: float) -> None:
        """Set the remaining time of the current work in s. It replaces the estimate from the speed of the steps."""

    def advance(self, done: int, note: str = "") -> None:
        """Report that ``done`` steps of the current work are finished."""

    later_s, later_times = 0.0, 0
    """Expected time of the work that follows the current work: a time in s, plus a multiple of the current work's time.

    Both are included in the remaining time."""

    def later(self, left_s: float, times: int = 0) -> None:
        self.later_s, self.later_times = left_s, times

    def note(self, text: str) -> None:
        """Show a line to the user at once."""

    warned: Facts = ()
    """Facts that have been shown."""

    def warn(self, fact: Fact, word: Word = "note") -> None:
        """Show a fact about a result, even if notes are hidden."""
        self.warned = (*self.warned, fact)
        self.note(f"{word}: {fact}")

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the display and restore the terminal."""


class _Timed(Progress):
    """Base class of displays that estimate the remaining time."""

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._total, self._pace, self._shown_from = total, Pace(total), done + TENTH * (total - done)
        self._ends_s: float | None = None  # Time at which the work is expected to end, set by ``expect``

    def expect(self, left_s: float) -> None:
        self._ends_s = time.monotonic() + left_s

    def _left(self, done: int) -> str:
        """Return the remaining time of the command in words.

        Returns "" if it is unknown, before a tenth of the steps is finished, and after the last step.
        """
        now_s = time.monotonic()
        by_pace_s = self._pace.left_s(done, now_s)
        left_s = by_pace_s if self._ends_s is None else max(0.0, self._ends_s - now_s)
        if left_s is None or not self._shown_from <= done < self._total:
            return ""
        whole_s = left_s * self._total / (self._total - done)
        later_s = self.later_times * whole_s + self.later_s
        return f"about {in_words(left_s + later_s)} left{' in all' * (later_s > 0)}"


class QuietProgress(Progress):
    """Progress that shows only warnings, for commands with --quiet. The Python interface uses ``warnings`` instead."""

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
    """Return a progress bar if stderr is a terminal, and otherwise a progress display in lines."""
    return RichProgress() if sys.stderr.isatty() else PlainProgress()


def wanted(progress: bool | None) -> bool:
    """Return ``progress``. If it is None, return True in a terminal (stderr) or a notebook."""
    if progress is not None:
        return progress
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


def in_words(time_s: float) -> str:
    """Return a time as text: in seconds below two minutes, in minutes below two hours, and in hours above."""
    if time_s < 120:
        return f"{time_s:.0f} s"
    return f"{time_s / 60:.0f} min" if time_s < 7200 else f"{time_s / 3600:.1f} h"
