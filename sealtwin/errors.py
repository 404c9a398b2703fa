"""What can go wrong, as one tree; each leaf knows its exit code.

SealtwinError              what the user can mend: no traceback is shown
├── InputError        3    a photo, a sheet, a mesh or a setting that cannot be used
├── NumericalError    4    the fluid run left the range in which its numbers mean anything
└── BusyError         3    another process holds the run folder

Anything else is a bug (exit code 1) and keeps its traceback.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar


class SealtwinError(Exception):
    """A fault that the message lets the user mend: where, what was found, what is allowed, what to do."""

    exit_code: ClassVar[int] = 1


class InputError(SealtwinError):
    """An input that cannot be used."""

    exit_code = 3


class BusyError(InputError):
    """The run folder is in use by another process."""


class NumericalError(SealtwinError):
    """NaN, overflow or runaway density: says what, in which frame, and which particle."""

    exit_code = 4


def as_text(path: Path) -> str:
    """A path as every terminal, page and JSON takes it: bytes of it that are not UTF-8 stand as escapes."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let an OSError from within name ``path``: a full disk names no file, and a temporary file is none of the user's.

    Without a name a fault of the machine would pass for a bug of ours.
    """
    try:
        yield
    except OSError as fault:
        fault.filename, fault.filename2 = str(path), None
        raise
