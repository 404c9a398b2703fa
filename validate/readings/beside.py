"""Texts next to the numbers of a sheet: they are either plainly harmless, or each is quoted as a remark.

Plainly harmless is the name of the sample, a date, and a label with a name or number behind it, such as
"Operator: J. Smith". Any other words are a remark. Marks of cells, such as a strike, are remarks too. Names of columns
that may change readings, and merged cells, lead to questions. The words are in ``words.toml``.
"""

import re
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from sealtwin.core.doubts import CONFIRMS
from validate.readings.grid import Grid, letters, listed, quoted
from validate.readings.rows import ReadRows
from validate.readings.table import Table, numeric, roles_in
from validate.readings.words import (
    COLUMNS,
    INCH,
    SAMPLE,
    STOPS,
    UNITS,
    WORD,
    WORDS,
    Role,
    is_missing,
    is_note,
    may_change,
    plain_letters,
    sample_key,
    unit_of,
)

DATE = re.compile(r"\d{1,4}[-./]\d\d?[-./](?:\d{2,4})?|\d\d?:\d\d(?::\d\d)?")
VALUES = {
    "person": r"[^\W\d]+(?:[.'\u2019-][^\W\d]*)*",
    "item": r"[^\W_]*_[\w.]+|\d+(?:[-/]\d+)*",
    "climate": r"-?\d+(?:[.,]\d+)?%?|\u00b0?[CF]|%",
    "other": "(?!)",
}
"""Values that are harmless behind a label of each kind, besides a date."""
LABELS = dict.fromkeys(SAMPLE | COLUMNS["notes"], "other")
LABELS |= {word: kind for kind in VALUES for word in WORDS["beside"][kind].split()}
NOTHING = {*WORDS["beside"]["nothing"].split()}
MAX_NAMES = 3  # Largest number of names behind a label
SIGN = re.compile(
    # A sign, a factor, a tenth, or a letter of another script, unless it begins the usual name of a worksheet
    r"[+=\u00b1\u00d7?*\u2190-\u21ff]|\bx\s?\d|\d\s?x\b|\b1/\d|(?<![\u0370-\uffff])"
    r"(?!(?:\u043b\u0438\u0441\u0442|\u5de5\u4f5c\u8868|\u30b7\u30fc\u30c8|\uc2dc\ud2b8)\d)"
    r"[\u0370-\u1fff\u3040-\uffff]"
)
LONGEST_QUOTED = 400  # Largest number of characters of a remark that are quoted
MAX_COLOURED = 0.2  # Largest fraction of the rows whose colour is a mark of these rows, and not the sheet's design
ANOTHER = re.compile(r"(?!(?i:ark))[A-Za-z]{1,3}[ _-]?[0-9]+\w?")
"""Possible name of another sample. Ark1 is the usual name of a Danish worksheet."""
DIGITS = re.compile(r"[0-9]+")
LABEL = re.compile(r"(?:[^\W\d]*[\W_]*)?[0-9]+|\w")  # Number of a repeat, possibly after a word, or a letter


class Text(NamedTuple):
    """A text next to the readings."""

    text: str
    part: str  # Cell, or another part of the file
    is_cell: bool = True


def remark_beside(table: Table, rows: ReadRows) -> None:
    """Add a remark for each text that may change the readings, and for cells with marks. Ask about merged cells.

    The name of the sample is harmless.
    """
    _ask_about_names(table)
    if table.likely and not all(map(table.confirms, cells := [*map(letters, table.likely)])):
        table.remark("name", f"{table.named(table.likely)} is read, although its name has unknown words.", cells)
    sample = table.declared.sample or table.grid.path.stem
    texts = [text for text in _texts(table, rows, sample) if not is_harmless(text.text, sample)]
    remarks = dict[str, list[Text]]()
    for text in (*texts, *_names(table.grid, table.declared.sample)):
        if not table.confirms(text.part):
            # Numbers of points and times of readings are one remark.
            remarks.setdefault(text.text if changes(text.text) else DIGITS.sub("0", text.text), []).append(text)
    read_in = {column.unit for column in table.used if column.unit is not None}
    # Texts with a word that may change readings come first, since a page shows only some of them.
    for text, alike in sorted(remarks.items(), key=lambda remark: not changes(remark[0])):
        parts, texts = [remark.part for remark in alike], dict.fromkeys(remark.text for remark in alike)
        cells, finding = [remark.part for remark in alike if remark.is_cell], f"{listed(parts)} has the remark"
        if cells and read_in and _units_in(text) - read_in:
            finding += f" {quoted(text)}, but {' and '.join(sorted(read_in))} is read."
            table.ask("unit", finding, "Write all in one unit.", {CONFIRMS: cells}, cells)
        else:
            table.remark("remark", f"{finding} {listed([quoted(text, LONGEST_QUOTED) for text in texts])}.", cells)
    _remark_marks(table, rows)


def _texts(table: Table, rows: ReadRows, sample: str) -> Iterator[Text]:
    """Yield the texts outside the header and the readings of a sheet, comments, and other texts in the file."""
    grid, (_, rows_inside) = table.grid, table.span
    numbers = {column for row in table.body for column, cell in grid.rows[row].items() if numeric(cell)}
    samples = {k for k, column in table.others.items() if column.role is Role.SAMPLE}
    for row, cells in grid.rows.items():
        if row in rows.read or row in table.header.rows:
            for column, cell in cells.items():
                if cell.text and _may_change(table, row, column, numbers, sample):
                    yield Text(cell.text, f"{letters(column)}{row}")
        elif row not in rows.passed and not {Role.STATION, Role.READING} <= roles_in(cells.values()):
            filled = [column for column, cell in cells.items() if cell.text]
            # The name of a sample beside numbers is that of another one.
            words = {column for column in filled if not numeric(cells[column])}
            words -= samples if len(words) < len(filled) else set()
            if words or (filled and rows_inside.start <= row < table.header.first):
                yield Text(" ".join(cells[column].text for column in filled), f"{letters(filled[0])}{row}")
    for row, column, text in grid.comments:
        yield Text(text, f"{letters(column)}{row}")
    for part, text in grid.elsewhere:
        yield Text(text, part, is_cell=False)


