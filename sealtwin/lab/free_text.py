"""Texts of a lab's own, as .txt and .md: what kind each is, and what its sentences seem to say."""

import re
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import opened
from sealtwin.lab.fill_sheet import is_fill
from sealtwin.lab.note_words import BY_WORD, SETTINGS, TELLING, meaning_of, normal, read_value
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetRow
from validate.readings.table_rows import is_a_number
from validate.settings import Declared

LARGEST_READ_BYTES = 200_000
MOST_FOUND = 20
LONGEST_PHRASE = 200
PHRASES = re.compile(r"[;\n]|,(?!\d)|\.(?=\s|$)")
"""Ends of phrases; a comma or a point before a digit belongs to a number."""
PLACED = ("photo.ends_px", "date")  # Settings without a unit whose value is no word


def kind_of_text(path: Path) -> Literal["readings", "fill", "note", "text"]:
    """Return whether a file is a table of readings or of a fill, a table of words and values, or free text."""
    try:
        grid = read_cells(path, Declared())
    except InputError:
        return "text"
    if is_fill(grid):
        return "fill"
    numbers = sum(sum(map(is_a_number, row.cells)) > 1 for row in grid.rows)
    if numbers > 1:
        return "text" if path.suffix.lower() == ".md" else "readings"
    return "note" if grid.rows and any(map(_is_setting, grid.rows)) and all(map(_is_pair, grid.rows)) else "text"


def settings_in(path: Path) -> list[tuple[str, Any]]:
    """Return the settings, by dotted key, that phrases of a text seem to say, as "Tiefe 16 mm" does."""
    try:
        with opened(path) as content:
            text = content.read(LARGEST_READ_BYTES).decode("utf-8", errors="replace")
    except (OSError, InputError):
        return []
    found: dict[str, Any] = {}
    for phrase in PHRASES.split(text):
        words = phrase.replace(":", " ").replace("=", " ").split()
        if len(phrase) > LONGEST_PHRASE or len(words) < 2:
            continue
        known = ((BY_WORD.get(normal(" ".join(words[:n]))), words[n:]) for n in range(min(4, len(words) - 1), 0, -1))
        tried = [
            (one, rest) for one, rest in known if one is not None and (one.unit or one.choices or one.key in PLACED)
        ]
        # "0,25 mm/px" has no word of its own.
        number = next((at for at, word in enumerate(words) if word[0].isdigit()), len(words))
        tried += [(one, words[number:]) for one in SETTINGS.values() if one.unit in TELLING]
        for meaning, rest in tried:
            with suppress(ValueError):
                found.setdefault(meaning.key, read_value(meaning, " ".join(rest), ""))
                break
    return list(found.items())[:MOST_FOUND]


def _is_pair(row: SheetRow) -> bool:
    return sum(bool(cell.text) for cell in row.cells) in (2, 3)


def _is_setting(row: SheetRow) -> bool:
    word, value = row.cell(0).text.rstrip(": "), row.cell(1).text
    meaning = meaning_of(word, word.partition("[")[0].partition("(")[0], {})
    # "Tiefe" above "Ort" is a header.
    return meaning is not None and (not meaning.unit or any(map(str.isdigit, value)))
