"""Read the file of a sheet: its cells, their marks, and the other texts of a workbook."""

import io
import re
import warnings
import zipfile
from itertools import zip_longest
from pathlib import Path

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.plain_files import opened
from validate.readings.grid import SAVE_AGAIN, Grid, SheetFaults, refused, shown
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
        raise refused(path, finding, "Remove this setting, or give the workbook.")
    from validate.readings import open_document, workbook
    from validate.readings.worksheets import chosen_grid

    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
        if (unpacked_mb := sum(entry.file_size for entry in archive.infolist()) / 1e6) > LARGEST_UNPACKED_MB:
            finding = f"a workbook of {unpacked_mb:.0f} MB when it is unpacked; the limit is {LARGEST_UNPACKED_MB} MB."
            raise refused(path, finding, SMALLER)
        # openpyxl warns about skipped styles and extensions, which contain no readings.
        with warnings.catch_warnings(action="ignore"):
            if open_document.MIMETYPE in content[:128]:
                program, sheets = "ODS", [*open_document.read_worksheets(archive)]
            elif "[Content_Types].xml" in archive.namelist():
                program, sheets = "XLSX", [*workbook.read_worksheets(archive, content)]
            else:
                raise refused(path, "a zip file, but not an XLSX.", SAVE_AGAIN)
    except SheetFaults:
        raise
    except Exception as fault:  # Damaged files raise errors of any class.
        cause = fault.__cause__ or fault
        finding = f"damaged, or not a workbook ({type(cause).__name__}: {shown(str(cause))})."
        raise refused(path, finding, SAVE_AGAIN) from fault
    return chosen_grid(path, program, sheets, sheet)


def table_of(path: Path) -> tuple[tuple[str, ...], list[tuple[int, list[tuple[str, str]]]]]:
    """Return the names in the first row of any table, and the number of each other row with name and text of its cells.

    Raises InputError if the file cannot be read.
    """
    texts = {row: tuple(cell.text for cell in cells) for row, cells in read_grid(path).rows.items()}
    (_, head), *rows = [*texts.items()] or [(1, ())]
    return head, [(row, [*zip_longest(head, texts, fillvalue="")]) for row, texts in rows]


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
        raise refused(path, finding, SMALLER)
    if content.startswith(OLD_EXCEL):
        raise refused(path, "an old Excel workbook (.xls), or one with a password.", SAVE_AGAIN)
    if other := OTHER_FORMAT.match(content):
        finding = f"another format with the file name of a sheet: it begins with {other[1].decode('latin-1')!r}."
        raise refused(path, finding, SAVE_AGAIN)
    return content
