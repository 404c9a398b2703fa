"""One line on what a comparison shows, and what it takes before it may show anything."""

import math
from dataclasses import dataclass

import numpy as np

from sealtwin.records import DataKind, Floats
from validate.settings import Gate, Role
from validate.wording import counted

FEWEST_STATIONS = 5
"""The paper's surface falls, rests, falls and rests again: a curve through fewer points cannot follow it."""
LEAST_COVERAGE = 0.8
"""Of the crack's length: a tenth at each end may be out of a caliper's reach. The paper's worst errors are there."""
WIDEST_GAP = 0.3
"""Of the crack's length, between neighbours. Five even stations stand a quarter apart, and hands set them unevenly;
four in a heap and one far away would say nothing about what lies between."""
NEARLY_ALL = 0.95
"""A smaller coverage stands in the verdict, whatever it is."""
ROUNDING = 1e-9


@dataclass(frozen=True)
class Basis:
    """How much of the crack a set of readings speaks for."""

    stations: int
    coverage: float
    """Share of the crack's length over which the readings and the simulation are compared."""
    widest_gap: float
    """Between neighbouring stations, as a share of the crack's length."""

    @property
    def suffices(self) -> bool:
        return (
            self.stations >= FEWEST_STATIONS
            and self.coverage >= LEAST_COVERAGE - ROUNDING
            and self.widest_gap <= WIDEST_GAP + ROUNDING
        )

    def __str__(self) -> str:
        return f"readings cover {math.floor(100 * self.coverage + ROUNDING)} % of the crack's length"


def basis_of(s_mm: Floats, from_mm: float, to_mm: float, length_mm: float) -> Basis:
    """Of stations in their order, compared over a stretch of a crack's length; one just outside shapes its end."""
    first = max(0, int(np.searchsorted(s_mm, from_mm, side="right")) - 1)
    last = min(len(s_mm) - 1, int(np.searchsorted(s_mm, to_mm, side="left")))
    used_mm = s_mm[first : last + 1]
    gap_mm = float(np.diff(np.clip(used_mm, from_mm, to_mm)).max())
    return Basis(len(used_mm), (to_mm - from_mm) / length_mm, gap_mm / length_mm)


@dataclass(frozen=True)
class Judgement:
    """A mean error, and all that decides what may be said of it."""

    mean_error_mm: float
    gate: Gate | None
    basis: Basis
    escaped_particles: int
    readings_data: DataKind
    photo_data: DataKind
    role: Role

    @property
    def passed(self) -> bool | None:
        """None without a gate. A gate that cannot be judged is not passed, and nothing is with a leak in the wall."""
        if self.escaped_particles:
            return False
        if self.gate is None:
            return None
        return self.basis.suffices and self.mean_error_mm <= self.gate.mean_error_mm

    @property
    def verdict(self) -> str:
        """Only measured readings and a measured photo, held out, can validate."""
        if self.escaped_particles:
            return f"{leak(self.escaped_particles)}: a mean error of {self.mean_error_mm:.3f} mm means nothing."
        if not self.basis.suffices:
            return (
                f"No verdict: {self.basis} ({counted(self.basis.stations, 'station')}, up to "
                f"{100 * self.basis.widest_gap:.0f} % of it apart); at least {100 * LEAST_COVERAGE:.0f} % and "
                f"{FEWEST_STATIONS} stations no more than {100 * WIDEST_GAP:.0f} % apart are needed."
            )
        covers = "" if self.basis.coverage >= NEARLY_ALL else f" The {self.basis}."
        return f"{self._sentence()}{covers}"

    def _sentence(self) -> str:
        if self.gate is None:
            return f"No gate declared: mean error {self.mean_error_mm:.3f} mm, neither passed nor failed."
        figures = f"mean error {self.mean_error_mm:.3f} mm, at most {self.gate.mean_error_mm:g} mm allowed"
        if self.readings_data != "measured" or self.photo_data != "measured":
            return f"{'Consistent' if self.passed else 'Not consistent'} with the reconstruction: {figures}."
        if self.role == "calibrated-on":
            return f"{'Agrees' if self.passed else 'Does not agree'} with the readings it was calibrated on: {figures}."
        return f"{'Validated on' if self.passed else 'Not validated by'} held-out readings: {figures}."


def leak(escaped_particles: int) -> str:
    """The beginning of a sentence for which there must never be a reason."""
    return f"Do not use: {counted(escaped_particles, 'particle')} went through a wall"
