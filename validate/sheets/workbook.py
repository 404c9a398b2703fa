"""A sheet in an XLSX workbook: what its cells hold, and everything that makes a cell no plain number.

By ECMA-376 part 1 (SpreadsheetML). Names are taken without their namespace, which the strict form has another of.
"""

import io
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path, PurePosixPath
from typing import Literal
from xml.parsers import expat

from validate.sheets.faults import Place, SheetFaults, clipped, refuse
from validate.sheets.grid import BLANK, MOST_COLUMNS, MOST_ROWS, Cell, Grid, Row
from validate.wording import counted

MOST_BYTES = 5_000_000
"""Of the file: photos in it are not read, but they are hashed."""
MOST_ENTRIES = 2_000
LARGEST_PART = 16_000_000
"""Bytes of XML: 10,000 rows of 32 numbers take 13 million. What unpacks to more is not opened."""
LARGEST_PARTS = 32_000_000
"""All that are opened together."""
MOST_SHEETS = 64
PIECE = 1 << 16
SAVE_AGAIN = "Open it in a spreadsheet program and save it as XLSX, or as CSV."
BUILT_IN_DATES = {*range(14, 23), *range(27, 37), *range(45, 48), *range(50, 59)}
"""ECMA-376 part 1, 18.8.30, with the East Asian ones."""
NO_DATE = re.compile(r'"[^"]*"|\\.|_.|\*.|\[(?![hms]+\])[^\]]*\]|General|Standard', re.IGNORECASE)
"""What of a number's format is text, padding, colour or condition."""
LONGEST_FORMAT = 255
"""Letters, as Excel has it."""
MOST_MERGED = 10_000
REFERENCE = re.compile(r"([A-Z]{1,3})([0-9]{1,7})")
LAST_DAY = 2_958_466
"""The first after 31 December 9999."""


class _UnusableError(Exception):
    """Why this is no workbook that can be read."""


@dataclass
class _Sheet:
    name: str
    part: str
    hidden: bool
    rows: dict[int, dict[int, Cell]] = field(default_factory=dict)
    merged: list[tuple[int, int, int, int]] = field(default_factory=list)
    hidden_rows: int = 0
    hidden_columns: int = 0


def read_workbook(path: Path, content: bytes, sha256: str, wanted: str | None) -> Grid:
    """The sheet that is ``wanted``, or the only visible one that holds anything. Raises SheetFaults."""
    if len(content) > MOST_BYTES:
        raise refuse(Place(path), f"larger than {MOST_BYTES:,} bytes.", "Take pictures out of it, or save it as CSV.")
    try:
        with _damage_named():
            archive = zipfile.ZipFile(io.BytesIO(content))
        return _grid(path, sha256, _Workbook(archive), wanted)
    except _UnusableError as fault:
        raise refuse(Place(path), f"no XLSX that can be read ({fault}).", SAVE_AGAIN) from fault


@contextmanager
def _damage_named() -> Iterator[None]:
    """All that the archive's reader stumbles over where bytes are not as they were written."""
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError, ValueError) as fault:
        raise _UnusableError(f"damaged: {clipped(str(fault))}") from fault


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
        remarks=tuple(_remarks(chosen, workbook.sheets)),
    )


def _which(path: Path, found: str, sheets: "list[_Sheet]", value: str | None) -> SheetFaults:
    names = ", ".join(repr(clipped(sheet.name)) for sheet in sheets[:12]) + (", …" if len(sheets) > 12 else "")
    return refuse(Place(path), f"{found} {names}.", "Name the one with the readings: [readings] sheet.", value)


def _refuse_large(path: Path, sheet: _Sheet) -> None:
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


def _remarks(chosen: _Sheet, sheets: list[_Sheet]) -> Iterator[str]:
    if chosen.hidden:
        yield "this sheet is hidden"
    if chosen.hidden_rows or chosen.hidden_columns:
        rows, columns = counted(chosen.hidden_rows, "hidden row"), counted(chosen.hidden_columns, "hidden column")
        yield f"{rows} and {columns} are read too"
    if others := [sheet for sheet in sheets if sheet.hidden and sheet.rows and sheet is not chosen]:
        yield f"{counted(len(others), 'hidden sheet')} not read"


