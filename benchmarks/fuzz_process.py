"""A command in a process of its own, a copy of this one: its exit code, what it prints, its time and its memory."""

import faulthandler
import importlib
import os
import pkgutil
import signal
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from types import FrameType
from typing import NoReturn, TextIO

from typer.testing import CliRunner

import digitise
import sealtwin
import simulate
import validate
from sealtwin.cli.app import app

LONGEST_S = 60  # Of processor time, which other work on the machine does not move
HANGS_S = 4 * LONGEST_S  # Of the clock


def in_a_process(arguments: list[str], folder: Path) -> tuple[int, str, float]:
    """Call a command in a copy of this process; return exit code, output or traceback, and peak of memory in GB.

    The exit code is SIGALRM after ``LONGEST_S`` or ``HANGS_S``, and minus the signal that ended the process. The memory
    is resident, of the copy with all that it inherits, or of a process that it started if that is larger. Linux only,
    where wait4 counts in KiB.
    """
    with TemporaryFile("w+", encoding="utf-8", errors="backslashreplace") as output:
        with warnings.catch_warnings():
            # Python 3.12 warns of the threads of OpenBLAS, which starts them anew in the copy.
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if child == 0:
            _end_as(arguments, folder, output)
        try:
            with no_longer_than(HANGS_S):
                _, status, usage = os.wait4(child, 0)
            over = usage.ru_utime + usage.ru_stime > LONGEST_S
            exit_code = int(signal.SIGALRM) if over else os.waitstatus_to_exitcode(status)
        except TimeoutError:
            os.killpg(child, signal.SIGKILL)
            _, _, usage = os.wait4(child, 0)
            exit_code = int(signal.SIGALRM)
        with suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)  # What it started and left
        output.seek(0)
        return exit_code, output.read(), usage.ru_maxrss * 1024 / 1e9


def _end_as(arguments: list[str], folder: Path, output: TextIO) -> NoReturn:
    """End this process as the command ends, with 1 for any exception, and write what it printed, or its traceback."""
    exit_code = 1
    faulthandler.disable()  # An abort is one of the cases; pytest would print the stack of each thread.
    try:
        os.setsid()
        os.chdir(folder)
        answer = CliRunner().invoke(app, arguments)
        if answer.exception is None or isinstance(answer.exception, SystemExit):
            exit_code = answer.exit_code
            output.write(answer.output)
        else:
            output.write("".join(traceback.format_exception(answer.exception)))
        output.flush()
    finally:
        os._exit(exit_code)


@contextmanager
def no_longer_than(limit_s: int) -> Iterator[None]:
    def ring(_: int, __: FrameType | None) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, ring)
    signal.alarm(limit_s)
    try:
        yield
    finally:
        signal.alarm(0)


def import_all() -> None:
    """Import the modules of all stages, and what they import when they need it, so that no case has to."""
    for package in (sealtwin, digitise, simulate, validate):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            importlib.import_module(module.name)
    for name in ("matplotlib.backends.backend_agg", "rich.console", "rich.markdown", "tomlkit", "trimesh"):
        importlib.import_module(name)
