"""What can be read in a crack: a sign or a unit gone wrong puts most readings where no sealant can be."""

from dataclasses import dataclass
from typing import TypeVar

from sealtwin.records import Floats
from validate.settings import Declared, Quantity
from validate.sheets.faults import FaultList, Place

Height = TypeVar("Height", float, Floats)

SLACK_MM = 2.0
LONGEST_MM = 10_000.0
"""Of any crack: what is longer is no sample on a lab's table."""


@dataclass(frozen=True)
class Crack:
    """As far as it limits readings."""

    length_mm: float | None
    """None before the crack is traced."""
    depth_mm: float

    def check_station(self, place: Place, written: str, s_mm: float, faults: FaultList) -> None:
        # The crack's length is known to about a millimetre, or a share of it by the scale; the last station of a
        # caliper is its end. At its beginning the scale has no share.
        if self.length_mm is None:
            furthest_mm, extent = LONGEST_MM, f"0 to at most {LONGEST_MM:g} mm"
        else:
            furthest_mm = self.length_mm + max(SLACK_MM, 0.03 * self.length_mm)
            extent = f"0 to {self.length_mm:.1f} mm along its centreline"
        if not -SLACK_MM <= s_mm <= furthest_mm:
            faults.add(
                place,
                f"{s_mm:.12g} mm is outside the crack, {extent}.",
                "Check the unit, and from which end s is counted.",
                written,
            )

    def check_level(self, place: Place, written: str, level_mm: float, faults: FaultList) -> None:
        """``level_mm`` counts upward from the sample's surface."""
        lowest_mm = -1.25 * self.depth_mm - 1.0
        """Below the mean depth by a quarter: hand-made floors are uneven."""
        highest_mm = max(5.0, self.depth_mm / 2)
        """A bead of paste on a crack stands a few millimetres high."""
        if not lowest_mm <= level_mm <= highest_mm:
            faults.add(
                place,
                f"{written} is a level of {level_mm:g} mm from the face; {lowest_mm:g} to {highest_mm:g} mm is "
                f"possible in a crack {self.depth_mm:g} mm deep.",
                "Level counts upward, depth downward: check the column's name, its unit and the datum.",
                written,
            )


def level_mm(reading_mm: Height, quantity: Quantity, declared: Declared) -> Height:
    """Readings as heights above the sample's surface."""
    upward_mm = -reading_mm if quantity == "depth" else reading_mm
    return upward_mm + (declared.datum_level_mm or 0.0)
