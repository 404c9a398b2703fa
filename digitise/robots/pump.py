"""A pump by a scale: what it gives for what a program asks, and what to ask for the flow that a path wants."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from pydantic import Field

from sealtwin.core.errors import InputError
from sealtwin.core.number_tables import read_columns
from sealtwin.core.records import Floats
from sealtwin.core.settings import Settings

BOUNDS = {
    "asked_mm3_s": (1e-3, 1e6),
    "weighed_g": (1e-4, 1e5),
    "time_s": (0.1, 1e5),
    "delay_s": (0.0, 30.0),
}
NEEDED = ("asked_mm3_s", "weighed_g", "time_s")
ROWS = (4, 500)
LEAST_FLOWS = 2  # Different flows asked for, of which a line is made
MISTYPED = 5.0  # Flow given over flow asked, either way, from which one of them is in another unit
LEAST_REPEATS = 2  # Weighings beyond one of each flow: from them the scatter is told
T_95 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
"""Student's factor of a 95 % interval for one degree of freedom, and more."""
DOUBTFUL = 0.1  # Relative half-width of the interval of a flow that earns a warning: the bar of all that is measured
WORTHLESS = 0.5
"""Half-width that is refused: the crack would get anything from half of its sealant to half as much again, from a bare
floor to sealant beside the crack."""
ROUNDING = 1e-9  # Relative scatter of equal weighings
ALIKE = 1e-6  # Relative difference of two numbers that one person wrote as the same


class Pump(Settings):
    """Weighings of a pump, and the sealant that was weighed."""

    file: Path
    """CSV of asked_mm3_s, weighed_g, time_s and, where it was timed, delay_s, beside the cell file or absolute: the
    flow that was asked for, what a cup caught of steady flow in that time, and the time from asking to the first
    sealant. Two weighings or more of each of two flows or more."""
    density_kg_m3: float = Field(ge=100, le=2e4)
    """Density of the sealant."""
    density_error_kg_m3: float = Field(default=0.0, ge=0, le=2e4)
    """Its standard uncertainty, which all flows share."""


@dataclass(frozen=True)
class PumpTable:
    """The flow that a pump gives over the flow that it is asked for, linear between weighings."""

    name: str  # Of the file, for refusals
    asked_mm3_s: Floats  # (n,), increasing
    given_mm3_s: Floats  # (n,), increasing
    delay_s: Floats  # (n,)
    scatter: float  # Relative standard deviation of one weighing
    freedom: int  # Degrees of freedom of that
    count: Floats  # (n,): weighings of each flow
    bend: float  # Relative error that the straight lines between flows leave, at worst
    density_error: float  # Relative

    @property
    def range_mm3_s(self) -> tuple[float, float]:
        """Least and largest flow that was weighed."""
        return float(self.given_mm3_s[0]), float(self.given_mm3_s[-1])

    def asked_for(self, wanted_mm3_s: Floats) -> Floats:
        """Return what to ask for; 0 for 0. Raises InputError outside of the flows that were weighed."""
        flows = wanted_mm3_s[wanted_mm3_s > 0]
        low, high = self.range_mm3_s
        if len(flows) and (flows.min() < low * (1 - ALIKE) or flows.max() > high * (1 + ALIKE)):
            wrong = flows.min() if flows.min() < low * (1 - ALIKE) else flows.max()
            raise InputError(
                f"{self.name}: the path wants {wrong:.4g} mm³/s, and the pump was weighed from {low:.4g} to "
                f"{high:.4g}: weigh it at that flow too, or digitise with another path.speed_mm_s or path.volume_ml."
            )
        return np.where(wanted_mm3_s > 0, np.interp(wanted_mm3_s, self.given_mm3_s, self.asked_mm3_s), 0.0)

    def delay_at(self, wanted_mm3_s: float) -> float:
        """Return the time from asking to the first sealant at a flow."""
        return float(np.interp(wanted_mm3_s, self.given_mm3_s, self.delay_s))

    def error_95(self, wanted_mm3_s: float) -> float:
        """Return the relative half-width of the 95 % interval of the flow that is given where that one is wanted."""
        place = float(np.interp(wanted_mm3_s, self.given_mm3_s, np.arange(len(self.count))))
        low = min(int(place), len(self.count) - 2)
        share = place - low
        # Between two flows both means count, each by its share.
        mean = np.hypot((1 - share) / np.sqrt(self.count[low]), share / np.sqrt(self.count[low + 1])) * self.scatter
        factor = T_95[self.freedom - 1] if self.freedom <= len(T_95) else 1.96 * (1 + 1.2 / self.freedom)
        bend = 4 * share * (1 - share) * self.bend
        return float(np.hypot(np.hypot(factor * mean, 1.96 * self.density_error), bend))

    def doubts(self, wanted_mm3_s: Floats) -> tuple[float | None, tuple[str, ...]]:
        """Return the largest relative half-width of flows that are wanted, and a warning if it is large.

        Weighings that repeat each other to the last digit show no scatter, and give None and a warning. Raises
        InputError if the flow is hardly known.
        """
        if self.scatter < ROUNDING:
            return None, (
                f"{self.name}: weighings of one flow repeat each other to the last digit and show no scatter, so that "
                "nothing is said of how well the path's flow is known: weigh for longer or on a finer scale",
            )
        flows = wanted_mm3_s[wanted_mm3_s > 0]
        half = max(self.error_95(float(flows.min())), self.error_95(float(flows.max())))
        said = (
            f"{self.name}: one weighing is {self.scatter:.0%} off its mean (standard deviation), so that the path's "
            f"flow is known to {half:.0%} (95 %)"
        )
        if half > WORTHLESS:
            raise InputError(f"{said}; {WORTHLESS:.0%} are allowed. Weigh more often, for longer, or mend the pump.")
        return half, (f"{said}: weigh more often or for longer",) if half > DOUBTFUL else ()


