"""A sheet's part of an XLSX: what its cells hold, and everything that makes a cell no plain number."""

import math
import re
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Literal

from validate.sheets.faults import clipped
from validate.sheets.grid import BLANK, MOST_COLUMNS, MOST_ROWS, Cell
from validate.sheets.workbook_archive import Handler, UnusableError

MOST_MERGED = 10_000
REFERENCE = re.compile(r"([A-Z]{1,3})([0-9]{1,7})")
LAST_DAY = 2_958_466
"""The first after 31 December 9999."""


@dataclass
class WorkbookSheet:
    """What a sheet holds; filled as its part is read."""

    name: str
    part: str
    hidden: bool
    rows: dict[int, dict[int, Cell]] = field(default_factory=dict)
    """By number from 1, cells by column from 0."""
    merged: list[tuple[int, int, int, int]] = field(default_factory=list)
    """As in ``Grid``."""
    hidden_rows: int = 0
    hidden_columns: int = 0


class Cells(Handler):
    """A sheet's part: its cells, what is merged or hidden."""

    def __init__(self, sheet: WorkbookSheet, strings: list[str], dates: list[bool], first_day: datetime) -> None:
        self._sheet, self._strings, self._dates, self._first_day = sheet, strings, dates, first_day
        self._row, self._column = 0, -1
        self._kind, self._style, self._has_formula = "n", "0", False
        self._pieces: list[str] = []
        self._inside: Literal["", "v", "t"] = ""
        self._spoken = False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "row":
            self._row = _number(values["r"]) if "r" in values else self._row + 1
            self._column = -1
            self._sheet.hidden_rows += values.get("hidden") in ("1", "true")
        elif name == "c":
            self._column = _address(values["r"])[1] if "r" in values else self._column + 1
            self._kind, self._style = values.get("t", "n"), values.get("s", "0")
            self._has_formula, self._pieces = False, []
        elif name == "f":
            self._has_formula = True
        elif name == "rPh":
            self._spoken = True
        elif name == "v" or (name == "t" and not self._spoken):
            self._inside = name
        elif name == "mergeCell":
            self._merge(values.get("ref", ""))
        elif name == "col" and values.get("hidden") in ("1", "true"):
            self._sheet.hidden_columns += _number(values.get("max", "")) - _number(values.get("min", "")) + 1

    def end(self, name: str) -> None:
        self._inside = ""
        if name == "rPh":
            self._spoken = False
        elif name == "c":
            cell = self._cell("".join(self._pieces))
            if cell != BLANK and (self._row in self._sheet.rows or len(self._sheet.rows) <= MOST_ROWS):
                # One too many of either is enough to refuse it.
                self._sheet.rows.setdefault(self._row, {})[min(self._column, MOST_COLUMNS)] = cell

    def text(self, piece: str) -> None:
        if self._inside:
            self._pieces.append(piece)

    def _cell(self, text: str) -> Cell:
        # A formula whose result is an empty text has t="str"; one without a stored result has nothing.
        if self._has_formula and not text and self._kind != "str":
            return Cell("", "formula")
        if self._kind == "s":
            return Cell(self._strings[_number(text, len(self._strings))]) if text else BLANK
        if self._kind in ("str", "inlineStr"):
            return Cell(text.strip())
        if self._kind == "e":
            return Cell(text.strip(), "error")
        if self._kind == "b":
            return Cell("TRUE" if text.strip() == "1" else "FALSE", "truth")
        if self._kind == "d":
            return Cell(text.strip(), "date")
        return self._numeric(text.strip()) if text.strip() else BLANK

    def _numeric(self, text: str) -> Cell:
        try:
            value = float(text)
        except ValueError:
            raise UnusableError(f"{clipped(text)!r} stands where a number is stored") from None
        if not math.isfinite(value):
            # No program stores such a number; whoever wrote it by hand is told the word.
            return Cell(text)
        style = _number(self._style)
        if style < len(self._dates) and self._dates[style] and 0 <= value < LAST_DAY:
            return Cell(f"{self._first_day + timedelta(days=value):%Y-%m-%d %H:%M}".removesuffix(" 00:00"), "date")
        return Cell(f"{value:.15g}", "number")

    def _merge(self, reference: str) -> None:
        if len(self._sheet.merged) == MOST_MERGED:
            raise UnusableError(f"more than {MOST_MERGED:,} merged cells")
        first, _, last = reference.partition(":")
        (row, column), (last_row, last_column) = _address(first), _address(last or first)
        self._sheet.merged.append((row, column, last_row, last_column))


def _address(reference: str) -> tuple[int, int]:
    """Row from 1 and column from 0 of an address such as "B12"."""
    found = REFERENCE.fullmatch(reference)
    if found is None:
        raise UnusableError(f"{clipped(reference)!r} is no cell's address")
    column = 0
    for letter in found[1]:
        column = 26 * column + ord(letter) - ord("A") + 1
    return int(found[2]), column - 1


def _number(text: str, below: int = 1 << 21) -> int:
    """A count or an index as a part writes it."""
    if not (text.isascii() and text.strip().isdigit() and len(text) < 9) or int(text) >= below:
        raise UnusableError(f"{clipped(text)!r} stands where a number up to {below - 1} is due")
    return int(text)
