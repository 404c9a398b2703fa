"""Files of readings: their cells, and the parts of a file with several samples (in one sheet or in several)."""

import hashlib
import json
import re
import stat
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from sealtwin.core.errors import InputError, as_text
from validate.readings.cell_units import columns_of_units, unit_cells
from validate.readings.columns import read_header
from validate.readings.header import Header
from validate.readings.header_words import crack_depth, meaning, names_sample
from validate.readings.place_words import columns_of_places, is_place_word
from validate.readings.sample_rows import rows_by_name
from validate.readings.sheet import (
    SAVE_AGAIN,
    FaultList,
    Place,
    SheetFaults,
    SheetGrid,
    SheetRow,
    letters,
    quoted,
    refuse,
)
from validate.readings.table_rows import is_a_number, within
from validate.readings.tables import Table, common_lines, tables_of
from validate.readings.texts import read_text
from validate.settings import RANGE, Columns, Declared

LARGEST_FILE_BYTES = 5_000_000  # Limit on the size of a sheet, or of a workbook with its pictures
ZIP = b"PK\x03\x04"
OTHER_FORMATS: tuple[tuple[bytes, str], ...] = (
    (b"<!doctype html", "a page in HTML"),
    (b"<html", "a page in HTML"),
    (b"<table", "a page in HTML"),
    (b"<?xml", "a text in XML"),
    (b"mime-version:", "a web archive (MHTML)"),
    (b"{\\rtf", "a text in RTF"),
    (b'{"', "a text in JSON"),
    (b"%pdf-", "a PDF"),
    (b"bplist", "a property list of Apple"),
    (b"sqlite format", "a database"),
    (b"\x1f\x8b", "an archive (gzip)"),
    (b"rar!", "an archive (RAR)"),
    (b"7z\xbc\xaf", "an archive (7z)"),
)
"""First bytes, in lower case, of other formats that programs export with the file extension of a sheet."""
RANGE_PART = re.compile(
    rf"(?:sheet (?P<sheet>.+?), )?(?:(?P<cells>{RANGE[1:-1]})|columns (?P<levels>.+))",
    re.IGNORECASE,
)
OLD_EXCEL = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"  # First bytes of .xls, and of an XLSX with a password


def read_cells(path: Path, declared: Declared) -> SheetGrid:
    """Return the rows with content of a CSV, or of one sheet of a workbook.

    Raises SheetFaults if the file is neither, and InputError if it cannot be opened.
    """
    content = _content(path)
    if content.startswith(ZIP):
        from validate.readings.workbook import read_sheet

        return read_sheet(path, content, declared.sheet)
    if declared.sheet is not None:
        finding = f"a text file, which has no sheets, but [readings] sheet = {declared.sheet!r}."
        raise refuse(Place(path), finding, "Remove this setting, or give the workbook.", declared.sheet)
    return read_text(path, content, declared.separator)


