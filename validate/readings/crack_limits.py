"""Limits of readings by the crack that they are taken in."""

from dataclasses import dataclass

from validate.readings.sheet import FaultList, Place

SLACK_MM = 2.0
LONGEST_MM = 10_000.0  # Limit on s for a crack of unknown length: a longer sample does not fit into a lab


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
