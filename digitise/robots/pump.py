"""A weighed pump: the flow that it gives for a requested flow, and the request that gives a path's flow."""

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
LEAST_FLOWS = 2  # Different requested flows, through which a line is drawn
MISTYPED = 5.0  # Ratio of given to requested flow, or its inverse, that means a wrong unit
LEAST_REPEATS = 2  # Weighings beyond one of each flow: they show the scatter
T_95 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
"""Student's factor of a 95 % interval for 1 to 10 degrees of freedom."""
DOUBTFUL = 0.1  # Relative half-width of a flow's interval that gives a warning, as for all that is measured
WORTHLESS = 0.5
"""Relative half-width of the flow's 95 % interval that is refused: the crack would get 50 to 150 % of its sealant, from
a bare floor to an overflow."""
ROUNDING = 1e-9  # Relative scatter of equal weighings
ALIKE = 1e-6  # Relative difference of two numbers that are meant as equal


class Pump(Settings):
    """Weighings of a pump, and the sealant that was weighed."""

    file: Path
    """CSV with the columns asked_mm3_s, weighed_g, time_s and, if it was timed, delay_s. Its path is absolute or
    relative to the cell file. asked_mm3_s is the requested flow, weighed_g is the mass that a cup caught of steady flow
    during time_s, and delay_s is the time from the request to the first sealant. Give two or more weighings of each of
    two or more flows."""
    density_kg_m3: float = Field(ge=100, le=2e4)
    """Density of the sealant."""
    density_error_kg_m3: float = Field(default=0.0, ge=0, le=2e4)
    """Standard uncertainty of the density, common to all flows."""


@dataclass(frozen=True)
class PumpTable:
    """Flow that a pump gives as a function of the requested flow, interpolated linearly between weighings."""

    name: str  # Of the file, for refusals
    asked_mm3_s: Floats  # (n,), increasing
    given_mm3_s: Floats  # (n,), increasing
    delay_s: Floats  # (n,)
    scatter: float  # Relative standard deviation of one weighing
    freedom: int  # Degrees of freedom of that
    count: Floats  # (n,): weighings of each flow
    bend: float  # Largest relative error of the straight lines between flows
    density_error: float  # Relative

    @property
    def range_mm3_s(self) -> tuple[float, float]:
        """Smallest and largest flow that was weighed."""
        return float(self.given_mm3_s[0]), float(self.given_mm3_s[-1])

    def asked_for(self, wanted_mm3_s: Floats) -> Floats:
        """Return the request for each flow. It is 0 for a flow of 0. Raises InputError outside the weighed range."""
        flows = wanted_mm3_s[wanted_mm3_s > 0]
        low, high = self.range_mm3_s
        if len(flows) and (flows.min() < low * (1 - ALIKE) or flows.max() > high * (1 + ALIKE)):
            wrong = flows.min() if flows.min() < low * (1 - ALIKE) else flows.max()
            raise InputError(
                f"{self.name}: the path needs {wrong:.4g} mm³/s, but the pump is calibrated only from {low:.4g} "
                f"to {high:.4g}. Calibrate it at that flow too, or digitise with another path.speed_mm_s or "
                "path.volume_ml."
            )
        return np.where(wanted_mm3_s > 0, np.interp(wanted_mm3_s, self.given_mm3_s, self.asked_mm3_s), 0.0)

    def delay_at(self, wanted_mm3_s: float) -> float:
        """Return the time from the request to the first sealant at a flow."""
        return float(np.interp(wanted_mm3_s, self.given_mm3_s, self.delay_s))

    def error_95(self, wanted_mm3_s: float) -> float:
        """Return the relative half-width of the 95 % interval of the flow that the pump gives for a wanted flow."""
        place = float(np.interp(wanted_mm3_s, self.given_mm3_s, np.arange(len(self.count))))
        low = min(int(place), len(self.count) - 2)
        share = place - low
        # Between two flows both means count by their shares.
        mean = np.hypot((1 - share) / np.sqrt(self.count[low]), share / np.sqrt(self.count[low + 1])) * self.scatter
        factor = T_95[self.freedom - 1] if self.freedom <= len(T_95) else 1.96 * (1 + 1.2 / self.freedom)
        bend = 4 * share * (1 - share) * self.bend
        return float(np.hypot(np.hypot(factor * mean, 1.96 * self.density_error), bend))

    def doubts(self, wanted_mm3_s: Floats) -> tuple[float | None, tuple[str, ...]]:
        """Return the largest relative half-width of the wanted flows, and a warning if it is large.

        The half-width is None, with a warning, if weighings agree to the last digit and so show no scatter. Raises
        InputError if the flow is too uncertain.
        """
        if self.scatter < ROUNDING:
            return None, (
                f"{self.name}: weighings of one flow agree to the last digit and show no scatter, so the uncertainty "
                "of the path's flow is unknown: weigh for longer or on a finer scale",
            )
        flows = wanted_mm3_s[wanted_mm3_s > 0]
        half = max(self.error_95(float(flows.min())), self.error_95(float(flows.max())))
        scatter = (
            f"{self.name}: weighings of one flow scatter by {self.scatter:.0%} (standard deviation), so that the "
            f"path's flow is known to {half:.0%} (95 %)"
        )
        if half > WORTHLESS:
            raise InputError(
                f"{scatter}; at most {WORTHLESS:.0%} is allowed. Weigh more often, for longer, or repair the pump."
            )
        return half, (f"{scatter}: weigh more often or for longer",) if half > DOUBTFUL else ()


