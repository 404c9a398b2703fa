"""Verdict on a comparison, the readings that it needs, and the baselines for comparison.

Baselines are levels without a simulation that are compared with the same readings. A calibrated level was fitted to its
readings, and so are its baselines: curves with one coefficient, with three, and with as many as settings were fitted.
The baseline for held-out readings is made without them: a flat level of the dispensed volume.
"""

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from sealtwin.core.facts import Level
from sealtwin.core.records import Floats, Profile
from validate.comparison import Baseline, Basis, Comparison, Outcome
from validate.metrics.curve_distances import are_compared, level_difference
from validate.sentences import sentence, stated
from validate.settings import Gate, Role

ALWAYS = (1, 3)  # Numbers of coefficients of the curves that every calibrated level is compared with
FIT_POINTS, GAP_POINTS = 400, 8  # Each gap has 8 fit points, unless there would be over 400 in all
NAMES = {1: "a flat line", 2: "a straight line", 3: "a parabola"}
POOL = "a flat level of the dispensed volume"


def best_curves(measured: Profile, from_mm: float, to_mm: float, numbers: Iterable[int]) -> tuple[Baseline, ...]:
    """Return the best polynomial with each number of coefficients over a stretch of the readings, fewest first.

    The best polynomial has the smallest mean absolute error along the crack, the measure that is also used for
    simulations. A curve with as many coefficients as compared stations is left out, because it would fit all of them
    exactly.
    """
    compared = int(are_compared(measured.s_mm, from_mm, to_mm).sum())
    stations_mm = measured.s_mm[(measured.s_mm > from_mm) & (measured.s_mm < to_mm)]
    ends_mm = np.array([from_mm, *stations_mm, to_mm])
    line = tuple(ends_mm.tolist()), tuple(measured.level_at_mm(ends_mm).tolist())
    return tuple(
        Baseline(NAMES.get(count, f"a curve with {count} numbers"), count, _curve_error_mm(*line, count))
        for count in sorted(set(numbers))
        if 0 < count < compared
    )


@lru_cache(maxsize=256)  # The runs of a study are compared with the same readings.
def _curve_error_mm(s_mm: tuple[float, ...], level_mm: tuple[float, ...], count: int) -> float:
    """Return the mean error of the best polynomial of ``count`` coefficients. It is exact between its points."""
    x, readings = np.array(s_mm), Profile(np.array(s_mm), np.array(level_mm))
    if len(x) * GAP_POINTS <= FIT_POINTS:
        x = np.unique(x[:-1, None] + np.diff(x)[:, None] * np.linspace(0, 1, GAP_POINTS + 1))
    curve_mm = _nearest_polynomial(x, readings.level_at_mm(x), count)
    return level_difference(Profile(x, curve_mm), readings).mean_error


def _nearest_polynomial(x: Floats, level_mm: Floats, count: int) -> Floats:
    """Return the polynomial of ``count`` coefficients with the smallest mean absolute difference, at each x, (n,).

    The polynomial is the solution of a linear programme: minimise the sum of w t with |P c - level| <= t at each x. P
    are Legendre polynomials, c the coefficients, w the weights and t the bounds of the differences.
    """
    from numpy.polynomial.legendre import legvander
    from scipy.optimize import linprog
    from scipy.sparse import bmat, csr_array, eye_array

    piece = np.diff(x)
    weight = (np.append(piece, 0.0) + np.append(0.0, piece)) / 2
    basis = legvander(2 * (x - x[0]) / (x[-1] - x[0]) - 1, count - 1)
    rows, room = csr_array(basis), eye_array(len(x))
    solved: Any = linprog(
        np.concatenate([np.zeros(count), weight]),
        A_ub=bmat([[rows, -room], [-rows, -room]], format="csr"),
        b_ub=np.concatenate([level_mm, -level_mm]),
        bounds=[(None, None)] * count + [(0, None)] * len(x),
        method="highs",
    )
    if solved.status != 0:
        raise RuntimeError(f"No polynomial of {count} coefficients was found: {solved.message}")
    return basis @ solved.x[:count]


def beaten(error_mm: float, baselines: Sequence[Baseline], role: Role, fitted: int | None) -> bool | None:
    """Return whether a mean error is smaller than the error of every comparable baseline.

    A baseline is comparable if it has at most as many coefficients as settings were fitted (``fitted``). If ``fitted``
    is None (not declared), one setting is assumed. For held-out readings, only levels made without the readings are
    comparable. Returns None if there is no such baseline.
    """
    most = 0 if role == "held-out" else 1 if fitted is None else fitted
    fair = [baseline.mean_error_mm for baseline in baselines if baseline.numbers <= most]
    return error_mm < min(fair) if fair else None


