"""The worksheets of a workbook, and the choice of the one with the readings."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import as_text
from validate.readings.grid import BLANK, Cell, Grid, Mark, listed, quoted, refused
from validate.readings.numbers import number

MOST_TEXTS = 200  # Rows of another worksheet whose texts are quoted
FORMULA = Cell("", "formula")


class Entry(NamedTuple):
    """A cell that is not blank, as the file has it."""

    cell: Cell
    formula: bool = False  # Whether a formula gives its content
    struck: bool = False
    colours: str = ""


class Worksheet:
    def __init__(self, name: str, hidden: bool) -> None:
        self.name, self.hidden = name, hidden
        self.rows: dict[int, dict[int, Entry]] = {}  # By row number from 1, then by column from 0
        self.comments: list[Mark] = []
        self.hidden_rows: set[int] = set()
        self.hidden_columns: set[int] = set()
        self.on_page: list[tuple[str, str]] = []  # Page headers and footers

    def drop_zeros(self, *, never_calculated: bool = False) -> None:
        """Treat the results of formulas as never calculated if the program that wrote the file stored zeros for them.

        That is assumed if the file states it (``never_calculated``), or if there are several formulas and all results
        are 0.
        """
        cells = ((entries, column) for entries in self.rows.values() for column in entries)
        results = [(entries, column) for entries, column in cells if entries[column].formula]
        zeros = [(entries, column) for entries, column in results if entries[column].cell.text in ("0", "-0")]
        if never_calculated or 1 < len(zeros) == len(results):
            for entries, column in zeros:
                entries[column] = Entry(FORMULA)

    def has_table(self) -> bool:
        """Return whether at least two rows have two numbers."""
        rows = ([entry.cell for entry in entries.values()] for entries in self.rows.values())
        counts = [sum(cell == FORMULA or number(cell.text) is not None for cell in cells) for cells in rows]
        return sum(count > 1 for count in counts) > 1

    def marks(self) -> Iterator[Mark]:
        yield from self.comments
        for row, entries in self.rows.items():
            for column, entry in entries.items():
                if entry.struck:
                    yield Mark(row, column, "struck")
                if entry.colours:
                    yield Mark(row, column, "coloured", entry.colours)
                if row in self.hidden_rows or column in self.hidden_columns:
                    yield Mark(row, column, "hidden")

    def texts(self) -> Iterator[tuple[str, str]]:
        """Yield the texts of the sheet with their places; those of a row are one."""
        sheet, texts = f"sheet {quoted(self.name)}", [*self.on_page]
        texts += [(f"comment in row {row}", text) for row, _, _, text in self.comments]
        for row, entries in self.rows.items():
            if words := [cell.text for cell, *_ in entries.values() if cell.kind == "text"]:
                texts.append((f"row {row}", " ".join(words)))
        yield from ((f"{sheet}, {place}", text) for place, text in texts[:MOST_TEXTS])
        if texts[MOST_TEXTS:]:
            yield sheet, f"{len(texts)} texts in all"


def chosen_grid(path: Path, program: str, sheets: Sequence[Worksheet], wanted: str | None) -> Grid:
    """Return the sheet ``wanted``, or the only visible one with a table; else ask for it."""
    filled = [sheet for sheet in sheets if sheet.rows]
    if not filled:
        finding = "has no rows of readings: all its sheets are empty, or saved as Strict Open XML."
        raise refused(path, finding, "Save it with its cells as an ordinary XLSX.")
    tables = [sheet for sheet in filled if sheet.has_table()] or filled
    chosen = [sheet for sheet in tables if not sheet.hidden]
    named, finding = chosen or tables, f"{'several' if chosen else 'only hidden'} sheets may have the readings:"
    if wanted is not None:
        chosen = [sheet for sheet in sheets if sheet.name == wanted]
        named, finding = sheets, f"has no sheet {quoted(wanted)}, only"
    doubts: tuple[Doubt, ...] = ()
    if len(chosen) != 1:
        finding += f" {listed([quoted(sheet.name) for sheet in named])}."
        doubts = (Doubt("sheet", as_text(path), finding, answers={"sheet": None}),)
    # The first one stands in, so that what else is open is asked at the same time.
    sheet = (chosen or named)[0]
    rows = {
        row: tuple(entries[column].cell if column in entries else BLANK for column in range(max(entries) + 1))
        for row, entries in sorted(sheet.rows.items())
    }
    # Sheets that may have the readings of another sample are no remarks on this one.
    others = [other for other in sheets if other is not sheet and (other.hidden or other not in tables)]
    return Grid(
        path,
        rows,
        (program, f"sheet {quoted(sheet.name)}"),
        sheet=sheet.name,
        marks=tuple(sorted(sheet.marks())),
        elsewhere=(*sheet.on_page, *(text for other in others for text in other.texts())),
        doubts=doubts,
    )
