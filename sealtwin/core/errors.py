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
from typing import ClassVar, Literal, TypeVar

Kind = TypeVar("Kind")


class SealtwinError(Exception):
    """Fault that the user can mend; the message says where it is, what was found, what is allowed and what to do."""

    exit_code: ClassVar[int] = 1


class InputError(SealtwinError):
    """Input that cannot be used."""

    exit_code = 3


ShapeKind = Literal[
    "outline", "face", "sides", "size", "mouth", "through", "rivals", "walls", "narrow", "path", "cut", ""
]
"""Part of a sample that is at fault: the crack's outline; the plane face, the upright sides, the size of the block; the
mouth that is not there, leads through the underside or is there twice; walls that do not face each other or are too
close; a given path off the crack; a body that cannot be cut."""


class ShapeError(InputError):
    """Shape that is no sample with one crack.

    What is wrong is the stage's to say. What to do about it is the command's, which may have given the stage a shape
    that its user has never seen: ``kind`` is for its own remedy in place of ``remedy``.
    """

    def __init__(self, wrong: str, remedy: str = "", kind: ShapeKind = "", file: Path | None = None) -> None:
        super().__init__(f"{'' if file is None else f'{file}: '}{wrong} {remedy}".rstrip())
        self.wrong, self.remedy = wrong, remedy
        self.kind: ShapeKind = kind


class BusyError(InputError):
    """Run folder that another process is using."""


class NumericalError(SealtwinError):
    """NaN, overflow or runaway density; the message names the quantity, the frame and the particle."""

    exit_code = 4


def present(value: Kind | None, name: str) -> Kind:
    """Return a value that an earlier check has made sure of. Raises ValueError, which is a bug, if it is None."""
    if value is None:
        raise ValueError(f"{name} is missing")
    return value


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
