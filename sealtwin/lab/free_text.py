"""Texts of a lab's own, as .txt and .md: what kind each is, and the settings that its sentences seem to say."""

import re
from pathlib import Path
from typing import Any, Literal

from sealtwin.core.errors import InputError
from sealtwin.lab.note_words import BY_WORD, known_keys, normal, read_value
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetRow
from validate.readings.table_rows import is_a_number
from validate.settings import Declared

LARGEST_READ_BYTES = 200_000
MOST_FOUND = 20
LONGEST_PHRASE = 200
PHRASES = re.compile(r"[;\n]|,(?!\d)|\.(?=\s|$)")
"""Ends of phrases; a comma or a point before a digit belongs to a number."""


def kind_of_text(path: Path) -> Literal["readings", "note", "text"]:
    """Return whether a text is a table of readings, a table of words and values, or free text."""
    try:
        grid = read_cells(path, Declared())
    except InputError:
        return "text"
    numbers = sum(sum(map(is_a_number, row.cells)) > 1 for row in grid.rows)
    if numbers > 1 and grid.separator is not None and path.suffix.lower() == ".txt":
        return "readings"
    return "note" if grid.rows and any(map(_is_setting, grid.rows)) and all(map(_is_pair, grid.rows)) else "text"


def settings_in(path: Path) -> list[tuple[str, Any]]:
    """Return the settings, by dotted key, that phrases of a text seem to say, as "Tiefe 16 mm" does."""
    try:
        text = path.read_bytes()[:LARGEST_READ_BYTES].decode("utf-8", errors="replace")
    except OSError:
        return []
    found: dict[str, Any] = {}
    for phrase in PHRASES.split(text):
        words = phrase.replace(":", " ").replace("=", " ").split()
        if len(phrase) > LONGEST_PHRASE or len(words) < 2:
            continue
        for count in range(min(4, len(words) - 1), 0, -1):
            known = BY_WORD.get(normal(" ".join(words[:count])))
            if known is None or known.kind in ("text", "list"):
                continue
            try:
                found.setdefault(known.key, read_value(known, " ".join(words[count:]), ""))
            except ValueError:
                continue
            break
    return list(found.items())[:MOST_FOUND]


def _is_pair(row: SheetRow) -> bool:
    return sum(bool(cell.text) for cell in row.cells) in (2, 3)


def _is_setting(row: SheetRow) -> bool:
    word = row.cell(0).text.rstrip(": ")
    return word in known_keys() or normal(word.partition("[")[0].partition("(")[0]) in BY_WORD
