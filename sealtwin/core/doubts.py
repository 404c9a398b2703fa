"""Doubts about input that can be read but may not mean what it seems to, and how a sheet of it was understood."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any, ClassVar, Literal, NamedTuple

Reader = Literal["trial", "pairing", "python"]
"""Place in which the answer is written: a trial file or lab.toml, pairing.csv, or an argument of a function."""
CONFIRMS = "as_written"  # Setting that confirms what is in doubt
COLUMNS = "columns."  # Settings of [readings.columns]
UNKNOWN = "..."  # In place of a value that only the user knows


class Location(NamedTuple):
    """A file, and the part of it that is meant."""

    file: PurePath
    part: str = ""  # Worksheet, row or cell; empty for the whole file

    def named(self, file: str = "") -> str:
        """Return the location in words, with the reader's name of the file. Default: its path."""
        return ", ".join(filter(None, (file or f"{self.file}", self.part)))


@dataclass(frozen=True)
class Doubt:
    """Something that is open, or that may be a mistake. Without ``as_written`` among its answers it is a fault."""

    kind: str  # "unit", "sign slip", "remark", ...
    where: Location
    finding: str  # A sentence
    remedy: str = ""  # What to do to the file or in the settings, as a sentence without names of settings
    answers: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Settings of [readings] that settle it, each with a proposal, such as ``{"columns.range": "A1:D8"}``, or None if
    only the user knows. The entries of ``as_written`` are those that confirm it."""
    cells: tuple[str, ...] = ()  # Cells ("B7"), rows ("7") or columns ("B") concerned
    stops: bool = False  # True if it may change all that is read, such as another unit

    @property
    def can_be_confirmed(self) -> bool:
        return CONFIRMS in self.answers

    @property
    def is_open(self) -> bool:
        """True if it must be settled before anything is read: nothing confirms it, or it may change all readings."""
        return self.stops or not self.can_be_confirmed

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of pairing.csv in which the answers are written."""
        return tuple(_column(key) for key in self.answers)

    def in_words(self, reader: Reader = "trial", file: str = "") -> str:
        """Return the doubt and its answers in the words of the place where they are written.

        ``file`` is the reader's name of the file. Default: its path.
        """
        others = {key: value for key, value in self.answers.items() if key != CONFIRMS}
        sentences = [f"{self.where.named(file)}: {self.finding}", self.remedy]
        if others:
            sentences.append(f"Give {' and '.join(_setting(key, value, reader) for key, value in others.items())}.")
        if self.can_be_confirmed:
            sentences.append(f"If it is right as written, give {_setting(CONFIRMS, self.answers[CONFIRMS], reader)}.")
        return " ".join(filter(None, sentences))

    def __str__(self) -> str:
        return self.in_words()


@dataclass(frozen=True)
class QuantityMean:
    """Mean of a quantity that a sheet has beside its readings, such as the temperature."""

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    value: float
    """Mean over the stations that are read and have a value."""
    unit: str
    """Unit of the value; empty if the sheet has none."""
    stations: int
    """Number of these stations."""


@dataclass(frozen=True)
class ReadSheet:
    """A sheet as it was understood, for the eyes of whoever measured: roles of its columns, and its first rows."""

    roles: tuple[tuple[str, str], ...]  # Letter and role in words, such as ("A", "s in mm") or ("E", "not read")
    rows: tuple[tuple[int, tuple[str, ...]], ...]  # Number and texts of the first rows
    read: frozenset[tuple[int, int]]  # Cells that are read as places and readings: row from 1, column from 0
    header: frozenset[int] = frozenset()  # Rows of the header


def _column(key: str) -> str:
    return {"quantity": "sign"}.get(key, key.removeprefix(COLUMNS))


def _setting(key: str, value: Any, reader: Reader) -> str:
    if reader == "pairing":
        texts = value if isinstance(value, list | tuple) else [UNKNOWN if value is None else value]
        text = " ".join({"level": "up", "depth": "down"}.get(f"{each}", f"{each}") for each in texts)
        return f"{_column(key)} = {text}"
    if reader == "python":
        name, text = key.removeprefix(COLUMNS), UNKNOWN if value is None else repr(value)
        return f"columns={{{name!r}: {text}}}" if key.startswith(COLUMNS) else f"{name}={text}"
    return f"readings.{key} = {UNKNOWN if value is None else json.dumps(value, ensure_ascii=False)}"