class _Workbook:
    """The parts of one archive that say what cells hold; no other part is opened."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        entries = archive.infolist()
        if len(entries) > MOST_ENTRIES:
            raise _UnusableError(f"{len(entries):,} parts; at most {MOST_ENTRIES:,} are looked at")
        self._unpacked = 0
        self._parts = {entry.filename: entry for entry in entries}
        if len(self._parts) < len(entries):
            raise _UnusableError("a part stands twice")
        if "xl/workbook.xml" not in self._parts:
            raise _UnusableError("a zip without xl/workbook.xml: another program's format")
        targets = _Relations()
        self._parse("xl/_rels/workbook.xml.rels", targets)
        book = _Book()
        self._parse("xl/workbook.xml", book)
        if len(book.sheets) > MOST_SHEETS:
            raise _UnusableError(f"{len(book.sheets)} sheets; at most {MOST_SHEETS} are looked at")
        self.sheets = [
            _Sheet(name, targets.sheets[key], hidden) for name, key, hidden in book.sheets if key in targets.sheets
        ]
        strings, styles = _Strings(), _Styles()
        if targets.strings is not None:
            self._parse(targets.strings, strings)
        if targets.styles is not None:
            self._parse(targets.styles, styles)
        self._strings, self._dates = strings.texts, styles.dates
        self._first_day = datetime(1904, 1, 1) if book.from_1904 else datetime(1899, 12, 30)

    def fill(self, sheet: _Sheet) -> None:
        self._parse(sheet.part, _Cells(sheet, self._strings, self._dates, self._first_day))

    def _parse(self, part: str, handler: "_Handler") -> None:
        """Piece by piece, and never more than a part is allowed to hold."""
        entry = self._parts.get(part)
        if entry is None:
            raise _UnusableError(f"{clipped(part)} is not in it")
        if entry.flag_bits & 1:
            raise _UnusableError("it has a password")
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise _UnusableError(f"{clipped(part)} is packed in a way that XLSX does not have")
        if entry.file_size > LARGEST_PART:
            raise _UnusableError(f"{clipped(part)} unpacks to more than {LARGEST_PART / 1e6:g} MB")
        self._unpacked += entry.file_size
        if self._unpacked > LARGEST_PARTS:
            raise _UnusableError(f"its sheets unpack to more than {LARGEST_PARTS / 1e6:g} MB together")
        parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = _refuse_doctype
        parser.StartElementHandler = lambda name, values: handler.start(name.rpartition(":")[2], values)
        parser.EndElementHandler = lambda name: handler.end(name.rpartition(":")[2])
        parser.CharacterDataHandler = handler.text
        try:
            for piece in self._pieces(entry):
                parser.Parse(piece)
            parser.Parse(b"", True)
        except expat.ExpatError as fault:
            raise _UnusableError(f"damaged: {clipped(part)}, {fault}") from fault

    def _pieces(self, entry: zipfile.ZipInfo) -> Iterator[bytes]:
        """No more than the directory says; a wrong checksum is damage."""
        with _damage_named(), self._archive.open(entry) as packed:
            while piece := packed.read(PIECE):
                yield piece


def _refuse_doctype(*_: object) -> None:
    raise _UnusableError("it declares entities, as no spreadsheet program does")


class _Handler:
    """What a part's XML says, element by element."""

    def start(self, name: str, values: dict[str, str]) -> None: ...

    def end(self, name: str) -> None: ...

    def text(self, piece: str) -> None: ...


class _Relations(_Handler):
    def __init__(self) -> None:
        self.sheets: dict[str, str] = {}
        self.strings: str | None = None
        self.styles: str | None = None

    def start(self, name: str, values: dict[str, str]) -> None:
        if name != "Relationship" or values.get("TargetMode") == "External":
            return
        target = values.get("Target", "")
        part = target.lstrip("/") if target.startswith("/") else str(PurePosixPath("xl") / target)
        kind = values.get("Type", "").rpartition("/")[2]
        if kind == "worksheet":
            self.sheets[values.get("Id", "")] = part
        elif kind == "sharedStrings":
            self.strings = part
        elif kind == "styles":
            self.styles = part


class _Book(_Handler):
    def __init__(self) -> None:
        self.sheets: list[tuple[str, str, bool]] = []
        self.from_1904 = False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "sheet":
            key = next((value for key, value in values.items() if key.rpartition(":")[2] == "id"), "")
            self.sheets.append((values.get("name", ""), key, values.get("state", "visible") != "visible"))
        elif name == "workbookPr":
            self.from_1904 = values.get("date1904") in ("1", "true")


class _Strings(_Handler):
    """Texts that cells share, without what is only said of their pronunciation."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._pieces: list[str] = []
        self._inside, self._spoken = False, False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "si":
            self._pieces = []
        self._spoken = self._spoken or name == "rPh"
        self._inside = name == "t" and not self._spoken

    def end(self, name: str) -> None:
        self._inside = False
        if name == "rPh":
            self._spoken = False
        elif name == "si":
            self.texts.append("".join(self._pieces).strip())

    def text(self, piece: str) -> None:
        if self._inside:
            self._pieces.append(piece)


class _Styles(_Handler):
    """Which of the cells' styles show a number as a date."""

    def __init__(self) -> None:
        self.dates: list[bool] = []
        self._formats = {str(key): True for key in BUILT_IN_DATES}
        """Whether a format is a date's, by its key."""
        self._of_cells = False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "numFmt":
            self._formats[values.get("numFmtId", "")] = _is_of_a_date(values.get("formatCode", ""))
        elif name == "cellXfs":
            self._of_cells = True
        elif name == "xf" and self._of_cells:
            self.dates.append(self._formats.get(values.get("numFmtId", "0"), False))

    def end(self, name: str) -> None:
        if name == "cellXfs":
            self._of_cells = False


