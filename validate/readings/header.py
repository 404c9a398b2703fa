"""The header of a table of readings, its columns, and its remarks: what readings count from, and factors."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from validate.readings.header_words import (
    ALL_WORDS,
    FACE,
    LONGEST_NAME,
    NAME,
    OF_FACE,
    OF_FACTOR,
    ZERO_OF_READINGS,
    ColumnMeaning,
)
from validate.readings.sheet import SheetRow, quoted
from validate.readings.text_table import WORDS, plain_letters
from validate.settings import Quantity

Mass = Literal["", "g", "kg"]
"""Unit of the masses of a fill if the sheet lacks it."""
MOST_SHOWN = 12
CHECKED, ON = (frozenset(WORDS["remarks"][key].split()) for key in ("checked", "on"))
PRODUCT = re.compile(
    r"(?<!\w)(?P<maker>[A-Z]\w+) (?:Reference|Origin) (?P<model>[A-Z]{2,}\w*) \d{1,3}\.\d{1,3}\.\d{1,3}(?![\d.,])"
)
"""A word for a zero in the name of a product with its version, such as "Leitz Reference HP 12.10.7"."""


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


def names_other_zero(text: str) -> bool:
    """Return whether a remark mentions a zero point in other words than those for the sample's face."""
    listed = NAME.findall(plain_letters(PRODUCT.sub(_without_product, text[: 5 * LONGEST_NAME])))
    words = set(listed)
    if not words & ZERO_OF_READINGS or (words & FACE and words <= ZERO_OF_READINGS | FACE | OF_FACE):
        return False
    # "zero checked on face", but not "zero on caliper face".
    on = next((at for at in range(len(listed) - 1, 0, -1) if listed[at] in ON), 0)
    before, behind = set(listed[:on]), set(listed[on + 1 :])
    is_face = bool(behind & FACE) and behind <= FACE | OF_FACE
    return not (is_face and before <= ZERO_OF_READINGS | CHECKED | OF_FACE)


def _without_product(product: re.Match[str]) -> str:
    """Return "" for the name of a product; a match with a word of labs may be a remark."""
    words = {plain_letters(product["maker"]), plain_letters(product["model"])}
    return product[0] if words & (ALL_WORDS | FACE | ZERO_OF_READINGS | CHECKED) else " "


def names_factor(text: str) -> bool:
    """Return whether a remark gives a factor for the readings."""
    words = set(NAME.findall(plain_letters(text[:LONGEST_NAME])))
    return bool(words & OF_FACTOR)
