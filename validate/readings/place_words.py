"""Places written with words around their number, such as "Stelle 5", "Surface point 5 mm" or "PNT(5)"."""

import re
from collections.abc import Sequence

from validate.readings.header_words import PLACE_WORDS, SAMPLE, UNIT, WORD
from validate.readings.sheet import SheetCell, SheetRow
from validate.readings.text_table import NUMBER, number, plain_letters

PLACE = re.compile(
    rf"(?P<word>[^\W\d_][^\d]{{0,60}}?)(?P<number>(?<![-+\u2212\u2013])(?<![-+\u2212\u2013]\s)(?<!\s[.,])[0-9]+(?:[.,][0-9]+)?)"
    rf"(?:\s?(?P<unit>{UNIT})|\s(?P<other>[^\W\d]\S*))?[\s)\]:.]*"
)
"""Text with a single number, behind words. A sign before it may be a minus, or a dash."""
NUMBERS = re.compile(r"(?<![\d.,])" + NUMBER.pattern)
LEAST = 2  # Places in a column


def columns_of_places(body: Sequence[SheetRow]) -> dict[int, str]:
    """Return the columns whose numbers all have the same words around them, each with those before the number."""
    words: dict[int, list[tuple[str, str]]] = {}
    for row in body:
        for at, cell in enumerate(row.cells):
            if cell.kind != "text" or any(map(str.isdigit, cell.text)):
                words.setdefault(at, []).append(_around(cell))
    return {at: each[0][0] for at, each in words.items() if len(each) >= LEAST and each[0][0] and len(set(each)) == 1}


def _around(cell: SheetCell) -> tuple[str, str]:
    """Return the words before the number of a place, and the text behind it that is no unit; empty for no place."""
    match = PLACE.fullmatch(cell.text) if cell.kind == "text" else None
    return ("", "") if match is None else (match["word"].strip(" .,:#=([_"), match["other"] or "")


def is_place(cell: SheetCell) -> bool:
    """Return whether a cell has a number behind a word for places."""
    return is_place_word(_around(cell)[0])


def may_be_place(cell: SheetCell) -> bool:
    """Return whether a cell has a number behind any words."""
    return bool(_around(cell)[0])


def is_place_word(words: str) -> bool:
    parts = set(WORD.findall(plain_letters(words)))
    return bool(parts & PLACE_WORDS) and not parts & SAMPLE


def only_number(cell: SheetCell) -> float | None:
    """Return the number of a cell, also with words around it; None if it has none or several."""
    numbers = NUMBERS.findall(cell.text) if cell.kind in ("text", "number") else []
    return number(numbers[0], None) if len(numbers) == 1 else None


def without_words(body: Sequence[SheetRow], columns: Sequence[int]) -> list[SheetRow]:
    """Return the rows with only the numbers, and units behind them, of places in ``columns``."""

    def bare(cell: SheetCell) -> SheetCell:
        match = PLACE.fullmatch(cell.text) if cell.kind == "text" else None
        return cell if match is None else SheetCell(" ".join(filter(None, match.group("number", "unit", "other"))))

    return [
        SheetRow(row.number, tuple(bare(cell) if at in columns else cell for at, cell in enumerate(row.cells)))
        for row in body
    ]
