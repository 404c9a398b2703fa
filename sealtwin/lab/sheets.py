"""Read the cells of a table, and the doubts in an error of a sheet."""

from itertools import zip_longest
from pathlib import Path

from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from validate.readings.files import read_grid
from validate.readings.grid import SheetFaults


def doubts_in(fault: InputError) -> tuple[Doubt, ...]:
    """Return the parts of an error: those of a sheet, or a sentence of any other one each."""
    if isinstance(fault, SheetFaults):
        return fault.doubts
    parts = (sentence.partition(": ") for sentence in str(fault).splitlines())
    return tuple(Doubt("input", where, finding) for where, _, finding in parts)


def table_of(path: Path) -> tuple[tuple[str, ...], list[tuple[int, list[tuple[str, str]]]]]:
    """Return the names in the first row of a table, and the number of each other row with the name and text of cells.

    Raises InputError if the file cannot be read.
    """
    texts = {row: tuple(cell.text for cell in cells) for row, cells in read_grid(path).rows.items()}
    (_, head), *rows = [*texts.items()] or [(1, ())]
    return head, [(row, [*zip_longest(head, texts, fillvalue="")]) for row, texts in rows]
