"""Files of readings: their cells, and the parts of a file that a user gives to several samples."""

import hashlib
import json
import re
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sealtwin.core.errors import InputError, as_text
from validate.readings.cell_units import columns_of_units, unit_cells
from validate.readings.sheet import (
    SAVE_AGAIN,
    Place,
    SheetGrid,
    quoted,
    refuse,
)
from validate.readings.table_rows import common_lines, within
from validate.readings.texts import read_text
from validate.settings import RANGE, Declared

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
    rf"(?:sheet (?P<sheet>.+?), )?(?:(?P<cells>{RANGE[1:-1]})|columns (?P<levels>.+)|rows of (?P<rows_of>.+))"
    r"|sheet (?P<alone>.+)",
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
    """A part of a file with the readings of one sample, as the user names it."""

    sheet: str | None  # Name of the worksheet, if the name gives it
    rows_of: str | None  # Sample of the rows, as spelt in the sample column
    sha256: str = field(compare=False)  # Hash of the part's cells
    cells: str | None = None  # Range of cells
    levels: str | None = None  # Letters of its columns of readings

    def __str__(self) -> str:
        columns, rows = self.levels and f"columns {self.levels}", self.rows_of and f"rows of {self.rows_of}"
        parts = (self.sheet and f"sheet {self.sheet}", self.cells, columns, rows)
        return ", ".join(part for part in parts if part)


def part_of(path: Path, name: str) -> SamplePart | None:
    """Return the part with a name such as "A1:C20" or "sheet May, columns B C"; None if it is not of that form."""
    match = RANGE_PART.fullmatch(name)
    if match is None:
        return None
    sheet, cells = match["sheet"] or match["alone"], match["cells"] and match["cells"].upper()
    grids = [grid for grid in sheets_of(path) if sheet in (None, grid.sheet)]
    rows = (row for grid in grids for row in (*within(grid.rows, cells), *common_lines(grid.rows, cells)))
    texts = json.dumps([row.cells for row in rows])
    sha256 = hashlib.sha256(texts.encode()).hexdigest()
    return SamplePart(sheet, match["rows_of"], sha256, cells, match["levels"])


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
