"""The rows of the tables of wrong inputs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

REFUSED = 3


@dataclass(frozen=True)
class WrongInput:
    """A wrong input, its command, and the words that the answer must have.

    Exit code 0 is that of an input with a result: ``names`` are then words of the warning.
    """

    name: str
    make: Callable[[Path], object]
    """Writes the input into an empty folder."""
    command: str
    """Words after ``sealtwin``; {given} is the folder of the input, {out} a folder that is not there yet."""
    names: tuple[str, ...]
    """Keys, files and values that the command must print; not its prose."""
    code: int = REFUSED
    lacks: tuple[str, ...] = ()
    """Words of another stage, or of a wrong remedy, that the answer must not have."""


def answers(command: str) -> Callable[..., WrongInput]:
    """Return a maker of rows of one command: what is wrong, its writer, and what the answer names.

    ``more`` are further words of the command; tables of such rows are laid out by hand.
    """

    def row(name: str, make: Callable[[Path], object], *names: str, more: str = "", **others: Any) -> WrongInput:
        return WrongInput(name, make, command + more, names, **others)

    return row
