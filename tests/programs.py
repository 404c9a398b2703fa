"""Programs that a test starts, and ends."""

import signal
import subprocess
from collections.abc import Sequence
from typing import Any


def start_interruptible(command: Sequence[str], **options: Any) -> "subprocess.Popen[str]":
    """Start a program that Ctrl-C ends, with its output and errors as text.

    A script ignores interrupts in what it runs in the background, and so in its tests. A program keeps what it was
    started with, as it should, but a handler of Python's own is not passed on: the program has the usual one.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
    finally:
        signal.signal(signal.SIGINT, before)
