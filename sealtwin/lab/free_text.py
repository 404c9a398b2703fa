"""Texts of a lab's own, as .txt and .md: what kind each is."""

from pathlib import Path
from typing import Literal

from sealtwin.core.errors import InputError, naming
from sealtwin.core.plain_files import opened
from sealtwin.lab.fill_sheet import is_fill
from sealtwin.lab.note_words import meaning_of
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetRow
from validate.readings.table_rows import is_a_number
from validate.readings.text_table import decoded
from validate.settings import Declared

LARGEST_READ_BYTES = 200_000


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


def text_of(path: Path) -> str:
    """Return the first part of a text in whatever encoding it is. Raises InputError for what is none."""
    with naming(path), opened(path) as file:
        content = file.read(LARGEST_READ_BYTES)
    return decoded(path, content)[0]


def _is_pair(row: SheetRow) -> bool:
    return sum(bool(cell.text) for cell in row.cells) in (2, 3)


def _is_setting(row: SheetRow) -> bool:
    word, value = row.cell(0).text.rstrip(": "), row.cell(1).text
    meaning = meaning_of(word, word.partition("[")[0].partition("(")[0], {})
    # "Tiefe" above "Ort" is a header.
    return meaning is not None and (not meaning.unit or any(map(str.isdigit, value)))
