"""What can go wrong, as one tree; each leaf knows its exit code.

SealtwinError              what the user can mend: no traceback is shown
├── InputError        3    a photo, a sheet, a mesh or a setting that cannot be used
├── NumericalError    4    the fluid run left the range in which its numbers mean anything
└── BusyError         3    another process holds the run folder

Anything else is a bug (exit code 1) and keeps its traceback.
"""

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
