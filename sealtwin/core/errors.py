"""Errors as one tree; each leaf has its exit code.

SealtwinError              faults that the user can mend: no traceback is shown
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
    """Fault that the user can mend; the message says where it is, what was found, what is allowed and what to do."""

    exit_code: ClassVar[int] = 1


class InputError(SealtwinError):
    """Input that cannot be used."""

    exit_code = 3


class BusyError(InputError):
    """Run folder that another process is using."""


class NumericalError(SealtwinError):
    """NaN, overflow or runaway density; the message names the quantity, the frame and the particle."""

    exit_code = 4


def as_text(path: Path) -> str:
    """Return a path as text for terminals, pages and JSON; bytes that are not UTF-8 become escapes."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let an OSError from within name ``path``.

    A full disk names no file, and a temporary file is not one of the user's; without a name a fault of the machine
    would pass for a bug.
    """
    try:
        yield
    except OSError as fault:
        fault.filename, fault.filename2 = str(path), None
        raise
