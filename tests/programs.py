"""Programs that a test starts, and ends."""

import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C mean what it does in a terminal: a script ignores it in what it runs in the background, and in tests.

    A program that is started inside has the usual handler too, for one of Python's own is not passed on. It is set
    here: Python that runs between fork and exec may wait for a lock that another thread held.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def start_interruptible(command: Sequence[str], **options: Any) -> "subprocess.Popen[str]":
    """Start a program that Ctrl-C ends, with its output and errors as text."""
    with interruptible():
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
