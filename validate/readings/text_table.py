"""Sheets and notes in text files: encoding, separator, fields, and numbers with a decimal point or comma."""

import csv
import io
import math
import re
import tomllib
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import lru_cache
from importlib.resources import files as resources
from pathlib import Path

from validate.readings.sheet import Place, SheetCell, SheetGrid, SheetRow, refuse
from validate.settings import Decimal, Separator

UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue"})
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:[.,' \u2019\u00a0\u202f][0-9]{3})+(?:[.,][0-9]*)?")
"""Number whose thousands are separated, or may be."""
AMBIGUOUS = re.compile(r"[+-]?[1-9][0-9]{0,2}([.,])[0-9]{3}")
"""Number such as 1.250: a decimal, or 1250 with a thousands separator. 0.125 can only be a decimal."""
DECIMALS = re.compile(r"[.,]([0-9]+)$")
MINUS = str.maketrans(dict.fromkeys("\u2212\u2013", "-"))
"""The typographic minus, and the dash that word processors substitute for a hyphen."""
WORDS = tomllib.loads(resources("validate").joinpath("readings", "words.toml").read_text(encoding="utf-8"))
"""Words of labs in all languages: units, columns, rows, file names, and notes."""
MISSING = frozenset(WORDS["missing"]["words"].split())
DECIMAL_MARKS: dict[Decimal, str] = {"point": ".", "comma": ","}
SEPARATORS: dict[Separator, str] = {"tab": "\t", "semicolon": ";", "comma": ","}
"""Separators in order of preference if two fit equally well: text contains commas, but rarely tabs."""
NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas"}
BYTE_ORDER_MARKS = (
    (b"\xff\xfe\x00\x00", "utf-32-le", "UTF-32"),
    (b"\xef\xbb\xbf", "utf-8", "UTF-8"),
    (b"\xff\xfe", "utf-16-le", "UTF-16"),
    (b"\xfe\xff", "utf-16-be", "UTF-16"),
)
SEPARATOR_LINE = re.compile(r'"?sep=([;,\t])"?[ \t;,]*(?:\r\n|\r|\n|$)', re.IGNORECASE)
"""First line such as "sep=;", which states the separator for Excel."""
LONGEST_CELL = 200  # Limit on the letters of a cell with several readings
DOT = r"\s*\u00b7\s*"
BETWEEN = (r"\s*;\s*", r"\s*\|\s*", r"\s*/\s*", DOT, r"\s*,\s+", ",", r"\s+")
"""Separators of several readings in one cell, as regular expressions; a cell has one of them."""
NOTE_HEAD = (SheetCell("s"), SheetCell("reading"))
"""Header of a note, whose lines have no names."""
LOST_LINE = re.compile(r"^\0+\s*$", re.MULTILINE)
ZEROS = 0.5
"""Share of zero bytes above which they are the high bytes of UTF-16. In European scripts nearly all of these are
zero."""


def plain_letters(text: str) -> str:
    """Return the text in lower case, umlauts spelt out (ä is ae) and other accents removed (é is e, ñ is n)."""
    folded = unicodedata.normalize("NFKC", text).casefold().translate(UMLAUTS)
    return "".join(letter for letter in unicodedata.normalize("NFD", folded) if unicodedata.category(letter) != "Mn")


def is_missing(text: str) -> bool:
    """Return whether a cell is blank or contains a word for a missing reading."""
    return not text or "".join(plain_letters(text).split()) in MISSING


def without_missing(text: str, words: Sequence[str]) -> str:
    """Return the text of a cell without declared words for a missing reading: blank, or "?" among other readings."""
    either = "|".join(map(re.escape, sorted(words, key=len, reverse=True)))
    marked = re.sub(rf"(?<![^\s;,|/\u00b7])(?:{either})(?![^\s;,|/\u00b7])", "?", text)
    return "" if text in words else marked if several(marked) else text


def unread_word(text: str) -> str:
    """Return the word among the readings of a cell that is no number; the whole text if there are no readings."""
    parts = [part for part in re.split(r"\s*[;|/\u00b7]\s*|,?\s+", text) if part and not is_missing(part)]
    words = [part for part in parts if not NUMBER.fullmatch(part.translate(MINUS))]
    return words[0] if len(words) == 1 < len(parts) else text


def is_ambiguous(text: str) -> bool:
    """Return True if the comma or point in a number may be either a decimal mark or a thousands separator."""
    return AMBIGUOUS.fullmatch(text.translate(MINUS)) is not None


def is_grouped(text: str) -> bool:
    """Return whether a number has, or may have, separated thousands."""
    return GROUPED.fullmatch(text.translate(MINUS)) is not None


def common_mark(texts: Iterable[str], separator: str | None) -> Decimal | None:
    """Return the decimal mark of a file's numbers, or None if they do not decide it.

    A comma as the field separator excludes decimal commas.
    """
    texts = list(texts)
    numbers = [text for text in texts if NUMBER.fullmatch(text.translate(MINUS)) and not is_ambiguous(text)]
    points, commas = (sum(mark in text for text in numbers) for mark in ".,")
    if points or commas:
        return "comma" if commas > points else "point"
    if separator == "," and not any("," in text for text in texts):
        return "point"
    return None


def number(text: str, mark: Decimal | None) -> float | None:
    """Return a finite number with the decimal ``mark``, or with either mark if it is None. Other texts give None."""
    text = text.translate(MINUS)
    if not NUMBER.fullmatch(text):
        return None
    if mark is not None and DECIMAL_MARKS["point" if mark == "comma" else "comma"] in text:
        return None
    value = float(text.replace(",", "."))
    return value if math.isfinite(value) else None


@lru_cache(maxsize=4096)
def several(text: str, *, by_commas: bool = False) -> tuple[str, ...]:
    """Return the readings in a cell that has several, such as "12,3 12,1 n.m."; else ().

    They are separated by blanks, semicolons, slashes, middle dots, or commas with a blank. Commas alone separate only
    numbers that all have a decimal point, unless ``by_commas``. A fraction, a date or a number with separated thousands
    is none.
    """
    text = text.strip()
    possible = len(text) <= LONGEST_CELL and any(map(str.isdecimal, text)) and not is_grouped(text)
    for separator in BETWEEN if possible else ():
        parts = [part.strip() for part in re.split(separator, text.rstrip(";|"))]
        numbers = [part for part in parts if NUMBER.fullmatch(part.translate(MINUS))]
        # A dash between blanks may mean a range, a slash between whole numbers a fraction or a date.
        words = all(any(map(str.isalpha, part)) or part == "?" for part in parts if part not in numbers)
        marked = any(mark in part for part in numbers for mark in ".,")
        sound = {",": by_commas or all("." in part for part in parts), r"\s*/\s*": marked, DOT: marked, r"\s+": words}
        good = all(part in numbers or is_missing(part) for part in parts) and sound.get(separator, True)
        if len(parts) > 1 and numbers and good:
            return tuple(parts)
    return ()


def commas_may_separate(texts: Iterable[str]) -> bool:
    """Return whether the comma in texts such as "11,12" may separate two readings of a station, which are alike.

    Of decimals, the two parts differ: in most lines by more than a factor of two, or by a leading zero.
    """
    pairs = [text.split(",") for text in texts]
    if not pairs or any(len(pair) != 2 or not all(map(str.isdecimal, pair)) for pair in pairs):
        return False
    if any(part.startswith("0") and len(part) > 1 for _, part in pairs):
        return False
    alike = [max(map(int, pair)) <= 2 * min(map(int, pair)) for pair in pairs]
    return 2 * sum(alike) >= len(alike)


def decimals_of(text: str) -> int:
    """Return the number of decimals of a number, without trailing zeros."""
    match = DECIMALS.search(text)
    return len(match[1].rstrip("0")) if match else 0


def read_delimited(path: Path, content: bytes, separator: Separator | None) -> SheetGrid:
    """Return the rows of a text file. Raises SheetFaults if it is not a table."""
    text, encoding = decoded(path, content)
    if (lost := LOST_LINE.search(text)) is not None:
        where = Place(path, row=1 + text.count("\n", 0, lost.start()))
        raise refuse(
            where, "NUL bytes, which a logger writes when it loses power.", "Delete them, and check for lost readings."
        )
    stated = SEPARATOR_LINE.match(text)
    if stated is not None:
        text = text[stated.end() :]
    mark = SEPARATORS[separator] if separator is not None else stated[1] if stated is not None else _likeliest(text)
    try:
        lines = _fields(text, mark)
    except csv.Error as fault:
        raise refuse(Place(path), f"not a CSV ({fault}).", "Save the sheet as 'CSV UTF-8'.") from fault
    skipped = 0 if stated is None else 1
    if quoted := next((number for number, fields in lines if any(_holds_rows(field, mark) for field in fields)), None):
        raise refuse(
            Place(path, row=skipped + quoted),
            "a quotation mark of an earlier line closes here, and the quoted text contains rows of numbers.",
            "Delete both marks, or the line breaks between them.",
        )
    # Lines may end with a million separators of empty columns.
    width = max((_width(fields) for _, fields in lines), default=0)
    rows = tuple(SheetRow(skipped + number, tuple(map(SheetCell, fields[:width]))) for number, fields in lines)
    return SheetGrid(path, rows, ("CSV", encoding, NAMES[mark]), separator=mark)


def _width(fields: list[str]) -> int:
    """Return the number of fields up to the last one with content."""
    return next((count for count in range(len(fields), 0, -1) if fields[count - 1]), 0)


def decoded(path: Path, content: bytes) -> tuple[str, str]:
    """Return the text and the name of its encoding."""
    high, low = (content[start::2].count(0) / max(1, len(content) // 2) for start in (1, 0))
    # Latin-1 is Windows-1252 with control characters in place of some letters.
    possible = {"UTF-8": "utf-8", "Windows-1252": "cp1252"}
    if marked := next((each for each in BYTE_ORDER_MARKS if content.startswith(each[0])), None):
        mark, codec, name = marked
        content, possible = content[len(mark) :], {name: codec}
    elif high > ZEROS > 2 * low or low > ZEROS > 2 * high:
        possible = {"UTF-16 without a mark": "utf-16-le" if high > low else "utf-16-be"}
    for name, codec in possible.items():
        try:
            return content.decode(codec), name
        except UnicodeDecodeError:
            continue
    raise refuse(Place(path), f"not a text in {' or '.join(possible)}.", "Save the sheet as 'CSV UTF-8' or XLSX.")


def _likeliest(text: str) -> str:
    """Return the separator that splits the most rows into the same number of fields."""
    alike = {}
    for mark in SEPARATORS.values():
        try:
            widths = Counter(len(row) for _, row in _fields(text, mark))
        except csv.Error:
            # Wrongly closed quotes exclude this separator.
            continue
        alike[mark] = max((count for width, count in widths.items() if width > 1), default=0)
    return max(alike, key=alike.__getitem__) if any(alike.values()) else ","


def _fields(text: str, mark: str) -> list[tuple[int, list[str]]]:
    """Return line numbers and fields of lines with content. Raises csv.Error with the line where a row begins."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark, strict=True)
    lines, begins = [], 1
    try:
        for row in reader:
            if any(map(str.strip, row)):
                lines.append((reader.line_num, [field.strip() for field in row]))
            begins = reader.line_num + 1
    except csv.Error as fault:
        raise csv.Error(f"{fault}: is a quotation mark of line {begins} not closed?") from fault
    return lines


def _holds_rows(field: str, mark: str) -> bool:
    """Return whether a quoted field has, after its first line, a line with two or more numbers."""
    return any(
        sum(number(part.strip(), None) is not None for part in line.split(mark)) > 1 for line in field.splitlines()[1:]
    )