def against_baselines(
    error_mm: float,
    baselines: Sequence[Baseline],
    role: Role,
    fitted: int | None,
    stations: int | None = None,
) -> str:
    """Return the sentences that compare a mean error with the errors of the baselines.

    ``fitted`` is the number of settings that were fitted to the readings, or None if it was not declared. ``stations``
    is the number of compared stations, or None if it is unknown.
    """
    return sentence(
        "beside_baselines",
        error_mm=error_mm,
        baselines=baselines,
        role=role,
        fitted=fitted,
        stations=stations,
        beats=beaten(error_mm, baselines, role, fitted),
        nearer=next((baseline.name for baseline in baselines if baseline.mean_error_mm <= error_mm), None),
    )


FEWEST_STATIONS = 7
"""Smallest number of stations for a verdict. Next to a mound where the nozzle stops, the interval of the bias contains
the true value in 0 to 98 % of trials with 5 stations, in 90 % or more with 6, and in 94 % or more with 7."""
MIN_COVERAGE = 0.8
"""Smallest fraction of the crack's length that must be covered for a verdict. A tenth at each end may be out of a
caliper's reach, but the paper's largest errors are at the ends."""
WIDEST_GAP = 0.3
"""Largest distance between neighbouring stations for a verdict, as a fraction of the crack's length. Stations placed by
hand are unevenly spaced, which this limit allows. It refuses a cluster of stations with a single station far away."""
NEARLY_ALL = 0.95  # Coverage below which the verdict mentions it
ROUNDING = 1e-9
BASELINES, SCREENING = "verdict.baselines", "verdict.screening"
"""Keys of two headlines: for a valid mean error, and for a level computed by the fast model."""
SOUND = (0.95, 1.05)
"""Allowed range of the volume ratio (settled volume divided by dispensed volume). Runs with the preset "accurate" are
within it."""


Case = Literal["leak", "edited", "predicted", "alone", "screening", "too-few-readings", "judged"]
"""Reason for a verdict, or for none. The first reason that applies is taken.

leak: a particle escaped.
edited: files were edited by hand.
predicted: there are no readings, but the level has a band.
alone: there are neither readings nor a band.
screening: the fast model computed the level.
too-few-readings: the readings do not allow a verdict.
judged: the mean error is compared with a gate."""


def kept_volume(ratio: float) -> bool:
    """Return True if the volume ratio, rounded as printed, is within ``SOUND``."""
    low, high = SOUND
    return low <= round(ratio, 3) <= high


def basis_of(s_mm: Floats, from_mm: float, to_mm: float, length_mm: float) -> Basis:
    """Return which stations are compared, the fraction of the crack that they cover, and their largest gap.

    The comparison is from ``from_mm`` to ``to_mm``. ``s_mm`` is sorted. ``length_mm`` is the length of the crack.
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
        and coverage >= MIN_COVERAGE - ROUNDING
        and gap <= WIDEST_GAP + ROUNDING,
    )


def case_of(
    comparison: Comparison | None, escaped: int, edited: Sequence[str], *, fast: bool, predicted: bool = False
) -> Case:
    """Return the reason why there is a verdict or none.

    ``fast`` is True if the fast model computed the level. ``predicted`` is True if the level has a band.
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
"""Keys of the facts that form a headline, by case."""
LEVELS: dict[str, Level] = {
    "verdict.leak": "fault",
    "verdict.edited": "fault",
    "verdict.too-few-readings": "caution",
}
LIMITS = {"fewest_stations": FEWEST_STATIONS, "least_coverage": MIN_COVERAGE, "widest_gap": WIDEST_GAP}


def with_verdict(
    comparison: Comparison, gate: Gate | None = None, edited: tuple[str, ...] = (), *, screening: bool = False
) -> Comparison:
    """Return the comparison with its headline: baselines, use of the readings, and the declared limit.

    ``edited`` are files of the run that were changed after their stage wrote them. There is no verdict if there are
    such files, if a particle escaped, or if the model is for ``screening``. ``passed`` compares the mean error with the
    limit. ``outcome`` compares the 95 % interval of the mean error, which is due to the readings, with the limit.
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
        stated(key, *numbers.get(key, ()), level=LEVELS.get(key, "plain"), **parts) for key in HEADLINES[case]
    )
    findings = uncertainty.findings if uncertainty is not None and case == "judged" else ()
    verdict = {"headline": headline, "outcome": outcome, "passed": passed, "findings": findings}
    return m.model_copy(update={**verdict, "gate": None if case == "screening" else gate})


def _outcome(m: Comparison, case: Case, gate: Gate | None) -> tuple[bool | None, Outcome]:
    """Return whether the mean error is within the gate, and the outcome that follows from its interval."""
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
    """Return the sentences that compare the mean error with the errors of the baselines."""
    fitted = None if m.fitted is None else len(m.fitted)
    return against_baselines(m.mean_error_mm, m.baselines, m.role, fitted, m.basis.stations_compared)
