"""A sheet in an XLSX workbook: the one that is wanted, or the only one that holds anything."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from validate.sheets.faults import Place, SheetFaults, clipped, refuse
from validate.sheets.grid import BLANK, MOST_COLUMNS, MOST_ROWS, Grid, Row
from validate.sheets.workbook_archive import Archive, UnusableError
from validate.sheets.workbook_cells import Cells, WorkbookSheet
from validate.sheets.workbook_parts import Book, Relations, Strings, Styles
from validate.wording import counted

MOST_BYTES = 5_000_000
"""Of the file: photos in it are not read, but they are hashed."""
MOST_SHEETS = 64
SAVE_AGAIN = "Open it in a spreadsheet program and save it as XLSX, or as CSV."


def read_workbook(path: Path, content: bytes, sha256: str, wanted: str | None) -> Grid:
    """The sheet that is ``wanted``, or the only visible one that holds anything. Raises SheetFaults."""
    workbook = _open(path, content)
    with _damage_told(path):
        return _grid(path, sha256, workbook, wanted)


def read_sheets(path: Path, content: bytes, sha256: str) -> tuple[Grid, ...]:
    """All visible sheets that hold anything. Raises SheetFaults."""
    workbook = _open(path, content)
    with _damage_told(path):
        for sheet in workbook.sheets:
            workbook.fill(sheet)
    full = [sheet for sheet in workbook.sheets if sheet.rows and not sheet.hidden]
    return tuple(_as_grid(path, sha256, sheet, workbook.sheets) for sheet in full)


def _open(path: Path, content: bytes) -> "_Workbook":
    if len(content) > MOST_BYTES:
        raise refuse(Place(path), f"larger than {MOST_BYTES:,} bytes.", "Take pictures out of it, or save it as CSV.")
    with _damage_told(path):
        return _Workbook(Archive(content))


@contextmanager
def _damage_told(path: Path) -> Iterator[None]:
    try:
        yield
    except UnusableError as fault:
        raise refuse(Place(path), f"no XLSX that can be read ({fault}).", SAVE_AGAIN) from fault


def _grid(path: Path, sha256: str, workbook: "_Workbook", wanted: str | None) -> Grid:
    if wanted is not None:
        chosen = next((sheet for sheet in workbook.sheets if sheet.name == wanted), None)
        if chosen is None:
            raise _which(path, f"no sheet {clipped(wanted)!r} among", workbook.sheets, wanted)
        workbook.fill(chosen)
    else:
        for sheet in workbook.sheets:
            workbook.fill(sheet)
        full = [sheet for sheet in workbook.sheets if sheet.rows and not sheet.hidden]
        if len(full) > 1:
            raise _which(path, f"{len(full)} sheets hold something:", full, None)
        if not full:
            secret = [sheet for sheet in workbook.sheets if sheet.rows]
            if secret:
                raise _which(path, "all that holds anything is hidden:", secret, None)
            raise refuse(Place(path), "no rows of readings: all sheets are empty.", "Save the workbook with its cells.")
        (chosen,) = full
    return _as_grid(path, sha256, chosen, workbook.sheets)


def _as_grid(path: Path, sha256: str, chosen: WorkbookSheet, sheets: list[WorkbookSheet]) -> Grid:
    _refuse_large(path, chosen)
    rows = []
    for number in sorted(chosen.rows):
        cells = chosen.rows[number]
        rows.append(Row(number, tuple(cells.get(column, BLANK) for column in range(max(cells) + 1))))
    return Grid(
        path,
        sha256,
        tuple(rows),
        ("XLSX", f"sheet {clipped(chosen.name)!r}"),
        sheet=chosen.name,
        merged=tuple(chosen.merged),
        remarks=tuple(_remarks(chosen, sheets)),
    )


def _which(path: Path, found: str, sheets: list[WorkbookSheet], value: str | None) -> SheetFaults:
    names = ", ".join(repr(clipped(sheet.name)) for sheet in sheets[:12]) + (", …" if len(sheets) > 12 else "")
    return refuse(Place(path), f"{found} {names}.", "Name the one with the readings: [readings] sheet.", value)


def _refuse_large(path: Path, sheet: WorkbookSheet) -> None:
    if len(sheet.rows) > MOST_ROWS:
        raise refuse(
            Place(path, sheet.name), f"more rows than the {MOST_ROWS} that are read.", "Thin the stations out."
        )
    for row, cells in sheet.rows.items():
        if max(cells) >= MOST_COLUMNS:
            place = Place(path, sheet.name, row, max(cells))
            raise refuse(
                place, f"only the first {MOST_COLUMNS} columns are read.", "Delete what stands outside the table."
            )


def _remarks(chosen: WorkbookSheet, sheets: list[WorkbookSheet]) -> Iterator[str]:
    if chosen.hidden:
        yield "this sheet is hidden"
    if chosen.hidden_rows or chosen.hidden_columns:
        rows, columns = counted(chosen.hidden_rows, "hidden row"), counted(chosen.hidden_columns, "hidden column")
        yield f"{rows} and {columns} are read too"
    if others := [sheet for sheet in sheets if sheet.hidden and sheet.rows and sheet is not chosen]:
        yield f"{counted(len(others), 'hidden sheet')} not read"


class _Workbook:
    """Its sheets by name, and what their cells refer to."""

    def __init__(self, archive: Archive) -> None:
        self._archive = archive
        if "xl/workbook.xml" not in archive:
            raise UnusableError("a zip without xl/workbook.xml: another program's format")
        targets = Relations()
        archive.parse("xl/_rels/workbook.xml.rels", targets)
        book = Book()
        archive.parse("xl/workbook.xml", book)
        if len(book.sheets) > MOST_SHEETS:
            raise UnusableError(f"{len(book.sheets)} sheets; at most {MOST_SHEETS} are looked at")
        self.sheets = [
            WorkbookSheet(name, targets.sheets[key], hidden)
            for name, key, hidden in book.sheets
            if key in targets.sheets
        ]
        strings, styles = Strings(), Styles()
        if targets.strings is not None:
            archive.parse(targets.strings, strings)
        if targets.styles is not None:
            archive.parse(targets.styles, styles)
        self._strings, self._dates = strings.texts, styles.dates
        self._first_day = datetime(1904, 1, 1) if book.from_1904 else datetime(1899, 12, 30)

    def fill(self, sheet: WorkbookSheet) -> None:
        self._archive.parse(sheet.part, Cells(sheet, self._strings, self._dates, self._first_day))
