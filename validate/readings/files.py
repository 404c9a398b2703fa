"""Read the file of a sheet: its cells, their marks, and the other texts of a workbook."""

import io
import re
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.plain_files import opened
from validate.readings.grid import SAVE_AGAIN, Grid, SheetFaults, quoted, refused, shown
from validate.readings.names import unit_of
from validate.readings.numbers import NUMBER
from validate.readings.text_file import read_text
from validate.settings import Separator

LARGEST_FILE_BYTES = 5_000_000  # Limit on the size of a sheet, or of a workbook with its pictures
LARGEST_UNPACKED_MB = 32  # Limit on all parts together: 10,000 rows of 32 numbers take 13 MB
SMALLER = "Remove pictures and other tables from it, or save it as CSV."
ZIP = b"PK\x03\x04"
OLD_EXCEL = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"  # First bytes of .xls, and of an XLSX with a password
OTHER_FORMAT = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*(<!doctype html|<html|<table|<\?xml|mime-version:|\{\\rtf|\{\"|%pdf-|bplist|sqlite format"
    rb"|\x1f\x8b|rar!|7z\xbc\xaf)",
    re.IGNORECASE,
)
"""First bytes of pages, texts, databases and archives that programs export with the file extension of a sheet."""
AMOUNT = re.compile(rf"^{NUMBER.pattern}\s*(?=\D*$)")  # Number before a unit


def read_grid(path: Path, sheet: str | None = None, separator: Separator | None = None) -> Grid:
    """Return the rows with content of a CSV, or of one sheet of a workbook (XLSX or ODS).

    Raises SheetFaults if the file is neither, or if several sheets have a table and ``sheet`` names none of them.
    Raises InputError if the file cannot be opened.
    """
    content = _content(path)
    if not content.startswith(ZIP):
        if sheet is None:
            return read_text(path, content, separator)
        finding = f"a text file, which has no sheets, but [readings] sheet = {sheet!r}."
        raise refused(as_text(path), finding, "Remove this setting, or give the workbook.")
    from validate.readings import open_document, workbook
    from validate.readings.worksheets import chosen_grid

    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
        if (unpacked_mb := sum(entry.file_size for entry in archive.infolist()) / 1e6) > LARGEST_UNPACKED_MB:
            finding = (
                f"the workbook has {unpacked_mb:.0f} MB when it is unpacked; the limit is {LARGEST_UNPACKED_MB} MB."
            )
            raise refused(as_text(path), finding, SMALLER)
        # openpyxl warns about skipped styles and extensions, which contain no readings.
        with warnings.catch_warnings(action="ignore"):
            if open_document.MIMETYPE in content[:128]:
                program, sheets = "ODS", [*open_document.read_worksheets(archive)]
            elif "[Content_Types].xml" in archive.namelist():
                program, sheets = "XLSX", [*workbook.read_worksheets(archive, content)]
            else:
                raise refused(as_text(path), "a zip file, but not an XLSX.", SAVE_AGAIN)
    except SheetFaults:
        raise
    except Exception as fault:  # Damaged files raise errors of any class.
        cause = fault.__cause__ or fault
        finding = f"damaged, or not a workbook ({type(cause).__name__}: {shown(str(cause))})."
        raise refused(as_text(path), finding, SAVE_AGAIN) from fault
    return chosen_grid(path, program, sheets, sheet)


def read_table(path: Path, starter: str) -> Grid:
    """Read a CSV of any separator and encoding, or a workbook. ``starter`` explains in messages how to obtain one.

    Raises InputError if the file is missing or cannot be read.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; {starter}.")
    return read_grid(path)


def named_cells(
    grid: Grid, needed: Sequence[str], optional: Sequence[str] = ()
) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield the place and the texts by column of each row below the first. Raises InputError.

    A column ``needed`` must be there, and numbers in columns of millimetres must not have another unit.
    """
    head = [cell.text for cell in next(iter(grid.rows.values()), ())]
    names = (*needed, *optional)
    if missing := [name for name in needed if name not in head]:
        raise InputError(f"{grid.path}: no column {', '.join(missing)}; its first row must name {', '.join(names)}.")
    if twice := [name for name in names if head.count(name) > 1]:
        raise InputError(f"{grid.path}: {head.count(twice[0])} columns {twice[0]}; keep one, and rename the others.")
    columns = {name: head.index(name) for name in names if name in head}
    for row in [*grid.rows][1:]:
        for name, column in columns.items():
            text, _, unit = grid.cell(row, column)
            unit = unit or AMOUNT.sub("", text)
            if unit == "%" or (name.endswith("_mm") and unit not in (text, "", "mm")):
                place = f"{grid.place(row, column)} ({name})"
                raise InputError(f"{place}: {text} is in {quoted(unit)}; give it in mm, in a column of plain numbers.")
        beside = [column for column in range(len(grid.rows[row])) if column not in columns.values()]
        if unit := next(
            (text for column in beside if unit_of(text := grid.cell(row, column).text) not in (None, "mm")), ""
        ):
            raise InputError(f"{grid.place(row)}: {quoted(unit)} beside numbers that must be in mm; convert them.")
        yield grid.place(row), {name: grid.cell(row, column).text for name, column in columns.items()}


def _content(path: Path) -> bytes:
    """Return the bytes of a file. Raises InputError for what is no file, and SheetFaults for another format."""
    try:
        with opened(path) as file:
            content = file.read(LARGEST_FILE_BYTES + 1)
    except OSError as fault:
        finding = f"readings cannot be opened ({fault.strerror})."
        raise InputError(f"{as_text(path)}: {finding} Give the sheet's path in [readings] file.") from fault
    if len(content) > LARGEST_FILE_BYTES:
        finding = f"larger than {LARGEST_FILE_BYTES:,} bytes."
        raise refused(as_text(path), finding, SMALLER)
    if content.startswith(OLD_EXCEL):
        raise refused(as_text(path), "an old Excel workbook (.xls), or one with a password.", SAVE_AGAIN)
    if other := OTHER_FORMAT.match(content):
        finding = f"another format with the file name of a sheet: it begins with {other[1].decode('latin-1')!r}."
        raise refused(as_text(path), finding, SAVE_AGAIN)
    return content
