"""What is wrong with a sheet: all of it at once, each fault with its place and its remedy."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

from sealtwin.errors import InputError, as_text

MOST_KEPT = 1_000
MOST_SHOWN = 20
"""Sentences in a message; who has more mends a column, not cells."""
FIGURES = re.compile(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?")
"""Places and values within a sentence."""
MOST_ROWS_TOLD = 8
"""Of one mistake in many rows."""
LONGEST_SHOWN = 60
"""Letters of a cell that is quoted; more of it helps nobody to find it."""


@dataclass(frozen=True)
class Place:
    """Where in a sheet; what is None is the whole of it."""

    path: Path
    sheet: str | None = None
    """Of a workbook; None in a text file."""
    row: int | None = None
    """From 1, as editors and spreadsheets count."""
    column: int | None = None
    """From 0, as lists count."""
    name: str | None = None
    """The column's, as it stands in the header."""

    def __str__(self) -> str:
        file = as_text(self.path)
        name = None if self.name is None else shown(self.name)
        if self.sheet is None:
            parts = [file, self.row and f"line {self.row}", name and f"column {name}"]
        else:
            cell = None
            if self.column is not None and self.row is not None:
                cell = f"cell {letters(self.column)}{self.row}" + (f" ({name})" if name else "")
            elif self.row is not None:
                cell = f"row {self.row}"
            parts = [file, f"sheet {clipped(self.sheet)!r}", cell]
        return ", ".join(part for part in parts if part)


@dataclass(frozen=True)
class Fault:
    place: Place
    found: str
    """What stands there and what is allowed, a sentence or the end of one."""
    remedy: str
    value: str | None = None
    """The cell as it was written."""

    def __str__(self) -> str:
        return f"{self.place}: {self.found} {self.remedy}"

    @property
    def kind(self) -> object:
        """Equal for one mistake that was made in cell after cell of a column; of a fault without a cell its own."""
        if self.place.column is None or not self.value:
            return self.place, self.found, self.remedy
        what = self.found.replace(repr(clipped(self.value)), "")
        return replace(self.place, row=None), FIGURES.sub("", what), self.remedy


class SheetFaults(InputError):  # noqa: N818  It is all of a sheet's faults, not one error.
    """All that is wrong with one sheet. ``faults`` holds the first thousand; the text shows twenty and counts them."""

    def __init__(self, faults: "FaultList") -> None:
        self.faults = tuple(faults.kept)
        alike: dict[object, list[Fault]] = {}
        for fault in self.faults:
            alike.setdefault(fault.kind, []).append(fault)
        shown_ones = list(alike.values())[:MOST_SHOWN]
        lines = [_joined(group) for group in shown_ones]
        if more := faults.count - sum(map(len, shown_ones)):
            lines.append(f"{as_text(self.faults[0].place.path)}: {more:,} more faults like these.")
        super().__init__("\n".join(lines))


@dataclass
class FaultList:
    """Collects, within bounds."""

    kept: list[Fault] = field(default_factory=list)
    count: int = 0

    def add(self, place: Place, found: str, remedy: str, value: str | None = None) -> None:
        self.count += 1
        if len(self.kept) < MOST_KEPT:
            self.kept.append(Fault(place, found, remedy, value))

    def raise_if_any(self) -> None:
        """Raises SheetFaults."""
        if self.count:
            raise SheetFaults(self)


def _joined(alike: list[Fault]) -> str:
    """The first in words, the others by their rows."""
    first = alike[0].place.row
    rows = sorted({row for fault in alike if (row := fault.place.row) is not None and row != first})
    if not rows:
        return str(alike[0])
    if rows == list(range(rows[0], rows[-1] + 1)) and len(rows) > 1:
        told = f"{rows[0]} to {rows[-1]}"
    else:
        told = ", ".join(map(str, rows[:MOST_ROWS_TOLD])) + (" and others" if len(rows) > MOST_ROWS_TOLD else "")
    return f"{alike[0]} The same in {len(rows):,} more: row {told}."


def refuse(place: Place, found: str, remedy: str, value: str | None = None) -> SheetFaults:
    """The one fault after which nothing more can be read."""
    faults = FaultList()
    faults.add(place, found, remedy, value)
    return SheetFaults(faults)


def letters(column: int) -> str:
    """A spreadsheet's name of a column: 0 is A, 26 is AA."""
    name = ""
    column += 1
    while column:
        column, letter = divmod(column - 1, 26)
        name = chr(ord("A") + letter) + name
    return name


def clipped(text: str) -> str:
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 1] + "…"


def shown(text: str) -> str:
    """On one line and within bounds; what cannot be printed stands as an escape."""
    text = clipped(text)
    return text if text.isprintable() else repr(text)
