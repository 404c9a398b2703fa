"""Error classes and their exit codes.

SealtwinError              a fault that the user can correct: shown without a traceback
├── InputError        3    a photo, a sheet, a mesh or a setting that cannot be used
├── NumericalError    4    the fluid run diverged, or is not physical
└── BusyError         3    another process has locked the run folder

All other exceptions are bugs. They have exit code 1, and their traceback is shown.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar, TypeVar

Kind = TypeVar("Kind")


class SealtwinError(Exception):
    """Fault that the user can correct. The message states the location, the value, what is allowed and what to do."""

    exit_code: ClassVar[int] = 1


class InputError(SealtwinError):
    """Input that cannot be used. ``fault`` is the message without the name of ``file``."""

    exit_code = 3

    def __init__(self, fault: str, file: Path | None = None) -> None:
        super().__init__(fault if file is None else f"{file}: {fault}")
        self.fault = fault
        self.sentences: Sequence[str] = (str(self),)  # One message for each fault


class ShapeError(InputError):
    """Shape that is not a sample with one crack. ``remedy`` is for a user who made the mesh."""

    def __init__(self, wrong: str, remedy: str = "", file: Path | None = None) -> None:
        super().__init__(f"{wrong} {remedy}".rstrip(), file)
        self.wrong, self.remedy = wrong, remedy


class BusyError(InputError):
    """Run folder that another process has locked."""


class NumericalError(SealtwinError):
    """NaN, overflow or runaway density in a fluid run. The message names the quantity, the frame and the particle."""

    exit_code = 4


def present(value: Kind | None, name: str) -> Kind:
    """Return ``value``, which an earlier check has ensured is not None. Raises ValueError if it is None (a bug)."""
    if value is None:
        raise ValueError(f"{name} is missing")
    return value


def as_text(path: Path) -> str:
    """Return a path as text for terminals, pages and JSON. Bytes that are not UTF-8 become escape sequences."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put ``path`` into an OSError that the block raises.

    The error of a full disk names no file, and other errors name a temporary file. An OSError without the name of a
    file would be reported as a bug.
    """
    try:
        yield
    except OSError as fault:
        fault.filename, fault.filename2 = str(path), None
        raise
