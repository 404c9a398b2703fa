"""Stations and their readings, before they are sorted into arrays, and limits by the crack that they are taken in."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from sealtwin.core.records import Floats
from validate.readings.screens import ReadCells
from validate.readings.sheet import FaultList, Place, SheetRow
from validate.readings.text_table import number
from validate.settings import Declared, Quantity

Height = TypeVar("Height", float, Floats)
SLACK_MM = 2.0
LONGEST_MM = 10_000.0  # Limit on s for a crack of unknown length: a longer sample does not fit into a lab


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


@dataclass(frozen=True)
class CrackLimits:
    """Length and depth of a crack, which limit its readings. With a wrong sign or unit, most readings exceed them."""

    length_mm: float | None  # Length of the centreline; None before the crack is traced
    depth_mm: float

    def check_station(self, place: Place, written: str, s_mm: float, faults: FaultList) -> None:
        # The length is uncertain by about a millimetre, or by a share of it through the scale, and the last station may
        # be at the crack's end. At the beginning the scale has no effect.
        if self.length_mm is None:
            furthest_mm, extent = LONGEST_MM, f"0 to at most {LONGEST_MM:g} mm"
        else:
            furthest_mm = self.length_mm + max(SLACK_MM, 0.03 * self.length_mm)
            extent = f"0 to {self.length_mm:.1f} mm along its centreline"
        if not -SLACK_MM <= s_mm <= furthest_mm:
            faults.open.add("crack")
            finding = f"{s_mm:.12g} mm is outside the crack, {extent}."
            faults.add(
                place,
                finding,
                "Check the unit, the end at which s is 0, and that the whole crack was traced.",
                written,
            )

    def check_level(self, place: Place, written: str, level_mm: float, faults: FaultList) -> None:
        """Add a fault for an impossible level, in mm upward from the sample's surface."""
        # Hand-made floors are uneven by up to a quarter of the depth, and beads of paste are a few millimetres high.
        lowest_mm, highest_mm = -1.25 * self.depth_mm - 1.0, max(5.0, self.depth_mm / 2)
        if not lowest_mm <= level_mm <= highest_mm:
            faults.open.add("crack")
            faults.add(
                place,
                f"{written} is a level of {level_mm:g} mm from the face; in a crack {self.depth_mm:g} mm deep, "
                f"{lowest_mm:g} to {highest_mm:g} mm is possible.",
                "Level counts upward, depth downward: check the column's name, its unit and the datum.",
                written,
            )
