"""The tables of one sheet, beside each other or one below the other, each with the title above it.

A table is recognised by its cells: a header, and at least two rows below it with two numbers or more. Its words are not
needed, so that a table under unknown names is one too.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from validate.readings.cell_units import bare
from validate.readings.header_rows import Merged, find_header
from validate.readings.header_words import NAME, meaning
from validate.readings.sheet import BLANK, SheetCell, SheetGrid, SheetRow, letters
from validate.readings.table_rows import blocks, is_a_number, plain_name, within
from validate.readings.text_table import number
from validate.settings import Columns

LEAST = 2  # Rows of numbers in a table, and numbers in a row
MOST_TEXTS = 3  # Texts in a row that may be a title or a remark
MARKED = re.compile(r"[~≈<>(]?\s?([-+]?\d+(?:[.,]\d+)?)\s?[*?!)†‡]{0,2}")  # ~1,5 or 1.5*
"""Number with a mark: no reading before it is asked about, but its table is one."""


@dataclass(frozen=True)
class Table:
    """A table of a sheet. Cells of its rows that belong to other tables are blank."""

    columns: range
    title: tuple[SheetRow, ...]  # Lines above the header that belong to this table only
    header: tuple[SheetRow, ...]
    body: tuple[SheetRow, ...]  # Rows below the header, up to the last number
    names: Mapping[int, str]  # Names of its columns

    @property
    def cells(self) -> str:
        """Range of the title, the header and the rows, such as A1:C20."""
        top = (*self.title, *self.header)[0].number
        return f"{letters(self.columns[0])}{top}:{letters(self.columns[-1])}{self.body[-1].number}"

    def labels(self, column: int) -> tuple[str, ...]:
        """Return the texts above or below a column's name in rows with several texts, each of which spans columns."""
        first = next(at for at, row in enumerate(self.body) if _numbers(row))
        rows = (row for row in (*self.title, *self.body[:first]) if _texts(row) > 1)
        labels = (next((cell.text for cell in row.cells[column::-1] if cell.text), "") for row in rows)
        return tuple(filter(None, labels))

    def covers(self, row: int, column: int) -> bool:
        return column in self.columns and (*self.title, *self.header)[0].number <= row <= self.body[-1].number

    def is_beside(self, other: "Table") -> bool:
        """Return True if the header and rows of two tables have rows of the sheet in common."""
        return self.header[0].number <= other.body[-1].number and other.header[0].number <= self.body[-1].number

    def is_like(self, other: "Table") -> bool:
        """Return True if another table has the same column names, except for numbers and names of samples."""
        return list(map(_without_numbers, self.names.values())) == list(map(_without_numbers, other.names.values()))


def tables_of(grid: SheetGrid) -> list[Table]:
    """Return the tables of a sheet from top to bottom, and from left to right."""
    return list(_tables(list(grid.rows), grid.merged))


def common_lines(grid: SheetGrid, span: str | None) -> list[SheetRow]:
    """Return lines of text outside a range that belong to no table: titles and remarks about the whole sheet."""
    if span is None:
        return []
    inside = {row.number: row for row in within(grid.rows, span) if row.width}
    others = [table for table in tables_of(grid) if not any(_meets(table, row) for row in inside.values())]
    lines = list[SheetRow]()
    for row in grid.rows:
        own = inside.get(row.number, SheetRow(row.number, ()))
        cells = tuple(
            BLANK if own.cell(at) != BLANK or any(table.covers(row.number, at) for table in others) else cell
            for at, cell in enumerate(row.cells)
        )
        texts = [cell for cell in cells if cell != BLANK]
        if texts and len(texts) <= MOST_TEXTS and not any(map(_is_number, texts)):
            lines.append(SheetRow(row.number, cells))
    return lines


def _meets(table: Table, row: SheetRow) -> bool:
    return any(table.covers(row.number, at) for at, cell in enumerate(row.cells) if cell != BLANK)


def _tables(rows: list[SheetRow], merged: Merged) -> Iterator[Table]:
    """Yield the tables of a part of a sheet: divide it at blank columns, then at headers, then at repeated names."""
    starts = _starts(rows)
    spans = _by_blanks(rows, merged)
    if not spans and len(starts) > 1:
        parts = [rows[start:end] for start, end in pairwise([*starts, len(rows)])]
    else:
        parts = [list(_in_columns(rows, span)) for span in spans or _by_names(rows, merged)]
    if not parts:
        yield from filter(None, [_table(rows, merged)])
        return
    tables = [part for each in parts if (part := list(_tables(each, merged)))]
    firsts = [part[0] for part in tables]
    for part in tables:
        # A table far below on the other side has no line of a title here.
        others = [one for one in firsts if not spans or one.is_beside(part[0])]
        yield from (_with_own_title(part[0], others), *part[1:])


def _table(rows: Sequence[SheetRow], merged: Merged) -> Table | None:
    head = find_header(rows, merged, Columns())
    last = max((at for at, row in enumerate(rows) if _numbers(row)), default=-1)
    body = rows[head.first + head.count : last + 1]
    if sum(len(_numbers(row)) >= LEAST for row in body) < LEAST or not head.names:
        return None
    header = rows[head.first : head.first + head.count]
    columns = [at for row in (*header, *body) for at, cell in enumerate(row.cells) if cell != BLANK]
    span = range(min(columns), max(columns) + 1)
    title = [row for row in rows[: head.first] if not _numbers(row)]
    return Table(span, tuple(title), tuple(header), tuple(body), head.names)


