"""A file as rows of cells: text or workbook, by what it holds and not by its name."""

import hashlib
import stat
from pathlib import Path

from sealtwin.errors import InputError, as_text
from validate.settings import Declared
from validate.sheets import delimited, workbook
from validate.sheets.faults import Place, refuse
from validate.sheets.grid import Grid

ZIP = b"PK\x03\x04"
OLD_EXCEL = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""Of .xls, and of an XLSX with a password."""


def read_cells(path: Path, declared: Declared) -> Grid:
    """The rows of a CSV, or of a workbook's one sheet, that hold anything.

    No more than ``workbook.MOST_BYTES`` are read, once; hash and cells are of the same bytes.

    Raises SheetFaults where the file is no such thing, and InputError where it cannot be opened.
    """
    content = _content(path)
    sha256 = hashlib.sha256(content).hexdigest()
    if content.startswith(ZIP):
        return workbook.read_workbook(path, content, sha256, declared.sheet)
    if declared.sheet is not None:
        raise refuse(
            Place(path),
            f"a text file, which has no sheets, while [readings] sheet names {declared.sheet!r}.",
            "Leave it out, or give the workbook.",
            declared.sheet,
        )
    return delimited.read_delimited(path, content, sha256, declared.separator)


def read_all_cells(path: Path) -> tuple[Grid, ...]:
    """The same of every visible sheet that holds anything; of a text file its one. Raises as ``read_cells``."""
    content = _content(path)
    sha256 = hashlib.sha256(content).hexdigest()
    if content.startswith(ZIP):
        return workbook.read_sheets(path, content, sha256)
    return (delimited.read_delimited(path, content, sha256, None),)


def _content(path: Path) -> bytes:
    """Raises SheetFaults where it is an old workbook, or changes meanwhile."""
    try:
        # A pipe would be waited for, and has no end.
        if not stat.S_ISREG(path.stat().st_mode):
            raise IsADirectoryError(0, "no file")
        with path.open("rb") as file:
            before = path.stat()
            content = file.read(workbook.MOST_BYTES + 1)
            after = path.stat()
    except OSError as fault:
        raise InputError(
            f"{as_text(path)}: readings cannot be opened ({fault.strerror}). Give the sheet's path in [readings] file."
        ) from fault
    if (before.st_size, before.st_mtime_ns, before.st_ino) != (after.st_size, after.st_mtime_ns, after.st_ino):
        raise refuse(Place(path), "changed while it was read.", "Save it, close it in other programs, and try again.")
    if content.startswith(OLD_EXCEL):
        raise refuse(Place(path), "an old Excel workbook (.xls), or one with a password.", workbook.SAVE_AGAIN)
    return content
