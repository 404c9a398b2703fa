"""Commands that a test calls, and programs that it starts and ends."""

import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from typer.main import get_command
from typer.testing import CliRunner, Result

from sealtwin.cli.app import app


def commands() -> dict[str, Any]:
    """Every command of the command line by its name, as in "material spread"."""
    groups: Any = get_command(app)
    return {
        f"{name} {inner}".strip(): command
        for name, group in groups.commands.items()
        for inner, command in getattr(group, "commands", {"": group}).items()
    }


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


def sealtwin(*arguments: object) -> Result:
    """Call the command in this process: another one imports for seconds."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refusal(*arguments: object) -> str:
    """Errors of a command that must end with exit code 3, with a sentence and no traceback."""
    answer = sealtwin(*arguments)
    assert answer.exit_code == 3, answer.output
    assert any(line.startswith("sealtwin: ") for line in answer.stderr.splitlines())
    assert "Traceback" not in answer.output
    return answer.stderr.rstrip()