def _may_change(table: Table, row: int, column: int, numbers: set[int], sample: str) -> bool:
    """Return whether a text may change readings: in the header or next to readings, and not known to be harmless."""
    cell, name = table.grid.cell(row, column), table.header.names.get(column, "")
    roles, other = {used.role for used in table.used if used.index == column}, table.others.get(column)
    if row in table.header.rows:
        # A column of numbers under an unknown name is asked about elsewhere.
        return not (roles or other or column in numbers)
    if roles:
        # The number of a repeat is no reading, and no word.
        return Role.REPEAT in roles and LABEL.fullmatch(cell.text) is None
    is_unit = {unit_of(cell.text)} == {used.unit for used in table.used} - {None}
    if is_missing(cell.text) or is_unit or (numeric(cell) and not is_note(name)):
        return False
    return other is None or not is_harmless(f"{name}: {cell.text}", sample)


def _names(grid: Grid, sample: str | None) -> Iterator[Text]:
    """Yield the names of the worksheet and of the file, without the name of the sample."""
    stem = grid.path.stem.replace(sample, " ") if sample else grid.path.stem
    is_sample = sample or ANOTHER.fullmatch(stem)
    for kind, name in (("name of the worksheet", grid.sheet or ""), ("name of the file", stem)):
        # "P02" in the file of P01 is another sample.
        is_other = is_sample and ANOTHER.fullmatch(name) and sample_key(name) != sample_key(sample or grid.path.stem)
        if is_other or (len(name.strip()) > 1 and changes(name)):
            yield Text(name, kind, is_cell=False)


def _ask_about_names(table: Table) -> None:
    """Ask about words and marks in column names that may change what is read, whatever is declared."""
    for column in [*(column.index for column in table.used), *table.unclear]:
        text = table.header.names.get(column, "")
        if may_change(text):
            remedy = "Write lengths into the sheet, and what the name says (unit, datum, end of s) into other answers."
            finding = f"does {quoted(text)} change the readings, or is it not a length?"
            answer = [letters(column)]
            table.ask("name", finding, remedy, {CONFIRMS: answer}, answer)


def _remark_marks(table: Table, rows: ReadRows) -> None:
    """Remark readings that are struck through, hidden, or coloured unlike others. Ask about merged readings."""
    grid, marked, merged = table.grid, list[str](), list[str]()
    for column in table.used:
        if column.index in grid.hidden_columns or any(table.cell(row, column).is_struck for row in table.header.rows):
            marked.append(column.letters)
            continue
        cells = {row: table.cell(row, column) for row in rows.read if f"{column.letters}{row}" not in table.chosen.skip}
        usual, count = Counter(cell.colours for cell in cells.values()).most_common(1)[0] if cells else ("", 0)
        coloured = len(cells) - count <= MAX_COLOURED * len(cells)
        for row, cell in sorted(cells.items()):
            name = f"{column.letters}{row}"
            if cell.is_struck or row in grid.hidden_rows or (coloured and cell.colours != usual):
                marked.append(name)
            if column.role is Role.READING and (row, column.index) in grid.merged and not table.confirms(name):
                merged.append(name)
    if marked := [cell for cell in marked if not table.confirms(cell)]:
        table.remark(
            "marked", f"{listed(marked)} struck through, hidden or coloured unlike the others, but read.", marked
        )
    if merged:
        finding = f"{listed(merged)} is merged with other cells, which would have no reading."
        table.ask("merged", finding, "Write each reading into its own cell.", {CONFIRMS: merged}, merged)


def changes(text: str) -> bool:
    """Return True if a text has a word or sign that may change readings: a unit, side, zero, factor or rejection.

    Texts in other scripts than the Latin one also give True.
    """
    plain = plain_letters(text)
    stops = STOPS & {word[:5] for word in WORD.findall(plain)}
    return bool(_units_in(text) or stops or INCH.search(plain) or SIGN.search(plain))


def _units_in(text: str) -> set[str]:
    """Return the units that a text names. A single m, or the German um, may be any word."""
    return {UNITS[word] for word in WORD.findall(plain_letters(text)) if word in UNITS and word not in "um"}


def is_harmless(text: str, sample: str = "") -> bool:
    """Return True only if each word of a text is the sample's name, a date, a label, or a name or number behind one."""
    if sample_key(text) == sample_key(sample):
        return True
    if sample:
        text = re.sub(rf"(?i)(?<!\w){re.escape(sample)}(?![\w'*+?])", " ", text)
    kind, names = "other", 0
    for word in re.split(r"(?:[\s;()\[\]]|(?<!\d):|,(?!\d))+", text):
        plain = plain_letters(word).rstrip(".")
        if plain in LABELS:
            kind, names = LABELS[plain], 0
        elif plain and plain not in NOTHING and not DATE.fullmatch(word):
            names += 1
            is_value = re.fullmatch(VALUES[kind], word) and not word[0].islower() and not changes(word)
            if names > MAX_NAMES or not is_value:
                return False
    return True
