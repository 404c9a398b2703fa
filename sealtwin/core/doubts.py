"""Doubts about input that can be read but may be a mistake, and the interpretation of a sheet of readings."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any, Literal, NamedTuple

Reader = Literal["trial", "pairing", "python"]
"""Input in which the user answers a doubt: a trial file or lab.toml (trial), pairing.csv (pairing), or an argument of a
Python function (python)."""
CONFIRMS = "as_written"  # Setting with which the user confirms a doubtful value
COLUMNS = "columns."  # Prefix of the settings in [readings.columns]
UNKNOWN = "..."  # Text shown instead of a value that only the user can give


class Location(NamedTuple):
    """A file, or a part of a file."""

    file: PurePath
    part: str = ""  # Worksheet, row or cell. Empty for the whole file

    def named(self, file: str = "") -> str:
        """Return the location in words. ``file`` replaces the path of the file, if it is given."""
        return ", ".join(filter(None, (file or f"{self.file}", self.part)))


@dataclass(frozen=True)
class Doubt:
    """A question about the input, or a remark on it.

    If ``as_written`` is not among the answers, the user cannot confirm the input, so it must be corrected.
    """

    kind: str  # "unit", "sign slip", "remark", ...
    where: Location
    finding: str  # Sentence that says what is doubtful
    remedy: str = ""  # Sentence that says how to change the file or the settings, without names of settings
    answers: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Settings of [readings] that answer the doubt, each with a proposed value, such as ``{"columns.range": "A1:D8"}``.

    The value is None if only the user can give it. The value of ``as_written`` confirms the input."""
    cells: tuple[str, ...] = ()  # Cells ("B7"), rows ("7") or columns ("B") that are doubtful
    is_remark: bool = False
    """True if the doubt is only shown, and the sheet is read: a text or a mark beside the readings, or a reading that
    may be a slip. Any other doubt changes what all numbers mean, so it must be answered before the sheet is read."""

    @property
    def can_be_confirmed(self) -> bool:
        return CONFIRMS in self.answers

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of pairing.csv in which the user answers the doubt."""
        return tuple(_column(key) for key in self.answers)

    def in_words(self, reader: Reader = "trial", file: str = "") -> str:
        """Return the doubt and its possible answers as sentences, in the syntax that ``reader`` names.

        ``file`` replaces the path of the file, if it is given.
        """
        others = {key: value for key, value in self.answers.items() if key != CONFIRMS}
        sentences = [f"{self.where.named(file)}: {self.finding}", self.remedy]
        if others:
            sentences.append(f"Give {' and '.join(_setting(key, value, reader) for key, value in others.items())}.")
        if self.can_be_confirmed:
            sentences.append(f"If it is correct, give {_setting(CONFIRMS, self.answers[CONFIRMS], reader)}.")
        return " ".join(filter(None, sentences))

    def __str__(self) -> str:
        return self.in_words()


@dataclass(frozen=True)
class ReadSheet:
    """Interpretation of a sheet of readings, which the person who measured can check."""

    roles: tuple[tuple[str, str], ...]  # Letter and role of each column, such as ("A", "s in mm") or ("E", "not read")
    rows: tuple[tuple[int, tuple[str, ...]], ...]  # Row number and cell texts of each of the first rows
    read: frozenset[tuple[int, int]]  # Cells read as positions or readings: row from 1, column from 0
    header: frozenset[int] = frozenset()  # Numbers of the header rows


def _column(key: str) -> str:
    return {"quantity": "sign"}.get(key, key.removeprefix(COLUMNS))


def _setting(key: str, value: Any, reader: Reader) -> str:
    if reader == "pairing":
        texts = value if isinstance(value, list | tuple) else [UNKNOWN if value is None else value]
        text = " ".join({"level": "up", "depth": "down"}.get(f"{text}", f"{text}") for text in texts)
        return f"{_column(key)} = {text}"
    if reader == "python":
        name, text = key.removeprefix(COLUMNS), UNKNOWN if value is None else repr(value)
        return f"columns={{{name!r}: {text}}}" if key.startswith(COLUMNS) else f"{name}={text}"
    return f"readings.{key} = {UNKNOWN if value is None else json.dumps(value, ensure_ascii=False)}"
