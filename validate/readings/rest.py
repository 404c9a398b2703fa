"""Everything in a file of readings besides header, places and readings: harmless, or quoted in one question."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from sealtwin.core.doubts import CONFIRMS
from validate.readings.beside import changes, is_harmless
from validate.readings.grid import Grid, Mark, letters, listed, quoted, shown
from validate.readings.header import numeric, roles_in
from validate.readings.names import is_note, sample_key
from validate.readings.numbers import is_missing
from validate.readings.rows import ReadRows
from validate.readings.table import Table

MOST_QUOTED, LONGEST_QUOTED = 60, 400  # Texts of a sheet, and letters of each
MOST_CELLS = 3  # Quoted cells of a column below the header from which on the column is named instead
REMEDY = "If it does, write what it says into other answers (unit, direction, datum, end of s, skip); then confirm it."
NAMES = "names"  # Entry of as_written for the names of file and worksheet
MARKS = {"struck": "struck through", "hidden": "hidden", "coloured": "coloured unlike the others"}
CODE = re.compile(r"[^\W\d_]{1,3}[ _-]?[0-9]+\w?")
LABEL = re.compile(r"(?:[^\W\d]*[\W_]*)?[0-9]+|\w")  # Number of a repeat with its word, or a letter


class Text(NamedTuple):
    """A text beside the readings."""

    answer: str  # Entry of as_written that confirms it
    text: str
    beside: str = ""  # Place and readings of its row
    place: str = ""  # Default: that of the answer


def ask_about_rest(table: Table, rows: ReadRows) -> None:
    """Ask once about the texts that may change the readings, and once about each kind of marks of cells that are read.

    The name of the sample is harmless.
    """
    sample = table.declared.sample or table.grid.path.stem
    texts = [text for text in _texts(table, rows, sample) if not is_harmless(text.text, sample)]
    texts += _names(table.grid, table.declared.sample)
    columns = [text.answer.rstrip("0123456789") if text.beside else "" for text in texts]
    many = {column for column, count in Counter(columns).items() if column and count > MOST_CELLS}
    if texts:
        entries = [column if column in many else text.answer for text, column in zip(texts, columns, strict=True)]
        alike = dict[str, list[str]]()
        for text in texts:
            quote = f"{text.place or text.answer} {quoted(text.text, LONGEST_QUOTED)}{text.beside}"
            alike.setdefault(text.text, []).append(quote)
        # Each text is shown; of equal ones the first.
        quotes = [*map(listed, alike.values())]
        confirms, finding = [*dict.fromkeys(entries)], f"does this change the readings? {listed(quotes, MOST_QUOTED)}."
        stops = any(changes(text.text) for text in texts if text.answer != NAMES)
        table.ask("remark", finding, REMEDY, {CONFIRMS: confirms}, confirms, stops=stops)
    _ask_about_marks(table, rows)


def _texts(table: Table, rows: ReadRows, sample: str) -> Iterator[Text]:
    """Yield the texts of the sheet outside of its header and readings, comments, and texts elsewhere in the file."""
    grid = table.grid
    numbers = {column for row in table.body for column, cell in enumerate(grid.rows[row]) if numeric(cell)}
    samples = {column for column, role in table.others.items() if role == "sample"}
    for row, cells in grid.rows.items():
        filled = [(column, cell) for column, cell in enumerate(cells) if cell.text]
        if row in rows.read or row in table.header.rows:
            beside = _beside(table, row) if row in rows.read else ""
            for column, cell in filled:
                if _may_change(table, row, column, numbers, sample):
                    yield Text(f"{letters(column)}{row}", cell.text, beside)
        elif row not in rows.passed and not {"station", "reading"} <= roles_in(cell.text for cell in cells):
            # The name of a sample beside numbers is that of another one.
            words = {column for column, cell in filled if not numeric(cell)}
            words -= samples if len(words) < len(filled) else set()
            if words or (filled and table.span.top <= row < table.header.first):
                yield Text(f"{letters(filled[0][0])}{row}", " ".join(cell.text for _, cell in filled))
    for row, column, kind, text in grid.marks:
        if kind == "comment":
            name = f"{letters(column)}{row}"
            yield Text(name, text, place=f"comment in {name}")
    for place, text in grid.elsewhere:
        yield Text("worksheets", text, place=place)


def _may_change(table: Table, row: int, column: int, numbers: set[int], sample: str) -> bool:
    """Return whether a text in the header, or beside readings, is neither a known name nor a word for nothing."""
    cell, name = table.grid.cell(row, column), table.header.names.get(column, "")
    is_used = any(column == each.index for each in table.used)
    if row in table.header.rows:
        # A column of numbers under an unknown name is asked about.
        return not (is_used or column in table.others or column in numbers)
    if is_used:
        # The number of a repeat is no reading, and no word.
        return table.repeat is not None and column == table.repeat.index and LABEL.fullmatch(cell.text) is None
    if is_missing(cell.text) or (numeric(cell) and not is_note(name)):
        return False
    return column not in table.others or not is_harmless(f"{name}: {cell.text}", sample)


def _beside(table: Table, row: int) -> str:
    """Return the place and the readings of a row in words."""
    texts = [table.grid.cell(row, column.index).text for column in table.used if column is not table.repeat]
    return f" beside {' '.join(map(shown, texts[:5]))}"


def _names(grid: Grid, sample: str | None) -> Iterator[Text]:
    """Yield the names of the worksheet and of the file, without that of the sample."""
    stem = grid.path.stem.replace(sample, " ") if sample else grid.path.stem
    for what, name in (("name of the worksheet", grid.sheet or ""), ("name of the file", stem)):
        # "P02" in the file of P01 is another sample.
        is_other = sample and CODE.fullmatch(name) and sample_key(name) != sample_key(sample)
        if is_other or (len(name.strip()) > 1 and changes(name)):
            yield Text(NAMES, name, place=what)


def _ask_about_marks(table: Table, rows: ReadRows) -> None:
    """Ask about readings that are struck through, hidden, or coloured unlike the others of their column."""
    used = {column.index for column in table.used}
    read = [mark for mark in table.grid.marks if mark.row in rows.read and mark.column in used]
    read = [mark for mark in read if f"{letters(mark.column)}{mark.row}" not in table.chosen.skip]
    for kind, words in MARKS.items():
        marks = [mark for mark in read if mark.kind == kind]
        marks = _unlike(marks, len(rows.read), used) if kind == "coloured" else marks
        if not marks:
            continue
        columns = {mark.column for mark in marks}
        if kind == "hidden" and all(sum(mark.column == k for mark in marks) == len(rows.read) for k in columns):
            answers = [letters(column) for column in sorted(columns)]
        else:
            answers = [f"{mark.row}" if kind == "hidden" else f"{letters(mark.column)}{mark.row}" for mark in marks]
            answers = [*dict.fromkeys(answers)]
        finding = f"{words}, but read: {listed(answers)}."
        table.ask(kind, finding, "Skip rows or cells that do not count.", {CONFIRMS: answers}, answers)


def _unlike(marks: Sequence[Mark], count: int, used: set[int]) -> list[Mark]:
    """Return the marks of colours that most cells of their column do not have."""
    unlike = list[Mark]()
    for column in used:
        here = [mark for mark in marks if mark.column == column]
        colours = Counter(mark.text for mark in here)
        colours[""] += count - len(here)
        usual = colours.most_common(1)[0][0]
        unlike += [mark for mark in here if mark.text != usual]
    return unlike
