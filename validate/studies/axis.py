"""A setting that varies in a study, as an axis of its figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Floats
from validate.wording import unit_of

DECADES = 100.0
"""Largest over smallest value from which an axis counts powers of ten: two decades."""
LEVELS = 16
"""Different values of a setting up to which each gets a line of its own."""


@dataclass(frozen=True)
class Axis:
    setting: str
    """Its dotted name, for example "fluid.D_cm"."""
    values: tuple[float, ...]
    """That it takes, increasing."""

    @property
    def name(self) -> str:
        """As people say it: D."""
        key = self.setting.rpartition(".")[2]
        unit = unit_of(key)
        return (key if unit == "1" else key.removesuffix(_ending(key))).replace("_", " ")

    @property
    def unit(self) -> str:
        """Empty for a pure number."""
        unit = unit_of(self.setting.rpartition(".")[2])
        return "" if unit == "1" else unit

    @property
    def label(self) -> str:
        return f"{self.name} ({self.unit})" if self.unit else self.name

    @property
    def logarithmic(self) -> bool:
        return self.values[0] > 0 and self.values[-1] >= DECADES * self.values[0]

    def is_graded(self, runs: int) -> bool:
        """Whether so many runs share few enough values for a line each: a grid does, draws do not."""
        return len(self.values) <= min(LEVELS, runs // 2)

    def place(self, settings: Mapping[str, Any]) -> float:
        return float(settings[self.setting])

    def spaced(self, values: Floats) -> Floats:
        """Values as they are spaced on the axis: powers of ten where it counts those."""
        return np.log10(values) if self.logarithmic else np.asarray(values, dtype=float)

    def is_past_middle(self, value: float) -> bool:
        """Whether it lies in the upper half of the axis as it is drawn."""
        low, here, high = self.spaced(np.array([self.values[0], value, self.values[-1]]))
        return bool(here > (low + high) / 2)

    def said(self, value: float) -> str:
        """For a sentence: "D = 0.3 cm"."""
        return f"{self.name} = {self.rounded(value)} {self.unit}".rstrip()

    def rounded(self, value: float) -> str:
        """To four digits, as nobody sets it finer."""
        return f"{float(f'{value:.4g}'):g}"


def axes_of(settings: Sequence[Mapping[str, Any]]) -> tuple[Axis, Axis]:
    """The two settings that vary among runs, the first one named across.

    Raises InputError, in a sentence, where not two of them vary, or one is no number, or they vary as one.
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


def _ending(key: str) -> str:
    from validate.wording import UNITS

    return next(ending for ending in UNITS if key.endswith(ending))
