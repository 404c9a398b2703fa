"""Stations and their readings, before they are sorted into arrays."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from sealtwin.core.records import Floats
from validate.readings.screens import ReadCells
from validate.readings.sheet import SheetRow
from validate.readings.text_table import number
from validate.settings import Declared, Quantity

Height = TypeVar("Height", float, Floats)


def level_mm(reading_mm: Height, quantity: Quantity | None, declared: Declared) -> Height:
    """Return readings as levels, in mm upward from the sample's surface."""
    upward_mm = -reading_mm if quantity == "depth" else reading_mm
    return upward_mm + (declared.datum_level_mm or 0.0)


class Reading(NamedTuple):
    value_mm: float
    row: int  # From 1
    column: int  # From 0
    digit_mm: float  # Place value of its last digit that is not 0


@dataclass
class Station:
    s_mm: float
    row: SheetRow
    readings: dict[str, Reading]  # By the label of the repeat; missing ones are NaN


def cells_of(stations: Sequence[Station], quantity: Quantity | None, declared: Declared) -> ReadCells:
    """Return the stations with at least one reading, sorted along s."""
    labels = sorted({label for station in stations for label in station.readings}, key=_by_number)
    stations = sorted(stations, key=lambda station: station.s_mm)
    stations = [one for one in stations if not all(math.isnan(each.value_mm) for each in one.readings.values())]
    table = [
        [one.readings.get(label) or Reading(np.nan, one.row.number, -1, 1.0) for label in labels] for one in stations
    ]
    shape = len(stations), len(labels)
    readings_mm, rows, columns, digits_mm = (
        np.array([[reading[part] for reading in row] for row in table]).reshape(shape) for part in range(4)
    )
    return ReadCells(
        s_mm=np.array([station.s_mm for station in stations]),
        readings_mm=readings_mm,
        levels_mm=level_mm(readings_mm, quantity, declared),
        rows=rows.astype(np.int64),
        columns=columns.max(axis=0, initial=-1).astype(np.int64),
        digits_mm=digits_mm,
        is_depth=quantity == "depth",
    )


def _by_number(label: str) -> tuple[bool, float, str]:
    """Return a sort key that puts numbers, by size, before words."""
    value = number(label, "point")
    return value is None, value or 0.0, label
