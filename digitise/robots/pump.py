"""A weighed pump: the flow that it gives for a requested flow, and the request that gives a path's flow."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import Field
from scipy.special import stdtrit

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_columns
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
MISTYPED = 5.0  # Ratio of given to requested flow, or its inverse, that means a wrong unit
DOUBTFUL = 0.1  # Relative half-width of a flow's interval that gives a warning, as for all that is measured
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
    delay_s: Floats  # (n,): from the request to the first sealant
    error_95: float | None  # Relative half-width of a flow's 95 % interval; None if equal weighings show no scatter
    warnings: tuple[str, ...] = ()

    @property
    def range_mm3_s(self) -> tuple[float, float]:
        """Smallest and largest flow that was weighed."""
        return float(self.given_mm3_s[0]), float(self.given_mm3_s[-1])

    def asked_for(self, wanted_mm3_s: Floats) -> Floats:
        """Return the request for each flow. It is 0 for a flow of 0. Raises InputError outside the weighed range."""
        low, high = self.range_mm3_s
        inside = (wanted_mm3_s >= low * (1 - ALIKE)) & (wanted_mm3_s <= high * (1 + ALIKE))
        if not (inside | (wanted_mm3_s == 0)).all():
            wrong_mm3_s = wanted_mm3_s[~inside].max()
            raise InputError(
                f"{self.name}: the path needs {wrong_mm3_s:.4g} mm³/s, but the pump is calibrated only from {low:.4g} "
                f"to {high:.4g}. Calibrate it at that flow too, or digitise with another path.speed_mm_s or "
                "path.volume_ml."
            )
        return np.interp(wanted_mm3_s, self.given_mm3_s, self.asked_mm3_s) * inside


def read_pump(pump: Pump, folder: Path) -> PumpTable:
    """Read the weighings; their path is relative to ``folder`` or absolute.

    Raises InputError with file and row, or if the weighings do not determine the flow.
    """
    path = folder / pump.file
    columns = read_columns(path, BOUNDS, NEEDED, ROWS)
    asked, weighed_g, time_s = (np.array(columns[name]) for name in NEEDED)
    flow = 1e6 * weighed_g / pump.density_kg_m3 / time_s
    flows, group, count = np.unique(asked, return_inverse=True, return_counts=True)
    given, delay = (
        np.bincount(group, values) / count for values in (flow, columns.get("delay_s", np.zeros(len(asked))))
    )
    freedom = len(asked) - len(flows)
    if len(flows) < 2 or freedom < 2:
        raise InputError(
            f"{path}: {len(asked)} weighings of {len(flows)} flows; at least 2 flows are needed, and 2 weighings that "
            "repeat an earlier flow, since a single weighing shows no scatter."
        )
    times = float(np.median(given / flows))
    if not 1 / MISTYPED < times < MISTYPED:
        raise InputError(
            f"{path}: according to its weighings the pump gives {times:.3g} times the requested flow, and no pump is "
            f"off by a factor of {MISTYPED:g}. Check the units: asked_mm3_s in mm³/s, weighed_g in g, time_s in "
            "seconds and not minutes, density_kg_m3 of the cell's pump in kg/m³."
        )
    if (falls := np.diff(given) <= 0).any():
        after = int(falls.argmax()) + 1
        raise InputError(
            f"{path}: at a request of {flows[after]:g} mm³/s the pump gave {given[after]:.4g}, no more than the "
            f"{given[after - 1]:.4g} at {flows[after - 1]:g}: no flow between them can be requested. Weigh again, or "
            "omit the request that the pump does not follow."
        )
    scatter = float(np.sqrt(((flow / given[group] - 1) ** 2).sum() / freedom))
    # A curve between two flows is off the line by about a quarter of a flow's distance from its neighbours' line.
    off = [
        np.interp(flows[n], np.delete(flows, n), np.delete(given, n)) / given[n] - 1 for n in range(1, len(flows) - 1)
    ]
    bend = float(np.abs(off).max(initial=0.0)) / 4
    # The flow with the fewest weighings is known worst.
    of_mean = float(stdtrit(freedom, 0.975)) * scatter / np.sqrt(count.min())
    half = float(np.linalg.norm([of_mean, 1.96 * pump.density_error_kg_m3 / pump.density_kg_m3, bend]))
    if scatter < ROUNDING:
        warning = (
            f"{path.name}: weighings of one flow agree to the last digit and show no scatter, so the uncertainty of "
            "the path's flow is unknown: weigh for longer or on a finer scale"
        )
        return PumpTable(path.name, flows, given, delay, None, (warning,))
    warning = (
        f"{path.name}: weighings of one flow scatter by {scatter:.0%} (standard deviation), so that the path's flow is "
        f"known to {half:.0%} (95 %): weigh more often or for longer"
    )
    return PumpTable(path.name, flows, given, delay, half, (warning,) if half > DOUBTFUL else ())
