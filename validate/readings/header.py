"""The header of a table of readings, and its columns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from validate.readings.header_words import ColumnMeaning
from validate.readings.sheet import SheetRow, quoted
from validate.settings import Quantity

Mass = Literal["", "g", "kg"]
"""Unit of the masses of a fill if the sheet lacks it."""
MOST_SHOWN = 12


@dataclass(frozen=True, kw_only=True)
class Column(ColumnMeaning):
    index: int  # Number of the column, from 0
    name: str
    unit_declared: bool = False  # True if only readings.unit gives the unit


@dataclass(frozen=True)
class Header:
    row: SheetRow
    above: int  # Number of lines with content above the header
    body: tuple[SheetRow, ...]
    station: Column
    readings: tuple[Column, ...]
    repeat: Column | None
    """Column that numbers the repeats of a long sheet, which has one reading in a row; None in a wide sheet."""
    sample: Column | None  # Column that names the sample of each row; None in a sheet of one sample
    skipped: tuple[Column, ...]
    quantity: Quantity | None
    """Direction of the readings. None if it is missing, which is a fault, as is a missing unit of a column."""
    remarks: tuple[SheetRow, ...] = ()
    """Rows of text about the sheet: above the header, comments, rows between readings."""
    passed: tuple[SheetRow, ...] = ()  # Rows with numbers that are not read: means, and declared ones
    left_out: frozenset[int] = frozenset()  # Numbers of the declared rows to skip
    unmet: tuple[str, ...] = ()  # Declared rows to skip that do not exist
    of_units: tuple[int, ...] = ()  # Columns, from 0, that contain the units of rows

    @property
    def read(self) -> list[Column]:
        """Columns whose cells are read."""
        return [one for one in (self.station, self.repeat, self.sample, *self.readings) if one is not None]


def quoted_names(columns: Sequence[Column]) -> str:
    return ", ".join(quoted(column.name) for column in columns[:MOST_SHOWN])


def remarks_where(header: Header, condition: Callable[[str], bool]) -> list[tuple[SheetRow, str]]:
    """Return the rows and texts of the remarks that satisfy a condition."""
    texts = ((row, cell.text) for row in header.remarks for cell in row.cells if cell.kind == "text" and cell.text)
    return [(row, text) for row, text in texts if condition(text)]
