"""The verdict on a comparison, and the least readings that allow one."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sealtwin.core.comparison import Comparison, ErrorUncertainty, LevelMetrics, Outcome
from sealtwin.core.records import Floats
from validate.units import counted

FEWEST_STATIONS = 5
"""The paper's surface falls, rests, falls and rests again: a curve through fewer points cannot follow it."""
LEAST_COVERAGE = 0.8
"""Least share of the crack's length: a tenth at each end may be out of a caliper's reach. The paper's worst errors are
there."""
WIDEST_GAP = 0.3
"""Largest distance of neighbouring stations, as a share of the crack's length. Five even stations are a quarter apart,
and stations set by hand are uneven; four close together and one far away leave the stretch between them open."""
NEARLY_ALL = 0.95  # Coverage below which the verdict states it
ROUNDING = 1e-9


@dataclass(frozen=True)
class Basis:
    """Stations and coverage of a set of readings, which decide whether they allow a verdict."""

    stations: int
    """Number of stations that shape the readings' line over the compared stretch, the next beyond each end included."""
    coverage: float  # Share of the crack's length over which the readings and the simulation are compared
    widest_gap: float  # Largest distance of neighbouring stations, as a share of the crack's length

    @property
    def suffices(self) -> bool:
        return (
            self.stations >= FEWEST_STATIONS
            and self.coverage >= LEAST_COVERAGE - ROUNDING
            and self.widest_gap <= WIDEST_GAP + ROUNDING
        )


def basis_of(s_mm: Floats, from_mm: float, to_mm: float, length_mm: float) -> Basis:
    """Return the basis of sorted stations that are compared from ``from_mm`` to ``to_mm`` of a crack."""
    first = max(0, int(np.searchsorted(s_mm, from_mm, side="right")) - 1)
    last = min(len(s_mm) - 1, int(np.searchsorted(s_mm, to_mm, side="left")))
    used_mm = s_mm[first : last + 1]
    gap_mm = float(np.diff(np.clip(used_mm, from_mm, to_mm)).max())
    return Basis(len(used_mm), (to_mm - from_mm) / length_mm, gap_mm / length_mm)


def judged(
    metrics: LevelMetrics,
    gate_mm: float | None = None,
    uncertainty: ErrorUncertainty | None = None,
    edited: tuple[str, ...] = (),
) -> Comparison:
    """Return the metrics with their verdict by the declared limit of the mean error.

    ``edited`` are the files of the run that are not as their stage wrote them; they and an escaped particle leave
    nothing to judge. ``passed`` holds the mean error against the limit, ``outcome`` its 95 % interval by the readings.
    """
    m, findings = metrics, ()
    covers = f"cover {math.floor(100 * m.coverage + ROUNDING)} % of the crack's length"
    passed, outcome = None if gate_mm is None else False, "undecided"
    if m.escaped_particles:
        passed, outcome = False, "failed"
        verdict = f"{leak(m.escaped_particles)}: a mean error of {m.mean_error_mm:.3f} mm means nothing."
    elif edited:
        verdict = f"{edited_by_hand(edited)}: no verdict."
    elif not m.enough_readings:
        outcome = "open" if gate_mm is None else "undecided"
        verdict = (
            f"No verdict on {_described(m)}: they {covers} ({counted(m.stations_used, 'station')}, up to "
            f"{100 * m.widest_gap_mm / m.length_mm:.0f} % of it apart); at least {100 * LEAST_COVERAGE:.0f} % and "
            f"{FEWEST_STATIONS} stations no more than {100 * WIDEST_GAP:.0f} % apart are needed."
        )
    else:
        passed, outcome, verdict = _held_against(m, gate_mm, uncertainty)
        verdict += f" The readings {covers}." if m.coverage < NEARLY_ALL else ""
        findings = () if uncertainty is None else uncertainty.sentences
    return Comparison(m, uncertainty, None, gate_mm, passed, outcome, verdict, findings)


def _held_against(
    m: LevelMetrics, gate_mm: float | None, uncertainty: ErrorUncertainty | None
) -> tuple[bool | None, Outcome, str]:
    """Return whether the mean error keeps the gate, the outcome, and the sentence on both.

    Only measured readings and a measured photo, held out, can validate.
    """
    found, told = f"mean error {m.mean_error_mm:.3f} mm", True
    if uncertainty is not None:
        low_mm, high_mm = uncertainty.mean_error_interval_mm
        told = gate_mm is None or not low_mm <= gate_mm <= high_mm
        unknown = "" if uncertainty.budget.scatter_known else ", their scatter not known"
        found += f" ({low_mm:.2f} to {high_mm:.2f} mm, 95 % by the readings{unknown})"
    if gate_mm is None:
        return None, "open", f"No gate declared, compared on {_described(m)}: {found}."
    passed = m.mean_error_mm <= gate_mm
    found += f" of {gate_mm:g} mm allowed"
    if not told:
        sentence = f"Gate in doubt on {_described(m)}: {found}; the readings cannot tell whether it is kept."
        return passed, "undecided", sentence
    sentence = f"Gate {'kept' if passed else 'missed'} on {_described(m)}: {found}."
    if m.readings_data == m.photo_data == "measured" and m.role == "held-out":
        sentence += f" Validated to {gate_mm:g} mm." if passed else " Not validated."
    return passed, "passed" if passed else "failed", sentence


def _described(m: LevelMetrics) -> str:
    """Return the readings with their role, and with the origin of data that were not measured."""
    kind = {"measured": "", "undeclared": "undeclared "}.get(m.readings_data, f"{m.readings_data} ")
    named = {
        "held-out": f"held-out {kind}readings",
        "calibrated-on": f"the {kind}readings it was calibrated on",
        "undeclared": f"{kind}readings that are declared neither held out nor calibrated on",
    }[m.role]
    if m.readings_data != "measured" or m.photo_data == "measured":
        return named
    return named + (
        ", of a sample of undeclared origin" if m.photo_data == "undeclared" else f", of a {m.photo_data} sample"
    )


def edited_by_hand(names: Sequence[str]) -> str:
    """Return the beginning of a sentence on results that were edited after their stage wrote them."""
    return f"Edited by hand since ({', '.join(names)})"


def leak(escaped_particles: int) -> str:
    """Return the beginning of a sentence on particles that went through a wall."""
    return f"Do not use: {counted(escaped_particles, 'particle')} went through a wall"