def read_pump(pump: Pump, folder: Path) -> PumpTable:
    """Read the weighings, which lie in ``folder`` unless absolute. Raises InputError, naming file and row."""
    path = folder / pump.file
    columns = read_columns(path, BOUNDS, NEEDED, ROWS)
    asked = np.array(columns["asked_mm3_s"])
    flow = 1e6 * np.array(columns["weighed_g"]) / pump.density_kg_m3 / np.array(columns["time_s"])
    delay = np.array(columns.get("delay_s", [0.0] * len(asked)))
    flows = np.unique(asked)
    groups = [asked == one for one in flows]
    freedom = len(asked) - len(flows)
    if len(flows) < LEAST_FLOWS or freedom < LEAST_REPEATS:
        raise InputError(
            f"{path}: {len(asked)} weighings of {len(flows)} flows; at least {LEAST_FLOWS} flows are needed, and "
            f"{LEAST_REPEATS} weighings that repeat one, since a single one shows no scatter."
        )
    given = np.array([flow[group].mean() for group in groups])
    times = float(np.median(given / flows))
    if not 1 / MISTYPED < times < MISTYPED:
        raise InputError(
            f"{path}: by its weighings the pump gives {times:.3g} times the flow that it is asked for, and no pump is "
            f"off by a factor of {MISTYPED:g}. Check the units: asked_mm3_s in mm³/s, weighed_g in g, time_s in "
            "seconds and not minutes, density_kg_m3 of the cell's pump in kg/m³."
        )
    for (asked_before, before), (asked_after, after) in pairwise(zip(flows.tolist(), given.tolist(), strict=True)):
        if after <= before:
            raise InputError(
                f"{path}: asked for {asked_after:g} mm³/s the pump gave {after:.4g}, no more than the {before:.4g} at "
                f"{asked_before:g}: no flow between tells what to ask. Weigh again, or leave out what it cannot give."
            )
    relative = np.concatenate([flow[group] / mean - 1 for group, mean in zip(groups, given, strict=True)])
    return PumpTable(
        name=path.name,
        asked_mm3_s=flows,
        given_mm3_s=given,
        delay_s=np.array([delay[group].mean() for group in groups]),
        scatter=float(np.sqrt((relative**2).sum() / freedom)),
        freedom=freedom,
        count=np.array([group.sum() for group in groups], dtype=float),
        bend=_bend(flows, given),
        density_error=pump.density_error_kg_m3 / pump.density_kg_m3,
    )


def _bend(asked: Floats, given: Floats) -> float:
    """Return the largest relative distance of a curve from its chords: a quarter of what one flow is off its own."""
    if len(asked) < 3:
        return 0.0
    chord = given[:-2] + (given[2:] - given[:-2]) * (asked[1:-1] - asked[:-2]) / (asked[2:] - asked[:-2])
    return float((np.abs(given[1:-1] - chord) / given[1:-1]).max()) / 4