def _is_of_a_date(code: str) -> bool:
    if len(code) > LONGEST_FORMAT:
        raise _UnusableError(f"a format of {len(code):,} letters; {LONGEST_FORMAT} are allowed")
    return any(letter in "dmyhs" for letter in NO_DATE.sub("", code).lower())


class _Cells(_Handler):
    def __init__(self, sheet: _Sheet, strings: list[str], dates: list[bool], first_day: datetime) -> None:
        self._sheet, self._strings, self._dates, self._first_day = sheet, strings, dates, first_day
        self._row, self._column = 0, -1
        self._kind, self._style, self._has_formula = "n", "0", False
        self._pieces: list[str] = []
        self._inside: Literal["", "v", "t"] = ""
        self._spoken = False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "row":
            self._row = _number(values["r"]) if "r" in values else self._row + 1
            self._column = -1
            self._sheet.hidden_rows += values.get("hidden") in ("1", "true")
        elif name == "c":
            self._column = _address(values["r"])[1] if "r" in values else self._column + 1
            self._kind, self._style = values.get("t", "n"), values.get("s", "0")
            self._has_formula, self._pieces = False, []
        elif name == "f":
            self._has_formula = True
        elif name == "rPh":
            self._spoken = True
        elif name == "v" or (name == "t" and not self._spoken):
            self._inside = name
        elif name == "mergeCell":
            self._merge(values.get("ref", ""))
        elif name == "col" and values.get("hidden") in ("1", "true"):
            self._sheet.hidden_columns += _number(values.get("max", "")) - _number(values.get("min", "")) + 1

    def end(self, name: str) -> None:
        self._inside = ""
        if name == "rPh":
            self._spoken = False
        elif name == "c":
            cell = self._cell("".join(self._pieces))
            if cell != BLANK and (self._row in self._sheet.rows or len(self._sheet.rows) <= MOST_ROWS):
                # One too many of either is enough to refuse it.
                self._sheet.rows.setdefault(self._row, {})[min(self._column, MOST_COLUMNS)] = cell

    def text(self, piece: str) -> None:
        if self._inside:
            self._pieces.append(piece)

    def _cell(self, text: str) -> Cell:
        # A formula whose result is an empty text has t="str"; one without a stored result has nothing.
        if self._has_formula and not text and self._kind != "str":
            return Cell("", "formula")
        if self._kind == "s":
            return Cell(self._strings[_number(text, len(self._strings))]) if text else BLANK
        if self._kind in ("str", "inlineStr"):
            return Cell(text.strip())
        if self._kind == "e":
            return Cell(text.strip(), "error")
        if self._kind == "b":
            return Cell("TRUE" if text.strip() == "1" else "FALSE", "truth")
        if self._kind == "d":
            return Cell(text.strip(), "date")
        return self._numeric(text.strip()) if text.strip() else BLANK

    def _numeric(self, text: str) -> Cell:
        try:
            value = float(text)
        except ValueError:
            raise _UnusableError(f"{clipped(text)!r} stands where a number is stored") from None
        style = _number(self._style)
        if style < len(self._dates) and self._dates[style] and 0 <= value < LAST_DAY:
            return Cell(f"{self._first_day + timedelta(days=value):%Y-%m-%d %H:%M}".removesuffix(" 00:00"), "date")
        return Cell(f"{value:.15g}", "number")

    def _merge(self, reference: str) -> None:
        if len(self._sheet.merged) == MOST_MERGED:
            raise _UnusableError(f"more than {MOST_MERGED:,} merged cells")
        first, _, last = reference.partition(":")
        (row, column), (last_row, last_column) = _address(first), _address(last or first)
        self._sheet.merged.append((row, column, last_row, last_column))


def _address(reference: str) -> tuple[int, int]:
    """Row from 1 and column from 0 of an address such as "B12"."""
    found = REFERENCE.fullmatch(reference)
    if found is None:
        raise _UnusableError(f"{clipped(reference)!r} is no cell's address")
    column = 0
    for letter in found[1]:
        column = 26 * column + ord(letter) - ord("A") + 1
    return int(found[2]), column - 1


def _number(text: str, below: int = 1 << 21) -> int:
    """A count or an index as a part writes it."""
    if not (text.isascii() and text.strip().isdigit() and len(text) < 9) or int(text) >= below:
        raise _UnusableError(f"{clipped(text)!r} stands where a number up to {below - 1} is due")
    return int(text)
