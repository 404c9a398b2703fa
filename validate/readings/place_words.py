"""Places written with a word before their number, such as "Stelle 5" or "Pos. 4"."""

import re
from collections.abc import Sequence

from validate.readings.header_words import PLACE_WORDS, UNIT
from validate.readings.sheet import SheetCell, SheetRow
from validate.readings.text_table import NUMBER, plain_letters

PLACE = re.compile(
    rf"(?P<word>[^\W\d_]+)\.?\s*[:#=]?\s*(?P<number>(?![-+]){NUMBER.pattern})(?:\s?(?P<unit>{UNIT})|\s(?P<other>[^\W\d]\S*))?"
)
LEAST = 2  # Places in a column


def columns_of_places(body: Sequence[SheetRow]) -> dict[int, str]:
    """Return the columns whose numbers all have the same word before them, each with this word."""
    words: dict[int, list[str]] = {}
    for row in body:
        for at, cell in enumerate(row.cells):
            if cell.kind != "text" or any(map(str.isdigit, cell.text)):
                match = PLACE.fullmatch(cell.text) if cell.kind == "text" else None
                words.setdefault(at, []).append("" if match is None else match["word"])
    return {at: each[0] for at, each in words.items() if len(each) >= LEAST and each[0] and len(set(each)) == 1}


def is_place(cell: SheetCell) -> bool:
    """Return whether a cell has a number behind a word for places."""
    match = PLACE.fullmatch(cell.text) if cell.kind == "text" else None
    return match is not None and is_place_word(match["word"])


def is_place_word(word: str) -> bool:
    return plain_letters(word) in PLACE_WORDS


def without_words(body: Sequence[SheetRow], columns: Sequence[int]) -> list[SheetRow]:
    """Return the rows with only the numbers, and units behind them, of places in ``columns``."""

    def bare(cell: SheetCell) -> SheetCell:
        match = PLACE.fullmatch(cell.text) if cell.kind == "text" else None
        return cell if match is None else SheetCell(" ".join(filter(None, match.group("number", "unit", "other"))))

    return [
        SheetRow(row.number, tuple(bare(cell) if at in columns else cell for at, cell in enumerate(row.cells)))
        for row in body
    ]