def read_table(path: Path, starter: str) -> SheetGrid:
    """Read a CSV of any separator and encoding, or a workbook. ``starter`` explains in messages how to obtain one.

    Raises InputError if the file is missing or cannot be read.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; {starter}.")
    return read_cells(path, Declared())


def named_cells(
    table: SheetGrid, needed: Sequence[str], optional: Sequence[str] = ()
) -> Iterator[tuple[Place, dict[str, str]]]:
    """Yield the place and the texts by column of each row. Raises InputError if a column ``needed`` is missing."""
    head = [cell.text for cell in table.rows[0].cells] if table.rows else []
    names = (*needed, *optional)
    if missing := [name for name in needed if name not in head]:
        raise InputError(f"{table.path}: no column {', '.join(missing)}; its first row must name {', '.join(names)}.")
    if twice := [name for name in names if head.count(name) > 1]:
        raise InputError(f"{table.path}: {head.count(twice[0])} columns {twice[0]}; keep one, and rename the others.")
    heads = dict(enumerate(head))
    named = {at for at, name in heads.items() if name in names}
    places = {at for at in named if heads[at] == "s_mm"}
    beside = columns_of_units(heads, named, table.rows[1:])
    units = unit_cells(table.rows[1:], beside, places, sorted(named - places), ())
    for one in units:
        if heads[one.column].endswith("_mm") and one.unit != "mm":
            place = table.place(one.row.number, one.column, heads[one.column])
            raise InputError(f"{place}: {one.row.cell(one.column).text} is in {quoted(one.written)}; give it in mm.")
    for row in table.rows[1:]:
        for at, name in enumerate(head):
            if name in names and table.shown_units.get((row.number, at)) == "%" and row.cell(at).kind == "number":
                place, value = table.place(row.number, at, name), row.cell(at).text
                raise InputError(f"{place}: {value} has the format of percentages; format the column as numbers.")
        yield table.place(row.number), {name: row.cell(head.index(name)).text for name in names if name in head}


def _content(path: Path) -> bytes:
    """Return the bytes of a file. Raises SheetFaults for a large file or an old workbook."""
    try:
        # Reading from a pipe may block forever.
        if not stat.S_ISREG(path.stat().st_mode):
            raise IsADirectoryError(0, "no file")
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE_BYTES + 1)
    except OSError as fault:
        raise InputError(
            f"{as_text(path)}: readings cannot be opened ({fault.strerror}). Give the sheet's path in [readings] file."
        ) from fault
    if len(content) > LARGEST_FILE_BYTES:
        finding = f"larger than {LARGEST_FILE_BYTES:,} bytes."
        raise refuse(Place(path), finding, "Remove pictures and other tables from it, or save it as CSV.")
    if content.startswith(OLD_EXCEL):
        raise refuse(Place(path), "an old Excel workbook (.xls), or one with a password.", SAVE_AGAIN)
    begins = content[:200].removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if other := next((what for mark, what in OTHER_FORMATS if begins.startswith(mark)), None):
        raise refuse(Place(path), f"{other} with the file name of a sheet.", SAVE_AGAIN)
    return content


@dataclass(frozen=True)
class SamplePart:
    """A part of a file that may contain the readings of one sample."""

    sheet: str | None  # Name of the worksheet, if there are several
    rows_of: str | None  # Sample of the rows, as first spelt in the sample column; None without such a column
    sha256: str = field(compare=False)  # Hash of the part's cells without the sample name: equal for equal readings
    headed: bool = field(default=True, compare=False)
    """False for a worksheet without a header of readings, such as a cover, or a table under unknown names."""
    cells: str | None = None  # Range of cells, if a sheet has several tables
    title: tuple[str, ...] = field(default=(), compare=False)  # Lines above the table, the nearest last
    names: tuple[str, ...] = field(default=(), compare=False)  # Column names of the table
    levels: str | None = None  # Letters of its columns of readings, if samples share the stations of a table

    def __str__(self) -> str:
        columns, rows = self.levels and f"columns {self.levels}", self.rows_of and f"rows of {self.rows_of}"
        parts = (self.sheet and f"sheet {self.sheet}", self.cells, columns, rows)
        return ", ".join(part for part in parts if part)

    def with_columns_of(self, other: "SamplePart") -> "SamplePart":
        """Return this part with the columns of another one of the same table too."""
        both = self.sha256 + other.sha256
        return replace(
            self,
            levels=f"{self.levels} {other.levels}",
            names=(*self.names, *other.names),
            sha256=hashlib.sha256(both.encode()).hexdigest(),
        )


def parts_of(path: Path) -> tuple[SamplePart, ...]:
    """Return each table of readings in a file, one for each sample, and each of several worksheets without a table."""
    grids = sheets_of(path)
    return tuple(part for grid in grids for part in _parts(grid, grid.sheet if len(grids) > 1 else None))


def part_of(path: Path, name: str) -> SamplePart | None:
    """Return the part with a name such as "A1:C20" or "sheet May, columns B C"; None if it is not of that form."""
    match = RANGE_PART.fullmatch(name)
    if match is None:
        return None
    sheet, cells, levels = match["sheet"], match["cells"] and match["cells"].upper(), match["levels"]
    rows = (row for grid in sheets_of(path) if sheet in (None, grid.sheet) for row in within(grid.rows, cells))
    return SamplePart(sheet, None, _sha256(rows, None), cells=cells, levels=levels)


def sheets_of(path: Path) -> tuple[SheetGrid, ...]:
    """Return the cells of all visible worksheets, or of a text; none if the file cannot be read.

    The fault is reported when it is read as the sheet of a sample.
    """
    try:
        content = _content(path)
        if content.startswith(ZIP):
            from validate.readings.workbook import read_sheets

            return tuple(read_sheets(path, content))
        return (read_text(path, content, None),)
    except InputError:
        return ()


def _parts(grid: SheetGrid, sheet: str | None) -> Iterable[SamplePart]:
    tables = tables_of_readings(grid)
    if len(tables) == 1:
        yield from _by_column(tables[0][0], sheet)
    for table, header in tables if len(tables) > 1 else [(None, tables[0][1] if tables else _header_of(grid, None))]:
        column = None if header is None else header.sample
        part = SamplePart(sheet, None, _sha256(grid.rows, None), headed=header is not None)
        if table is not None:
            is_like = any(table.is_like(other) for other, _ in tables if other is not table)
            rows = (SheetRow(0, row.cells[table.columns[0] :]) for row in (*table.header, *table.body))
            part = SamplePart(
                sheet,
                None,
                _sha256([*rows, *table.title, *common_lines(grid, table.cells)], None),
                headed=header is not None or is_like,
                cells=table.cells,
                title=tuple(" ".join(cell.text for cell in row.cells if cell.text) for row in table.title),
                names=tuple(table.names.values()),
            )
        if header is None or column is None:
            if part.headed or sheet is not None or table is not None:
                yield part
            continue
        for name, own in rows_by_name(grid, header, column).items():
            yield replace(part, rows_of=name, sha256=_sha256([header.row, *own], column.index))


def _stations(table: Table) -> list[int]:
    """Return the columns of stations, by their names, else by words for places before their numbers."""
    named = [at for at, name in table.names.items() if (what := meaning(name)) is not None and what.role == "station"]
    return named or [at for at, words in columns_of_places(table.body).items() if is_place_word(words)]


def _by_column(table: Table, sheet: str | None) -> Iterator[SamplePart]:
    """Yield the columns that may be of different samples, beside the only column of stations.

    Their names are unknown or name samples, or they have further labels, or numbers that no repeats have.
    """
    columns = {at: meaning(name) for at, name in table.names.items()}
    along = _stations(table)
    numbers = {what.number for what in columns.values() if what is not None and what.role == "reading"}
    for at, what in columns.items() if len(along) == 1 else ():
        if what is not None and what.role not in ("reading", "repeat"):
            continue
        name, labels = table.names[at], table.labels(at)
        if what is not None and what.number is not None and "1" not in numbers:
            labels = (*labels, what.number)
        # A column of one value, such as a nominal level, has no readings.
        values = {row.cell(at).text for row in table.body if is_a_number(row.cell(at))}
        if len(values) > 1 and crack_depth(name) is None and (what is None or labels or names_sample(name)):
            rows = (SheetRow(0, (row.cell(along[0]), row.cell(at))) for row in (*table.header, *table.body))
            sha256 = _sha256(rows, None)
            yield SamplePart(sheet, None, sha256, headed=False, title=labels, names=(name,), levels=letters(at))


def tables_of_readings(grid: SheetGrid) -> list[tuple[Table, Header | None]]:
    """Return the tables that are or may be readings, with the header of those under known names.

    A table whose columns all have a meaning, but none of readings, is none: temperatures, a fill. Nor is a crack's
    depth beside one other column.
    """
    tables = tables_of(grid)
    if len(tables) == 1:
        return [(tables[0], _header_of(grid, None))]
    headed = [(table, _header_of(grid, table.cells)) for table in tables]
    return [(table, header) for table, header in headed if header is not None or _may_be_readings(table)]


def _may_be_readings(table: Table) -> bool:
    names = [name for name in table.names.values() if crack_depth(name) is None]
    return any(meaning(name) is None for name in names) and (len(names) > 1 or len(names) == len(table.names))


def _header_of(grid: SheetGrid, cells: str | None) -> Header | None:
    """Return the header of readings in a range, or None if there is none under known names."""
    try:
        return read_header(grid, Declared(columns=Columns(range=cells)), FaultList())
    except SheetFaults:
        return None


def _sha256(rows: Iterable[SheetRow], without: int | None) -> str:
    cells = [[cell for index, cell in enumerate(row.cells) if index != without] for row in rows]
    return hashlib.sha256(json.dumps(cells).encode()).hexdigest()
