"""The verdict on a comparison, and the minimum of readings that it needs."""

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from sealtwin.core.facts import Level
from sealtwin.core.records import Floats
from validate.comparison import Basis, Comparison, Outcome
from validate.metrics.baselines import against_baselines
from validate.metrics.curve_distances import are_compared
from validate.sentences import sentence, stated
from validate.settings import Gate

FEWEST_STATIONS = 7
"""Smallest number of stations. Beside a mound where the nozzle stops, the interval of the bias contains the truth in 0
to 98 % of trials with 5 stations, 90 % or more with 6, and 94 % or more with 7."""
LEAST_COVERAGE = 0.8
"""Least covered share of the crack's length: a tenth at each end may be out of a caliper's reach. The paper's worst
errors are at the ends."""
WIDEST_GAP = 0.3
"""Largest distance of neighbouring stations, as a share of the crack's length. Stations placed by hand are uneven.
A cluster and one far away leave a wider gap."""
NEARLY_ALL = 0.95  # Coverage below which the verdict states it
ROUNDING = 1e-9
BASELINES, SCREENING = "verdict.baselines", "verdict.screening"
"""Keys of a headline with a valid mean error, and of one by the fast model."""
SOUND = (0.95, 1.05)
"""Sound range of the volume ratio, which is settled over dispensed volume. The preset "accurate" stays within it."""


Case = Literal["leak", "edited", "predicted", "alone", "screening", "too-few-readings", "judged"]
"""Reason for a verdict, or for none. The first that holds is taken.

leak: a particle escaped; edited: files were edited by hand; predicted: no readings, but a band; alone: neither;
screening: the fast model computed the level; too-few-readings; judged: the mean error is compared with a gate.
"""


def kept_volume(ratio: float) -> bool:
    """Return True if the volume ratio, rounded as printed, is within ``SOUND``."""
    low, high = SOUND
    return low <= round(ratio, 3) <= high


def basis_of(s_mm: Floats, from_mm: float, to_mm: float, length_mm: float) -> Basis:
    """Return the stations, coverage and largest gap of sorted stations that are compared from ``from_mm`` to ``to_mm``.

    ``length_mm`` is that of the crack.
    """
    first = max(0, int(np.searchsorted(s_mm, from_mm, side="right")) - 1)
    last = min(len(s_mm) - 1, int(np.searchsorted(s_mm, to_mm, side="left")))
    used_mm, compared = s_mm[first : last + 1], are_compared(s_mm, from_mm, to_mm)
    gap = float(np.diff(np.clip(used_mm, from_mm, to_mm)).max()) / length_mm
    coverage = (to_mm - from_mm) / length_mm
    return Basis(
        covered_from_mm=from_mm,
        covered_to_mm=to_mm,
        covered_length_mm=to_mm - from_mm,
        length_mm=length_mm,
        coverage=coverage,
        stations_compared=int(compared.sum()),
        stations_beyond_mm=s_mm[~compared],
        stations_used=len(used_mm),
        widest_gap_mm=gap * length_mm,
        enough_readings=len(used_mm) >= FEWEST_STATIONS
        and coverage >= LEAST_COVERAGE - ROUNDING
        and gap <= WIDEST_GAP + ROUNDING,
    )


def case_of(
    comparison: Comparison | None, escaped: int, edited: Sequence[str], *, fast: bool, predicted: bool = False
) -> Case:
    """Return why there is a verdict or none.

    ``fast`` is True if the fast model computed the level, ``predicted`` if the level has a band.
    """
    if escaped:
        return "leak"
    if edited:
        return "edited"
    if comparison is None:
        return "predicted" if predicted else "alone"
    if fast:
        return "screening"
    return "judged" if comparison.basis.enough_readings else "too-few-readings"


HEADLINES: dict[Case, tuple[str, ...]] = {
    "leak": ("verdict.leak",),
    "edited": ("verdict.edited",),
    "screening": (SCREENING, "verdict.mean-error", BASELINES, "verdict.role"),
    "too-few-readings": ("verdict.too-few-readings", "verdict.role"),
    "judged": (BASELINES, "verdict.role", "verdict.gate"),
}
"""Keys of the facts of a headline."""
LEVELS: dict[str, Level] = {
    "verdict.leak": "fault",
    "verdict.edited": "fault",
    SCREENING: "caution",
    "verdict.too-few-readings": "caution",
}
LIMITS = {"fewest_stations": FEWEST_STATIONS, "least_coverage": LEAST_COVERAGE, "widest_gap": WIDEST_GAP}


def judged(
    comparison: Comparison, gate: Gate | None = None, edited: tuple[str, ...] = (), *, screening: bool = False
) -> Comparison:
    """Return the comparison with its headline: baselines, use of the readings, and the declared limit.

    ``edited`` are files of the run that were changed after their stage wrote them. With such files, an escaped particle
    or a model for ``screening`` there is no verdict. ``passed`` compares the mean error with the limit. ``outcome``
    compares its 95 % interval, which is due to the readings.
    """
    m, uncertainty = comparison, comparison.uncertainty
    case = case_of(m, m.escaped_particles, edited, fast=screening)
    passed, outcome = _outcome(m, case, gate)
    texts = {name: sentence(name, m=m) for name in ("interval", "covers")} | {"beside": beside_baselines(m)}
    parts = {"m": m, "gate": gate, "edited": edited, "outcome": outcome, "nearly_all": NEARLY_ALL, **texts, **LIMITS}
    mean_error = m.mean_error_mm, "mm"
    numbers: dict[str, tuple[Any, ...]] = {
        "verdict.leak": (m.escaped_particles,),
        "verdict.edited": (len(edited),),
        "verdict.role": (m.role,),
    }
    numbers |= dict.fromkeys((BASELINES, "verdict.mean-error", "verdict.gate"), mean_error)
    headline = tuple(
        stated(key, *numbers.get(key, ()), level=LEVELS.get(key, "plain"), in_full=True, **parts)
        for key in HEADLINES[case]
    )
    # Unused declarations are reported with any verdict.
    findings = () if uncertainty is None else uncertainty.findings if case == "judged" else uncertainty.unused
    verdict = {"headline": headline, "outcome": outcome, "passed": passed, "findings": findings}
    return m.model_copy(update={**verdict, "gate": None if case == "screening" else gate})


def _outcome(m: Comparison, case: Case, gate: Gate | None) -> tuple[bool | None, Outcome]:
    """Return whether the mean error is within the gate, and the outcome by its interval."""
    if case == "leak":
        return False, "failed"
    if case == "screening":
        return None, "open"
    if gate is None:
        return None, "undecided" if case == "edited" else "open"
    low_mm, high_mm = m.interval_95_mm or (math.inf, 0.0)
    passed = case == "judged" and m.mean_error_mm <= gate.mean_error_mm
    if case != "judged" or low_mm <= gate.mean_error_mm <= high_mm:
        return passed, "undecided"
    return passed, "passed" if passed else "failed"


def beside_baselines(m: Comparison) -> str:
    """Return the sentences that compare the mean error with those of the baselines."""
    fitted = None if m.fitted is None else len(m.fitted)
    return against_baselines(m.mean_error_mm, m.baselines, m.role, fitted, m.basis.stations_compared)
