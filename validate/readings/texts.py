"""Text files of readings: delimited tables, notes, tables in Markdown, and places with readings on lines below them."""

import re
from collections import Counter
from pathlib import Path

from validate.readings.note_lines import note_rows
from validate.readings.sheet import SheetCell, SheetGrid, SheetRow
from validate.readings.text_table import (
    LOST_LINE,
    MINUS,
    NOTE_HEAD,
    NUMBER,
    SEPARATOR_LINE,
    decoded,
    is_missing,
    read_delimited,
    several,
)
from validate.settings import Separator

RULE = re.compile(r"\|?\s*:?-{2,}:?\s*(?:\|\s*:?-{2,}:?\s*)*\|?")
"""Line below the names of a Markdown table."""
PLACE_LINE = re.compile(
    rf"(?P<word>[^\W\d_]{{0,12}}\.?)\s*=?\s*(?P<place>{NUMBER.pattern})\s?(?P<unit>[^\W\d_]{{0,12}})\s*(?P<colon>:?)"
)
LEAST = 2  # Places of a note
ONE_WORD = re.compile(r"\S+")


def read_text(path: Path, content: bytes, separator: Separator | None) -> SheetGrid:
    """Return the rows of a text file. Raises SheetFaults if it is not a table."""
    if separator is None:
        text, encoding = decoded(path, content)
        if rows := _markdown_rows(text):
            return SheetGrid(path, rows, ("Markdown", encoding, "a table"), separator="|")
        if rows := _listed_rows(text):
            return SheetGrid(path, rows, ("note", encoding, "readings below their place"), is_note=True)
        is_stated = SEPARATOR_LINE.match(text) is not None or LOST_LINE.search(text) is not None
        rows, minus = ((), {}) if is_stated else note_rows(text)
        if rows:
            written = ("note", encoding, "a place and its readings in each line")
            return SheetGrid(path, rows, written, is_note=True, minus=minus)
    return read_delimited(path, content, separator)


def _markdown_rows(text: str) -> tuple[SheetRow, ...]:
    """Return the rows of a text with a Markdown table; () for another text. Lines beside the table are one cell."""
    lines = _lines(text)
    if not any("|" in line and RULE.fullmatch(line) for _, line in lines):
        return ()
    rows = [(number, line) for number, line in lines if not RULE.fullmatch(line)]
    return tuple(SheetRow(number, tuple(map(SheetCell, _fields(line)))) for number, line in rows)


def _lines(text: str) -> list[tuple[int, str]]:
    """Return the lines that are not blank, with their numbers."""
    return [(number, line.strip()) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]


def _fields(line: str) -> list[str]:
    return [field.strip() for field in line.removeprefix("|").removesuffix("|").split("|")]


def _listed_rows(text: str) -> tuple[SheetRow, ...]:
    """Return the rows of a note whose places have lines of their own, with readings on the lines below.

    Place lines are alike, and differ from readings by a word, a unit or a colon. Returns () for another text. A line
    that does not fit is part of the readings of its place, so that it is a fault.
    """
    lines = _lines(text)
    forms = {number: _form(line) for number, line in lines}
    usual = Counter(filter(None, forms.values())).most_common(1)
    places = [number for number, _ in lines if usual and forms[number] == usual[0][0]]
    readings = [number for number, line in lines if places and number > places[0] and _is_reading(line)]
    below = [number for number, _ in lines if places and number >= places[0]]
    if len(places) < LEAST or len(readings) < len(places) or 2 * len({*readings, *places}) <= len(below):
        return ()
    # Readings above the first place are rows without a place, so that they are a fault.
    begin = min(number for number, line in lines if number == places[0] or _is_reading(line))
    above = [(number, line) for number, line in lines if number < places[0]]
    rows = [
        SheetRow(number, tuple(map(SheetCell, ("", line) if number >= begin else (line,)))) for number, line in above
    ]
    rows.append(SheetRow(begin, NOTE_HEAD))
    listed = {number: list[str]() for number in places}
    for number, line in lines:
        if number >= places[0] and number not in listed:
            own = max(place for place in places if place < number)
            if _is_reading(line) or ONE_WORD.fullmatch(line) or any(map(str.isdigit, line)):
                listed[own].append(line)
            else:
                rows.append(SheetRow(number, (SheetCell(line),)))
    by_number = dict(lines)
    rows += [
        SheetRow(number, (SheetCell(_place(by_number[number])), SheetCell("; ".join(each))))
        for number, each in listed.items()
    ]
    return tuple(sorted(rows, key=lambda row: (row.number, row.cells != NOTE_HEAD)))


def _form(line: str) -> tuple[str, ...] | None:
    """Return the word, the unit and the colon of a line that may be a place; None for another line."""
    match = PLACE_LINE.fullmatch(line)
    form = () if match is None else match.group("word", "unit", "colon")
    return form if any(form) else None


def _place(line: str) -> str:
    match = PLACE_LINE.fullmatch(line)
    return "" if match is None else " ".join(filter(None, match.group("place", "unit")))


def _is_reading(line: str) -> bool:
    return NUMBER.fullmatch(line.translate(MINUS)) is not None or is_missing(line) or bool(several(line))
