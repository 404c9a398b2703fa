"""Small tables as a spreadsheet saves them, by the names in their first row."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from sealtwin.core.errors import InputError
from validate.readings.samples import read_cells
from validate.readings.sheet import Place, SheetGrid
from validate.settings import Declared


def read_table(path: Path, starter: str) -> SheetGrid:
    """Read a CSV, whatever its separator and encoding, or a workbook; ``starter`` says how to get one.

    Raises InputError where it is missing or none.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; {starter}.")
    return read_cells(path, Declared())


def named_cells(
    table: SheetGrid, needed: Sequence[str], optional: Sequence[str] = ()
) -> Iterator[tuple[Place, dict[str, str]]]:
    """Yield the place of each row, and its texts by column. Raises InputError where a column ``needed`` is missing."""
    head = [cell.text for cell in table.rows[0].cells] if table.rows else []
    names = (*needed, *optional)
    if missing := [name for name in needed if name not in head]:
        raise InputError(f"{table.path}: no column {', '.join(missing)}; its first row must name {', '.join(names)}.")
    for row in table.rows[1:]:
        yield table.place(row.number), {name: row.cell(head.index(name)).text for name in names if name in head}
