"""Everything in a file of readings besides header, places and readings: harmless, or quoted in one question."""

import re
from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

from sealtwin.core.doubts import CONFIRMS
from validate.readings.beside import changes, is_harmless
from validate.readings.grid import Grid, letters, listed, quoted, shown
from validate.readings.rows import ReadRows
from validate.readings.table import Table, numeric, roles_in
from validate.readings.words import Role, is_missing, is_note, sample_key

MOST_QUOTED, LONGEST_QUOTED = 60, 400  # Texts of a sheet, and letters of each
REMEDY = "If it does, write what it says into other answers (unit, direction, datum, end of s, skip); then confirm it."
NAMES, RANGE = "names", "range"
"""Entries of as_written for the names of file and worksheet, and for all texts outside of the range."""
MARKS: dict[str, tuple[str, Callable[[Grid, int, int], bool | str]]] = {
    "struck": ("struck through", lambda grid, row, column: grid.cell(row, column).is_struck),
    "hidden": ("hidden", lambda grid, row, column: row in grid.hidden_rows or column in grid.hidden_columns),
    "coloured": ("coloured unlike the others", lambda grid, row, column: grid.cell(row, column).colours),
}
"""Marks of cells by kind: in words, and the function that returns the mark of a cell."""
CODE = re.compile(r"[^\W\d_]{1,3}[ _-]?[0-9]+\w?")
LABEL = re.compile(r"(?:[^\W\d]*[\W_]*)?[0-9]+|\w")  # Number of a repeat with its word, or a letter


class Text(NamedTuple):
    """A text beside the readings."""

    answer: str  # Entry of as_written that confirms it
    text: str
    where: str
    beside: str = ""  # Place and readings of its row


def ask_about_rest(table: Table, rows: ReadRows) -> None:
    """Ask once about the texts that may change the readings, and once about each kind of marks of cells that are read.

    The name of the sample is harmless.
    """
    sample = table.declared.sample or table.grid.path.stem
    texts = [text for text in _texts(table, rows, sample) if not is_harmless(text.text, sample)]
    texts += _names(table.grid, table.declared.sample)
    texts = [text for text in texts if not table.confirms(text.answer)]
    if texts:
        alike = dict[str, list[str]]()
        for text in sorted(texts, key=lambda text: not changes(text.text)):
            quote = f"{text.where} {quoted(text.text, LONGEST_QUOTED)}{text.beside}"
            alike.setdefault(text.text, []).append(quote)
        # Each text is shown, those with a word that may change readings first; of equal ones the first.
        confirms = sorted({text.answer for text in texts})
        finding = f"does this change the readings? {listed([*map(listed, alike.values())], MOST_QUOTED)}."
        stops = any(changes(text.text) for text in texts if text.answer != NAMES)
        table.ask("remark", finding, REMEDY, {CONFIRMS: confirms}, confirms, stops=stops)
    _ask_about_marks(table, rows)


def _texts(table: Table, rows: ReadRows, sample: str) -> Iterator[Text]:
    """Yield the texts of the sheet outside of its header and readings, comments, and texts elsewhere in the file."""
    grid, (columns_inside, rows_inside) = table.grid, table.span

    def text_of(row: int, column: int, text: str, beside: str = "", what: str = "") -> Text:
        is_inside = column in columns_inside and (row in rows_inside or row in table.header.rows)
        cell = f"{letters(column)}{row}"
        return Text(cell if is_inside or not table.confirms(RANGE) else RANGE, text, what + cell, beside)

    numbers = {column for row in table.body for column, cell in grid.rows[row].items() if numeric(cell)}
    samples = {k for k, column in table.others.items() if column.role is Role.SAMPLE}
    labels = {column for column in table.header.names if _has_labels(table, rows, column)}
    for row, cells in grid.rows.items():
        filled = [(column, cell) for column, cell in cells.items() if cell.text]
        if row in rows.read or row in table.header.rows:
            texts = [table.cell(row, column).text for column in table.used if column is not table.repeat]
            beside = f" beside {' '.join(map(shown, texts))}" if row in rows.read else ""
            for column, cell in filled:
                if column not in labels and _may_change(table, row, column, numbers, sample):
                    yield text_of(row, column, cell.text, beside)
        elif row not in rows.passed and not {Role.STATION, Role.READING} <= roles_in(cells.values()):
            # The name of a sample beside numbers is that of another one.
            words = {column for column, cell in filled if not numeric(cell)}
            words -= samples if len(words) < len(filled) else set()
            if words or (filled and rows_inside.start <= row < table.header.first):
                yield text_of(row, filled[0][0], " ".join(cell.text for _, cell in filled))
    for row, column, text in grid.comments:
        yield text_of(row, column, text, what="comment in ")
    for where, text in grid.elsewhere:
        yield Text("worksheets", text, where)


def _has_labels(table: Table, rows: ReadRows, column: int) -> bool:
    """Return whether the texts of a column name the stations: P1, P2, P3."""
    labels = {table.grid.cell(row, column).text for row in rows.read} - {""}
    return len(labels) == len(rows.cells.s_mm) and all(map(CODE.fullmatch, labels))


def _may_change(table: Table, row: int, column: int, numbers: set[int], sample: str) -> bool:
    """Return whether a text in the header, or beside readings, is neither a known name nor a word for nothing."""
    cell, name = table.grid.cell(row, column), table.header.names.get(column, "")
    is_used = any(column == each.index for each in table.used)
    if row in table.header.rows:
        # A column of numbers under an unknown name is asked about, but not a title above it.
        is_title = row < table.header.rows[-1] and table.is_open("columns", "range")
        return is_title or not (is_used or column in table.others or column in numbers)
    if is_used:
        # The number of a repeat is no reading, and no word.
        return table.repeat is not None and column == table.repeat.index and LABEL.fullmatch(cell.text) is None
    if is_missing(cell.text) or (numeric(cell) and not is_note(name)):
        return False
    return column not in table.others or not is_harmless(f"{name}: {cell.text}", sample)


def _names(grid: Grid, sample: str | None) -> Iterator[Text]:
    """Yield the names of the worksheet and of the file, without that of the sample."""
    stem = grid.path.stem.replace(sample, " ") if sample else grid.path.stem
    for what, name in (("name of the worksheet", grid.sheet or ""), ("name of the file", stem)):
        # "P02" in the file of P01 is another sample.
        is_other = sample and CODE.fullmatch(name) and sample_key(name) != sample_key(sample)
        if is_other or (len(name.strip()) > 1 and changes(name)):
            yield Text(NAMES, name, what)


def _ask_about_marks(table: Table, rows: ReadRows) -> None:
    """Ask about readings that are struck through, hidden, or coloured unlike most of their column."""
    for kind, (words, mark_of) in MARKS.items():
        answers = list[str]()
        for column in table.used:
            cells = {row: f"{column.letters}{row}" for row in sorted(rows.read)}
            marks = {
                cell: mark_of(table.grid, row, column.index)
                for row, cell in cells.items()
                if cell not in table.chosen.skip
            }
            usual = Counter(marks.values()).most_common(1)[0][0] if kind == "coloured" and marks else False
            unlike = [cell for cell, mark in marks.items() if mark != usual]
            answers += [column.letters] if kind == "hidden" and len(unlike) == len(rows.read) > 0 else unlike
        if answers:
            finding = f"{words}, but read: {listed(answers)}."
            table.ask(kind, finding, "Skip rows or cells that do not count.", {CONFIRMS: answers}, answers)
