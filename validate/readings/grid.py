"""Read the cells of a sheet with their marks, and other content of its file, which is a text file or a workbook."""

import csv
import io
import re
import warnings
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from operator import itemgetter
from pathlib import Path
from typing import Literal, NamedTuple, Self

from sealtwin.core.doubts import Doubt, Location, ReadSheet
from sealtwin.core.errors import InputError, as_text
from sealtwin.core.plain_files import opened
from validate.readings.words import number
from validate.settings import Separator

Kind = Literal["text", "number", "date", "truth", "error", "formula"]
"""Kind of a cell. All cells of a text file are "text". A "formula" is a formula without a stored result."""
MAX_ROWS = 10_100  # Largest number of rows: 10,000 stations below a header and titles
MAX_COLUMNS = 256  # Largest number of columns with content. A sheet of readings has fewer.
MAX_NAMED = 8  # Largest number of cells or columns that a sentence names
LONGEST_SHOWN = 60  # Largest number of characters of a cell that are quoted
SAVE_AGAIN = "Open it in a spreadsheet program and save it as XLSX, or as CSV."
LARGEST_FILE_BYTES = 5_000_000  # Largest size of a sheet, or of a workbook with its pictures
LARGEST_UNPACKED_MB = 32  # Largest size of all parts together. 10,000 rows of 32 numbers take 13 MB.
SMALLER = "Remove pictures and other tables from it, or save it as CSV."
ZIP = b"PK\x03\x04"
OLD_EXCEL = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"  # First bytes of .xls, and of an XLSX with a password
OTHER_FORMAT = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*(<!doctype html|<html|<table|<\?xml|mime-version:|\{\\rtf|\{\"|%pdf-|bplist|sqlite format"
    rb"|\x1f\x8b|rar!|7z\xbc\xaf)",
    re.IGNORECASE,
)
"""First bytes of pages, texts, databases and archives that programs export under the file extension of a sheet."""
SEPARATORS: dict[Separator | None, str] = {"tab": "\t", "semicolon": ";", "comma": ","}
"""Separators. If two fit equally well, the first one is taken, because text contains commas, but rarely tabs."""
UTF_16_MARKS = b"\xff\xfe", b"\xfe\xff"
COMMENT = re.compile(r"^[ \t]*(?:#|//|%)+[ \t]*(?![ \t#/%+\-.,\d])", re.MULTILINE)
"""Signs of a comment at the begin of a line. Programs write a header, notes and names behind them. A number behind them
belongs to a reading that somebody took out."""
KANA = re.compile(r"[\u3041-\u30fe]{2}")  # Japanese letters, each of which has two bytes in Shift-JIS
SEPARATOR_LINE = re.compile(r'"?sep=([;,\t])"?[ \t;,]*(?:\r\n|\r|\n|$)', re.IGNORECASE)
"""First line such as "sep=;", which tells Excel the separator."""


class Cell(NamedTuple):
    text: str  # Content without surrounding blanks. A workbook's numbers have a decimal point and up to 15 digits.
    kind: Kind = "text"
    unit: str = ""  # Text that a number's format shows after the number, such as "cm" or "%"
    is_formula: bool = False  # True if a formula gives the content
    is_struck: bool = False
    colours: str = ""  # Colours of fill and font. Empty for black on white.


BLANK = Cell("")
FORMULA = Cell("", "formula", is_formula=True)


@dataclass(frozen=True, eq=False)
class Grid:
    """The cells of a sheet, and the other content of its file."""

    path: Path
    written: tuple[str, ...]  # Format of the file in words: ("CSV", "UTF-16", "semicolons")
    rows: dict[int, dict[int, Cell]] = field(default_factory=dict)
    """Cells that are not blank, by row number from 1, then by column from 0, both increasing."""
    separator: str | None = None  # Separator of a text file
    sheet: str | None = None  # Name of a workbook's sheet
    is_hidden: bool = False
    comments: list[tuple[int, int, str]] = field(default_factory=list)  # Row from 1, column from 0, and text
    merged: set[tuple[int, int]] = field(default_factory=set)
    """First cells of merged cells, each as row from 1 and column from 0."""

    hidden_rows: set[int] = field(default_factory=set)
    hidden_columns: set[int] = field(default_factory=set)
    elsewhere: list[tuple[str, str]] = field(default_factory=list)
    """Other texts of a workbook, each with its location: ("sheet 'Notes', row 1", "all in cm"), ("page header",
    "P01")."""

    doubts: tuple[Doubt, ...] = ()  # Questions about the file

    def require_size(self) -> Self:
        """Return the sheet. Raises SheetFaults if it has more rows or columns than a sheet of readings may have."""
        if len(self.rows) > MAX_ROWS:
            finding = f"the sheet has more than {MAX_ROWS} rows, which is the limit. A scan is given as readings.scan."
            raise refused(self.location(), finding, "Use fewer stations.")
        for row, cells in self.rows.items():
            if max(cells) >= MAX_COLUMNS:
                finding = f"the sheet has more than {MAX_COLUMNS} columns, which is the limit."
                raise refused(self.location(row), finding, "Delete everything outside the table.")
        return self

    def cell(self, row: int, column: int) -> Cell:
        return self.rows.get(row, {}).get(column, BLANK)

    def texts(self, row: int) -> tuple[str, ...]:
        """Return the texts of a row, from the first column on."""
        return tuple(self.cell(row, column).text for column in range(max(self.rows.get(row, {}), default=-1) + 1))

    def location(self, row: int | None = None) -> Location:
        """Return the location of the sheet, or of a row of it."""
        parts = [] if self.sheet is None else [f"sheet {quoted(self.sheet)}"]
        return Location(Path(as_text(self.path)), ", ".join(parts if row is None else [*parts, f"row {row}"]))

    def drop_zeros(self, *, never_calculated: bool = False) -> None:
        """Mark formulas as never calculated if the program that wrote the file stored zeros as their results.

        This is assumed if the file says so (``never_calculated``), or if there are several formulas and all results are
        0.
        """
        cells = [(row, column, cell) for row in self.rows.values() for column, cell in row.items() if cell.is_formula]
        zeros = [(row, column) for row, column, cell in cells if cell.text in ("0", "-0")]
        if never_calculated or 1 < len(zeros) == len(cells):
            for row, column in zeros:
                row[column] = FORMULA

    def all_texts(self) -> Iterator[tuple[str, str]]:
        """Yield the texts of a worksheet with their locations. The texts of a row are joined."""
        sheet = f"sheet {quoted(f'{self.sheet}')}"
        yield from ((f"{sheet}, {part}", text) for part, text in self.elsewhere)
        for row, _, text in self.comments:
            yield f"{sheet}, comment in row {row}", text
        for row, cells in self.rows.items():
            if words := [cell.text for cell in cells.values() if cell.text]:
                yield f"{sheet}, row {row}", " ".join(words)


class SheetFaults(InputError):  # noqa: N818  The class contains all questions about a sheet, not one error.
    """All questions about a sheet in one error, and the sheet as far as it was understood."""

    def __init__(self, doubts: Sequence[Doubt], understood: ReadSheet | None = None) -> None:
        self.doubts, self.understood = tuple(doubts), understood
        super().__init__("\n".join(map(str, self.doubts)))


def read_grid(path: Path, sheet: str | None = None, separator: Separator | None = None) -> Grid:
    """Return the rows with content of a CSV, or of one sheet of an XLSX.

    Raises SheetFaults if the file has another format, or if several sheets have a table and ``sheet`` names none of
    them. Raises InputError if the file cannot be opened.
    """
    content = _content(path)
    if not content.startswith(ZIP):
        if sheet is None:
            return _read_text(path, content, separator).require_size()
        finding = f"this is a text file, which has no sheets, but [readings] has sheet = {sheet!r}."
        raise refused(path, finding, "Remove this setting, or give the workbook.")
    from validate.readings import workbooks

    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
        if (unpacked_mb := sum(entry.file_size for entry in archive.infolist()) / 1e6) > LARGEST_UNPACKED_MB:
            raise refused(path, f"{unpacked_mb:.0f} MB when it is unpacked (limit: {LARGEST_UNPACKED_MB} MB).", SMALLER)
        # openpyxl warns about skipped styles and extensions, which contain no readings.
        with warnings.catch_warnings(action="ignore"):
            if "[Content_Types].xml" not in archive.namelist():
                raise refused(path, "this is an ODS or another archive, but only XLSX workbooks are read.", SAVE_AGAIN)
            sheets = [*workbooks.read_xlsx(path, archive, content)]
    except SheetFaults:
        raise
    except Exception as fault:  # Damaged files raise errors of any class.
        cause = fault.__cause__ or fault
        finding = f"the file is damaged, or it is not a workbook ({type(cause).__name__}: {printable(str(cause))})."
        raise refused(path, finding, SAVE_AGAIN) from fault
    return _chosen(path, sheets, sheet).require_size()


def table_of(path: Path) -> tuple[tuple[str, ...], list[tuple[int, list[tuple[str, str]]]]]:
    """Return the names in the first row of a table, and for each other row its number and its cells with their names.

    Raises InputError if the file cannot be read.
    """
    grid = read_grid(path)
    first, *rows = grid.rows or [1]
    head = grid.texts(first)
    return head, [(row, [*zip_longest(head, grid.texts(row), fillvalue="")]) for row in rows]


def _content(path: Path) -> bytes:
    """Return the bytes of a file. Raises InputError if it is not a file, and SheetFaults if it has another format."""
    try:
        with opened(path) as file:
            content = file.read(LARGEST_FILE_BYTES + 1)
    except OSError as fault:
        finding = f"the readings cannot be opened ({fault.strerror})."
        raise InputError(f"{as_text(path)}: {finding} Give the sheet's path in [readings] file.") from fault
    if len(content) > LARGEST_FILE_BYTES:
        raise refused(path, f"the file is larger than {LARGEST_FILE_BYTES:,} bytes.", SMALLER)
    if content.startswith(OLD_EXCEL):
        raise refused(path, "this is an old Excel workbook (.xls), or one with a password.", SAVE_AGAIN)
    if other := OTHER_FORMAT.match(content):
        finding = f"the file is not a sheet, although its name says so: it begins with {other[1].decode('latin-1')!r}."
        raise refused(path, finding, SAVE_AGAIN)
    return content


def _read_text(path: Path, content: bytes, separator: Separator | None) -> Grid:
    """Return the rows of a CSV by line number. Raises SheetFaults if it is not a table."""
    text, encoding = _decoded(path, content)
    text = COMMENT.sub("", text)
    if "\0" in text:
        finding = "the file has NUL bytes: a logger lost power, or the text is UTF-16 without its mark."
        raise refused(path, finding, "Save it as 'CSV UTF-8', and check for lost readings.")
    if (stated := SEPARATOR_LINE.match(text)) is not None:
        text = "\n" + text[stated.end() :]
    mark = SEPARATORS.get(separator) or (stated and stated[1])
    parted = "" if mark else _parted_by_blanks(text)
    text, mark = parted or text, mark or ("\t" if parted else _likeliest(text))
    try:
        lines = _fields(text, mark)
    except csv.Error as fault:
        raise refused(path, f"the file is not a CSV ({fault}).", "Save the sheet as 'CSV UTF-8'.") from fault
    rows = {}
    for line, fields in lines.items():
        within = [line for field in fields for line in field.splitlines()[1:]]
        if any(re.search(rf"[0-9]\s?{mark}\s?[-+.,0-9]", line) for line in within):
            finding = "a quotation mark of an earlier line is closed here, and rows of numbers are in between."
            where = Location(Path(as_text(path)), f"line {line}")
            raise refused(where, finding, "Delete both marks, or the line breaks between them.")
        rows[line] = {column: Cell(text) for column, text in enumerate(fields) if text}
    names = {"\t": "blanks" if parted else "tabs", ";": "semicolons", ",": "commas"}
    return Grid(path, ("CSV", encoding, names[mark]), rows, mark)


def _decoded(path: Path, content: bytes) -> tuple[str, str]:
    """Return the decoded text and the name of its encoding."""
    # Latin-1 is Windows-1252 with control characters in place of some letters.
    codecs = {"UTF-8": "utf-8-sig", "Windows-1252": "cp1252"}
    for name, codec in {"UTF-16": "utf-16"}.items() if content.startswith(UTF_16_MARKS) else codecs.items():
        with suppress(UnicodeDecodeError):
            text = content.decode(codec)
            if name == "Windows-1252" and KANA.search(content.decode("cp932", "replace")):
                raise refused(path, "the text is in Shift-JIS.", "Save the sheet as 'CSV UTF-8' or XLSX.")
            return text, name
    raise refused(path, "the text is not in UTF-8, UTF-16 or Windows-1252.", "Save the sheet as 'CSV UTF-8' or XLSX.")


def _parted_by_blanks(text: str) -> str:
    """Return the text with tabs between its columns if blanks part most lines into numbers, else "".

    A line with as many parts as the numbers, or with as many parts between several blanks, is parted too.
    """
    lines = [line.strip() for line in text.split("\n")]
    rows = [parts for line in lines if (parts := line.split()) and all(number(part) is not None for part in parts)]
    width, count = max(Counter(map(len, rows)).items(), key=itemgetter(1), default=(0, 0))
    if "\t" in text or width < 2 or 2 * count <= sum(map(bool, lines)):
        return ""
    ways = ((re.split(r"\s{2,}", line), re.split(r"(?<=[\])])\s+", line), line.split(), [line]) for line in lines)
    return "\n".join("\t".join(next((way for way in of_line if len(way) == width), of_line[-1])) for of_line in ways)


def _likeliest(text: str) -> str:
    """Return the separator that splits the most rows into the same number of fields."""
    alike = {}
    for mark in SEPARATORS.values():
        # A separator with which quotation marks are wrongly closed is left out.
        with suppress(csv.Error):
            widths = Counter(map(len, _fields(text, mark).values()))
            alike[mark] = max((count for width, count in widths.items() if width > 1), default=0)
    return max(alike, key=alike.__getitem__) if any(alike.values()) else ","


def _fields(text: str, mark: str) -> dict[int, list[str]]:
    """Return the fields of each line with content, by line number.

    Raises csv.Error, which names the line where a row begins.
    """
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark, strict=True)
    lines, begins = {}, 1
    try:
        for row in reader:
            if any(map(str.strip, row)):
                lines[reader.line_num] = [field.strip() for field in row]
            begins = reader.line_num + 1
    except csv.Error as fault:
        raise csv.Error(f"{fault}: is a quotation mark of line {begins} not closed?") from fault
    return lines


def _chosen(path: Path, sheets: Sequence[Grid], wanted: str | None) -> Grid:
    """Return the sheet ``wanted``, or the only visible sheet with a table. Unless there is exactly one, ask for it."""
    filled = [sheet for sheet in sheets if sheet.rows]
    if not filled:
        finding = "the file has no readings: all sheets are empty, or it was saved as Strict Open XML."
        raise refused(path, finding, "Save it with its cells as an ordinary XLSX.")
    tables = [sheet for sheet in filled if _has_table(sheet)] or filled
    chosen = [sheet for sheet in tables if not sheet.is_hidden]
    named, finding = chosen or tables, f"{'several' if chosen else 'only hidden'} sheets may contain the readings:"
    if wanted is not None:
        chosen = [sheet for sheet in sheets if sheet.sheet == wanted]
        named, finding = sheets, f"has no sheet {quoted(wanted)}, only"
    doubts: tuple[Doubt, ...] = ()
    if len(chosen) != 1:
        finding += f" {listed([quoted(f'{sheet.sheet}') for sheet in named])}."
        doubts = (Doubt("sheet", Location(Path(as_text(path))), finding, answers={"sheet": None}),)
    # The first sheet is used meanwhile, so that all other questions are asked at the same time.
    sheet = (chosen or named)[0]
    # Sheets that may contain the readings of another sample do not count as remarks on this sample.
    others = [other for other in sheets if other is not sheet and (other.is_hidden or other not in tables)]
    elsewhere = [*sheet.elsewhere, *(text for other in others for text in other.all_texts())]
    rows = {row: dict(sorted(cells.items())) for row, cells in sorted(sheet.rows.items())}
    return replace(sheet, rows=rows, elsewhere=elsewhere, doubts=doubts)


def _has_table(sheet: Grid) -> bool:
    """Return True if at least two rows of a sheet have two numbers."""
    rows = [
        [cell for cell in cells.values() if cell.kind == "formula" or number(cell.text) is not None]
        for cells in sheet.rows.values()
    ]
    return sum(len(numbers) > 1 for numbers in rows) > 1


def refused(where: Location | Path, finding: str, remedy: str) -> SheetFaults:
    """Return the error for a single fault that ends reading. ``where`` may be the path of the file."""
    where = Location(Path(as_text(where))) if isinstance(where, Path) else where
    return SheetFaults([Doubt("file", where, finding, remedy)])


def letters(column: int) -> str:
    """Return the letters of a column as in a spreadsheet: 0 is A, 26 is AA."""
    above, last = divmod(column, 26)
    return (letters(above - 1) if above else "") + chr(ord("A") + last)


def column_of(name: str) -> int:
    """Return the number of a column from its letters. A is 0."""
    column = 0
    for letter in name:
        column = 26 * column + ord(letter) - ord("A") + 1
    return column - 1


def clipped(text: str, longest: int = LONGEST_SHOWN) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"


def quoted(text: str, longest: int = LONGEST_SHOWN) -> str:
    """Return the text in quotation marks, shortened and with escapes."""
    return repr(clipped(text, longest))


def listed(texts: Sequence[str], most: int = MAX_NAMED) -> str:
    """Return the first texts as a list in a sentence, and the number of the remaining ones."""
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return ", ".join(texts[:most]) + more


def printable(text: str) -> str:
    """Return the text shortened to one line, with escapes for characters that cannot be printed."""
    text = clipped(text)
    return text if text.isprintable() else repr(text)
