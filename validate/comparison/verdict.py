"""One line on what a comparison shows, and what it takes before it may show anything."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sealtwin.records import Comparison, DataKind, Floats, Outcome
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
    """That shape the readings' line over the compared stretch; one just beyond either end does."""
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


def judged(comparison: Comparison, edited: Sequence[str] = ()) -> Comparison:
    """With all that its metrics allow: the interval of the mean error counts where it was assessed.

    ``edited`` names files of the run that are not as their stage wrote them.
    """
    metrics = comparison.metrics
    assessed = metrics.get("uncertainty")
    low_mm, high_mm = (None, None) if assessed is None else assessed["mean_error_mm"]
    judgement = Judgement(
        comparison.mean_error_mm,
        Gate(**comparison.gate) if comparison.gate else None,
        Basis(metrics["stations_used"], metrics["coverage"], metrics["widest_gap_mm"] / metrics["length_mm"]),
        metrics["escaped_particles"],
        metrics["readings_data"],
        metrics["photo_data"],
        metrics["role"],
        interval_mm=None if low_mm is None or high_mm is None else (low_mm, high_mm),
        scatter_known=assessed is None or assessed["readings"]["scatter_known"],
        edited=tuple(edited),
    )
    said = () if assessed is None or not judgement.possible else tuple(assessed["sentences"])
    return replace(
        comparison, passed=judgement.passed, outcome=judgement.outcome, verdict=judgement.verdict, findings=said
    )


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
    interval_mm: tuple[float, float] | None = None
    """95 % of the mean error, by the readings' doubt; None where it was not assessed."""
    scatter_known: bool = True
    """Whether the readings' scatter is in that interval: it is not, where none was repeated and none was declared."""
    edited: tuple[str, ...] = ()
    """Files of the run that are not as their stage wrote them."""

    @property
    def possible(self) -> bool:
        """Whether anything may be said of the error at all."""
        return not self.escaped_particles and not self.edited and self.basis.suffices

    @property
    def passed(self) -> bool | None:
        """Of what was found. None without a gate; one that cannot be judged is not passed, and none with a leak."""
        if self.escaped_particles:
            return False
        if self.gate is None:
            return None
        return self.possible and self.mean_error_mm <= self.gate.mean_error_mm

    @property
    def outcome(self) -> Outcome:
        if self.escaped_particles:
            return "failed"
        if self.edited:
            return "undecided"
        if self.gate is None:
            return "open"
        if not self.basis.suffices or not self.told:
            return "undecided"
        return "passed" if self.passed else "failed"

    @property
    def told(self) -> bool:
        """Whether the readings can tell if the gate is kept: it lies outside the interval."""
        if self.gate is None or self.interval_mm is None:
            return True
        low_mm, high_mm = self.interval_mm
        return not low_mm <= self.gate.mean_error_mm <= high_mm

    @property
    def verdict(self) -> str:
        """Only measured readings and a measured photo, held out, can validate."""
        if self.escaped_particles:
            return f"{leak(self.escaped_particles)}: a mean error of {self.mean_error_mm:.3f} mm means nothing."
        if self.edited:
            return f"{edited_by_hand(self.edited)}: no verdict."
        if not self.basis.suffices:
            return (
                f"No verdict: {self.basis} ({counted(self.basis.stations, 'station')}, up to "
                f"{100 * self.basis.widest_gap:.0f} % of it apart); at least {100 * LEAST_COVERAGE:.0f} % and "
                f"{FEWEST_STATIONS} stations no more than {100 * WIDEST_GAP:.0f} % apart are needed."
            )
        covers = "" if self.basis.coverage >= NEARLY_ALL else f" The {self.basis}."
        return f"{self._sentence()}{covers}"

    def _sentence(self) -> str:
        found = f"mean error {self.mean_error_mm:.3f} mm{self._interval()}"
        if self.gate is None:
            return f"No gate declared: {found}, neither passed nor failed."
        limit_mm = self.gate.mean_error_mm
        figures = f"{found}, at most {limit_mm:g} mm allowed"
        if not self.told:
            return f"The readings cannot tell whether the gate is kept: {figures}."
        if self.readings_data != "measured" or self.photo_data != "measured":
            return f"{'Consistent' if self.passed else 'Not consistent'} with {self._made_up()}: {figures}."
        if self.role == "calibrated-on":
            return f"{'Agrees' if self.passed else 'Does not agree'} with the readings it was calibrated on: {figures}."
        return f"{'Validated' if self.passed else 'Not validated'} to {limit_mm:g} mm on held-out readings: {figures}."

    def _interval(self) -> str:
        if self.interval_mm is None:
            return ""
        low_mm, high_mm = self.interval_mm
        unknown = "" if self.scatter_known else ", their scatter not known"
        return f" ({low_mm:.2f} to {high_mm:.2f} mm, 95 % by the readings{unknown})"

    def _made_up(self) -> str:
        if self.readings_data == "measured":
            return f"the readings, on a {self.photo_data} sample"
        return "the reconstruction" if self.readings_data == "reconstructed" else "synthetic readings"


def edited_by_hand(names: Sequence[str]) -> str:
    """The beginning of a sentence on results that are no longer a stage's own."""
    return f"Edited by hand since ({', '.join(names)})"


def leak(escaped_particles: int) -> str:
    """The beginning of a sentence for which there must never be a reason."""
    return f"Do not use: {counted(escaped_particles, 'particle')} went through a wall"
