"""Errors form one tree. Each leaf has an exit code.

SealtwinError              a fault that the user can correct: shown without a traceback
├── InputError        3    a photo, a sheet, a mesh or a setting that cannot be used
├── NumericalError    4    the fluid run diverged, or is not physical
└── BusyError         3    another process has locked the run folder

Anything else is a bug: exit code 1, with its traceback.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar, Literal, TypeVar

Kind = TypeVar("Kind")


class SealtwinError(Exception):
    """Fault that the user can correct. Its message has the place, the value, what is allowed and what to do."""

    exit_code: ClassVar[int] = 1


class InputError(SealtwinError):
    """Input that cannot be used. ``fault`` is the message without the name of the ``file``."""

    exit_code = 3

    def __init__(self, fault: str, file: Path | None = None) -> None:
        super().__init__(fault if file is None else f"{file}: {fault}")
        self.fault = fault
        self.sentences: Sequence[str] = (str(self),)  # Each fault, if there are several


ShapeKind = Literal[
    "outline", "face", "sides", "size", "mouth", "through", "rivals", "walls", "narrow", "path", "cut", "closed", ""
]
"""Part of a sample that is at fault: the crack's outline; the plane face, the upright sides or the size of the block; a
mouth that is missing, leads through the underside or exists twice; walls that do not face each other or are too close;
a given path that is not on the crack; a body that cannot be cut; a mesh that is not a solid."""


class ShapeError(InputError):
    """Shape that is not a sample with one crack.

    The stage describes the fault. A command that made the shape may replace ``remedy`` by its own for the ``kind`` of
    fault, because its user did not draw the shape.
    """

    def __init__(self, wrong: str, remedy: str = "", kind: ShapeKind = "", file: Path | None = None) -> None:
        super().__init__(f"{wrong} {remedy}".rstrip(), file)
        self.wrong, self.remedy = wrong, remedy
        self.kind: ShapeKind = kind


class BusyError(InputError):
    """Run folder that another process has locked."""


class NumericalError(SealtwinError):
    """NaN, overflow or runaway density in a fluid run. The message names the quantity, the frame and the particle."""

    exit_code = 4


def present(value: Kind | None, name: str) -> Kind:
    """Return a value that an earlier check guarantees to exist. Raises ValueError if it is None, which is a bug."""
    if value is None:
        raise ValueError(f"{name} is missing")
    return value


def as_text(path: Path) -> str:
    """Return a path as text for terminals, pages and JSON. Bytes that are not UTF-8 become escapes."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put ``path`` into an OSError that the block raises.

    The error of a full disk names no file, and other errors name a temporary file. Without a file's name, a fault of
    the machine would be reported as a bug.
    """
    try:
        yield
    except OSError as fault:
        fault.filename, fault.filename2 = str(path), None
        raise