def _with_own_title(table: Table, beside: Sequence[Table]) -> Table:
    """Return a table with as many lines of its title as another table of the sheet has too.

    Lines above them may be about all tables.
    """
    if len(beside) < LEAST:
        return table
    lines = sorted(len(one.title) for one in beside)[-2]
    return replace(table, title=table.title[max(0, len(table.title) - lines) :])


def _starts(rows: Sequence[SheetRow]) -> list[int]:
    """Return the index of each row at which a table begins, below another one; the first is 0."""
    starts, heads = [0], list[list[str]]()
    after_numbers: int | None = None  # Index behind the last row with numbers
    for at, row in enumerate(rows):
        texts = [plain_name(cell.text) for cell in row.cells if cell.text and not _is_number(cell)]
        if after_numbers is not None and _is_header(rows, at, texts in heads):
            starts.append(_title_above(rows, after_numbers, at))
            after_numbers = None
        if len(texts) >= LEAST and not _numbers(row):
            heads.append(texts)
        if len(_numbers(row)) >= LEAST:
            after_numbers = at + 1
    return starts


def _is_header(rows: Sequence[SheetRow], at: int, is_repeated: bool) -> bool:
    """Return True if a row below numbers is the header of a further table rather than a remark between its rows."""
    row, below = rows[at], rows[at + 1 :]
    texts = [cell for cell in row.cells if cell.text and not _is_number(cell)]
    following = [other for other in below if len(_numbers(other)) >= LEAST]
    if not texts or len(following) < LEAST:
        return False
    along = [what.role in ("station", "mass") for cell in texts if (what := meaning(cell.text)) is not None]
    if any(along):
        return True
    if _numbers(row) or len(texts) < LEAST:
        return False
    above = [other for other in rows[:at] if len(_numbers(other)) >= LEAST]
    column = min(_numbers(following[0]))
    before = _numbers(above[-1]).get(column)
    restarts = before is not None and _numbers(following[0])[column] <= before
    above_numbers = {at for at, cell in enumerate(row.cells) if cell.text} & _numbers(following[0]).keys()
    return is_repeated or (restarts and len(above_numbers) >= LEAST)


def _title_above(rows: Sequence[SheetRow], begin: int, header: int) -> int:
    """Return the index of the first line above a header that is its title. Lines before it may be a footnote."""
    gaps = [at for at in range(begin, header + 1) if rows[at].number > rows[at - 1].number + 1]
    # After a gap below the numbers everything is a title; without any gap only the line above the header is.
    return gaps[0] if gaps and (gaps[0] < header or gaps[0] == begin) else max(begin, header - 1)


def _by_blanks(rows: Sequence[SheetRow], merged: Merged) -> list[range]:
    """Return the columns of tables with blank columns between them; an empty list if there is only one table.

    A column of numbers without stations belongs to the table on its left: its repeats may have a gap.
    """
    starts = list[int]()
    for span in blocks([row for row in rows if len(_numbers(row)) >= LEAST]):
        own = list(_in_columns(rows, span))
        numeric = {at for row in own for at in _numbers(row)}
        roles = {what.role for name in find_header(own, merged, Columns()).names.values() if (what := meaning(name))}
        goes_on = bool(roles & {"reading", "repeat"}) and not roles & {"station", "mass"}
        starts += [] if len(numeric) < LEAST or goes_on else [span[0]]
    return _spans(rows, starts)


def _by_names(rows: Sequence[SheetRow], merged: Merged) -> list[range]:
    """Return the columns of tables that begin at each column of stations, or at each column with the first name."""
    names = find_header(rows, merged, Columns()).names
    along = [at for at, name in names.items() if (what := meaning(name)) is not None and what.role == "station"]
    first = _without_numbers(next(iter(names.values()), ""))
    again = [at for at, name in names.items() if first and _without_numbers(name) == first]
    for starts in (along, again):
        spans = _spans(rows, starts)
        numeric = [{at for row in rows for at in _numbers(row)} & set(span) for span in spans]
        if spans and min(map(len, numeric)) >= LEAST:
            return spans
    return []


def _without_numbers(name: str) -> str:
    return " ".join(word for word in NAME.findall(plain_name(name)) if not any(map(str.isdigit, word)))


def _spans(rows: Sequence[SheetRow], starts: Sequence[int]) -> list[range]:
    if len(starts) < LEAST:
        return []
    width = max((row.width for row in rows), default=0)
    starts = [0, *starts[1:]]
    return [range(start, end) for start, end in pairwise([*starts, width])]


def _in_columns(rows: Sequence[SheetRow], span: range) -> Iterator[SheetRow]:
    for row in rows:
        inside = SheetRow(row.number, tuple(cell if at in span else BLANK for at, cell in enumerate(row.cells)))
        if inside.width:
            yield inside


def _numbers(row: SheetRow) -> dict[int, float]:
    """Return the numbers of a row by column; a cell whose value is unknown counts as 0."""
    return {at: _value(cell) for at, cell in enumerate(row.cells) if _is_number(cell) or cell.kind == "formula"}


def _texts(row: SheetRow) -> int:
    return sum(bool(cell.text) and not _is_number(cell) for cell in row.cells)


def _value(cell: SheetCell) -> float:
    return number(_bare(cell).text, None) or 0.0


def _is_number(cell: SheetCell) -> bool:
    """Return True for a number, also with a unit behind it or a mark beside it."""
    return is_a_number(_bare(cell))


def _bare(cell: SheetCell) -> SheetCell:
    marked = MARKED.fullmatch(cell.text)
    return bare(cell) if marked is None else cell._replace(text=marked[1])
