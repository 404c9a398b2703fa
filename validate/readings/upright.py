"""Sheets whose stations stand in a row, one beside the other: turned, so that they stand in a column."""

from collections.abc import Mapping
from dataclasses import replace

from validate.readings.header_words import meaning
from validate.readings.sheet import SheetGrid, SheetRow
from validate.readings.table_rows import find_header, table_rows
from validate.settings import Columns, Declared


def upright(grid: SheetGrid, declared: Declared) -> SheetGrid:
    """Return a sheet turned, where that is declared, or where a table's names stand in a column and not in a row."""
    given = declared.columns or Columns()
    if given.transposed is None:
        rows = table_rows(grid, given).kept
        if not 1 < len(rows) < MOST_TURNED or _is_table(find_header(rows, grid.merged, given).names):
            return grid
        turned = _turned(grid)
        return turned if _is_table(find_header(turned.rows, (), given).names) else grid
    return _turned(grid) if given.transposed else grid


MOST_TURNED = 100
"""Limit on the rows of a sheet that is turned unasked: names, readings and notes, of which a sheet has few."""


def _is_table(names: Mapping[int, str]) -> bool:
    roles = {found.role for name in names.values() if (found := meaning(name)) is not None}
    return {"station", "reading"} <= roles


def _turned(grid: SheetGrid) -> SheetGrid:
    numbers = {row.number: place for place, row in enumerate(grid.rows)}
    width = max((row.width for row in grid.rows), default=0)
    rows = [SheetRow(column + 1, tuple(row.cell(column) for row in grid.rows)) for column in range(width)]
    return replace(
        grid,
        rows=tuple(row for row in rows if row.width),
        written=(*grid.written, "stations in a row"),
        # Fields are counted by rows of the file, and these are its columns.
        separator=";" if grid.separator == "," else grid.separator,
        merged=(),
        struck=frozenset((column + 1, numbers[row]) for row, column in grid.struck),
        hidden_rows=frozenset(column + 1 for column in grid.hidden_columns),
        hidden_columns=frozenset(numbers[row] for row in grid.hidden_rows if row in numbers),
        turned=tuple(row.number for row in grid.rows),
    )
