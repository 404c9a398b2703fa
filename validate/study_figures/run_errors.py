"""Errors of a study's runs against the same readings, and the two settings that the runs are placed by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from validate.metrics.curve_distances import CLOSE_MM, Difference
from validate.units import words

DECADES = 100.0  # Ratio of the largest to the smallest value from which an axis is logarithmic: two decades
LEVELS = 16  # Largest number of values of a setting that are drawn as a line each


@dataclass(frozen=True)
class Axis:
    """A setting that varies among the runs, as an axis of a map."""

    setting: str  # Dotted name, for example "fluid.D_cm"
    values: tuple[float, ...]  # Values among the runs, increasing

    @property
    def label(self) -> str:
        """Name with its unit: "D (cm)"."""
        return words(self.setting.rpartition(".")[2])

    @property
    def name(self) -> str:
        """Name without table and unit: D."""
        return self.label.partition(" (")[0]

    @property
    def unit(self) -> str:
        """Unit; empty for a pure number."""
        return self.label.partition(" (")[2].removesuffix(")")

    @property
    def logarithmic(self) -> bool:
        return self.values[0] > 0 and self.values[-1] >= DECADES * self.values[0]

    def is_graded(self, runs: int) -> bool:
        """Return True if the runs share few enough values for a line each, as on a grid."""
        return len(self.values) <= min(LEVELS, runs // 2)

    def spaced(self, values: Floats) -> Floats:
        """Return values as they are spaced on the axis: their logarithms on a logarithmic one."""
        return np.log10(values) if self.logarithmic else np.asarray(values, dtype=float)

    def said(self, value: float) -> str:
        """Return a value for a sentence: "D = 0.3 cm"."""
        return f"{self.name} = {self.rounded(value)} {self.unit}".rstrip()

    def span(self, values: Floats) -> str:
        """Return a range for a sentence: "D from 0.03 to 0.3 cm"."""
        low, high = float(values.min()), float(values.max())
        if low == high:
            return self.said(low)
        return f"{self.name} from {self.rounded(low)} to {self.rounded(high)} {self.unit}".rstrip()

    def rounded(self, value: float) -> str:
        """Return a value with four digits."""
        return f"{float(f'{value:.4g}'):g}"


def axes_of(settings: Sequence[Mapping[str, Any]]) -> tuple[Axis, Axis]:
    """Return the two settings that vary among the runs, the first one for the horizontal axis.

    Raises InputError unless exactly two vary, both are numbers, and the runs do not lie on a line.
    """
    values = {name: [each[name] for each in settings] for name in settings[0]}
    varying = [name for name, found in values.items() if len({str(value) for value in found}) > 1]
    if len(varying) != 2:
        found = "none does" if not varying else f"{len(varying)} do: {', '.join(varying)}"
        raise InputError(f"A map needs two settings that vary among the runs that are done; here {found}.")
    for name in varying:
        if odd := [value for value in values[name] if isinstance(value, bool) or not isinstance(value, int | float)]:
            raise InputError(f"{name} = {odd[0]!r:.40}: no number; only settings that are numbers can be mapped.")
    across, up = (Axis(name, tuple(sorted({float(value) for value in values[name]}))) for name in varying)
    points = np.column_stack([axis.spaced(np.array(values[axis.setting], float)) for axis in (across, up)])
    reach = np.ptp(points, axis=0)
    if np.linalg.matrix_rank((points - points.mean(axis=0)) / reach, tol=1e-6) < 2:
        raise InputError(f"{across.setting} and {up.setting} vary as one: all runs lie on a line. Vary them apart.")
    return across, up


@dataclass(frozen=True)
class Finished:
    """A finished run of a study."""

    number: int
    settings: Mapping[str, Any]  # Settings that vary, by dotted name
    profile: Profile
    wall_s: float
    volume_ratio: float  # Volume of the settled sealant over the dispensed volume


@dataclass(frozen=True)
class Excluded:
    """A run without a result."""

    number: int
    settings: Mapping[str, Any]
    reason: str


@dataclass(frozen=True)
class HeldRun(Finished):
    """A finished run with its errors, simulated minus measured level, exact over the common stretch of s."""

    at: tuple[float, float]  # Values of the two settings of the map
    mean_error_mm: float
    bias_mm: float
    worst_error_mm: float
    worst_at_mm: float
    share_under_1_mm: float


def hold(run: Finished, readings: Profile, axes: tuple[Axis, Axis]) -> HeldRun:
    """Compare a run with the readings. Raises InputError if the two have no stretch of s in common."""
    error = Difference(run.profile.s_mm, run.profile.level_mm, readings.s_mm, readings.level_mm)
    size = np.abs(error.value)
    worst = int(np.argmax(size))
    across, up = (float(run.settings[axis.setting]) for axis in axes)
    return HeldRun(
        **vars(run),
        at=(across, up),
        mean_error_mm=float(np.trapezoid(size, error.x) / error.length_mm),
        bias_mm=error.mean(),
        worst_error_mm=float(size[worst]),
        worst_at_mm=float(error.x[worst]),
        share_under_1_mm=error.size.share_below(CLOSE_MM),
    )


def errors_on_grid(runs: Sequence[Finished], readings: Profile) -> tuple[Floats, Floats]:
    """Return the stations of all profiles and readings in their common stretch, (k,), and the errors there, (r, k).

    Errors are linear between the stations, but for the points where a run crosses the readings, with which every run
    has a stretch in common.
    """
    low = max(readings.s_mm[0], *(run.profile.s_mm[0] for run in runs))
    high = min(readings.s_mm[-1], *(run.profile.s_mm[-1] for run in runs))
    s_mm = np.unique(np.concatenate([readings.s_mm, *(run.profile.s_mm for run in runs)]))
    s_mm = s_mm[(s_mm >= low) & (s_mm <= high)]
    measured_mm = np.interp(s_mm, readings.s_mm, readings.level_mm)
    return s_mm, np.array([np.interp(s_mm, run.profile.s_mm, run.profile.level_mm) - measured_mm for run in runs])