def read_pump(pump: Pump, folder: Path) -> PumpTable:
    """Read the weighings; their path is relative to ``folder`` or absolute. Raises InputError with file and row."""
    path = folder / pump.file
    columns = read_columns(path, BOUNDS, NEEDED, ROWS)
    asked_mm3_s = np.array(columns["asked_mm3_s"])
    flow = 1e6 * np.array(columns["weighed_g"]) / pump.density_kg_m3 / np.array(columns["time_s"])
    delay = np.array(columns.get("delay_s", [0.0] * len(asked_mm3_s)))
    flows = np.unique(asked_mm3_s)
    groups = [asked_mm3_s == one for one in flows]
    freedom = len(asked_mm3_s) - len(flows)
    if len(flows) < LEAST_FLOWS or freedom < LEAST_REPEATS:
        raise InputError(
            f"{path}: {len(asked_mm3_s)} weighings of {len(flows)} flows; at least {LEAST_FLOWS} flows are needed, "
            f"and {LEAST_REPEATS} weighings that repeat an earlier flow, since a single weighing shows no scatter."
        )
    given = np.array([flow[group].mean() for group in groups])
    times = float(np.median(given / flows))
    if not 1 / MISTYPED < times < MISTYPED:
        raise InputError(
            f"{path}: according to its weighings the pump gives {times:.3g} times the requested flow, and no pump is "
            f"off by a factor of {MISTYPED:g}. Check the units: asked_mm3_s in mm³/s, weighed_g in g, time_s in "
            "seconds and not minutes, density_kg_m3 of the cell's pump in kg/m³."
        )
    for (asked_before, before), (asked_after, after) in pairwise(zip(flows.tolist(), given.tolist(), strict=True)):
        if after <= before:
            raise InputError(
                f"{path}: at a request of {asked_after:g} mm³/s the pump gave {after:.4g}, no more than the "
                f"{before:.4g} at {asked_before:g}: no flow between them can be requested. Weigh again, or omit the "
                "request that the pump does not follow."
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


def _bend(requested: Floats, given: Floats) -> float:
    """Return the largest relative distance of the curve between two flows from the straight line.

    It is a quarter of the distance of a flow from the line between its neighbours.
    """
    if len(requested) < 3:
        return 0.0
    chord = given[:-2] + (given[2:] - given[:-2]) * (requested[1:-1] - requested[:-2]) / (
        requested[2:] - requested[:-2]
    )
    return float((np.abs(given[1:-1] - chord) / given[1:-1]).max()) / 4
