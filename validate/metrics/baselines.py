"""Baselines of a comparison: levels without a simulation, compared with the same readings, in figures and sentences.

A calibrated level was fitted to its readings, and so are its baselines: curves with one coefficient, with three, and
with as many as settings were fitted. The baseline for held-out readings is made without them: a flat level of the
dispensed volume.
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from sealtwin.core.records import Floats, Outline, Profile, Solid
from validate.comparison import Baseline
from validate.metrics.curve_distances import are_compared, level_difference
from validate.metrics.volumes import balance_profile
from validate.sentences import sentence
from validate.settings import Role

ALWAYS = (1, 3)  # Numbers of coefficients of the curves for every calibrated level: a bed falls, rests and rises
FINEST, IN_A_GAP = 400, 8  # Largest number of fit points, and of those in a gap between stations
NAMES = {1: "a flat line", 2: "a straight line", 3: "a parabola"}
POOL = "the dispensed volume lying flat"


def best_curves(measured: Profile, from_mm: float, to_mm: float, numbers: Iterable[int]) -> tuple[Baseline, ...]:
    """Return the best polynomial with each number of coefficients over a stretch of the readings, fewest first.

    Best means the smallest mean absolute error along the crack, by which a simulation is measured too. A curve with as
    many coefficients as compared stations is omitted, since it would fit all of them exactly.
    """
    compared = int(are_compared(measured.s_mm, from_mm, to_mm).sum())
    stations_mm = measured.s_mm[(measured.s_mm > from_mm) & (measured.s_mm < to_mm)]
    ends_mm = np.array([from_mm, *stations_mm, to_mm])
    line = tuple(ends_mm.tolist()), tuple(np.interp(ends_mm, measured.s_mm, measured.level_mm).tolist())
    return tuple(
        Baseline(NAMES.get(count, f"a curve with {count} numbers"), count, _curve_error_mm(*line, count))
        for count in sorted(set(numbers))
        if 0 < count < compared
    )


@lru_cache(maxsize=256)  # The runs of a study are compared with the same readings.
def _curve_error_mm(s_mm: tuple[float, ...], level_mm: tuple[float, ...], count: int) -> float:
    """Return the mean error of the best polynomial of ``count`` coefficients, exact between its points."""
    x, readings = np.array(s_mm), Profile(np.array(s_mm), np.array(level_mm))
    if len(x) * IN_A_GAP <= FINEST:
        x = np.unique(x[:-1, None] + np.diff(x)[:, None] * np.linspace(0, 1, IN_A_GAP + 1))
    curve_mm = _nearest_polynomial(x, np.interp(x, readings.s_mm, readings.level_mm), count)
    return level_difference(Profile(x, curve_mm), readings).mean_error


def _nearest_polynomial(x: Floats, level_mm: Floats, count: int) -> Floats:
    """Return the polynomial of ``count`` coefficients with the smallest mean absolute difference, at each x.

    It is a linear programme: minimise the sum of w t with |P c - level| <= t at each x, in Legendre polynomials P.
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


def flat_levels(measured: Profile, outline: Outline, solid: Solid, dispensed_mm3: float) -> tuple[Baseline, ...]:
    """Return the baseline made without the readings: the dispensed volume with a flat level, like water.

    The result is empty if nothing was dispensed.
    """
    if dispensed_mm3 <= 0:
        return ()
    error_mm = level_difference(balance_profile(dispensed_mm3, outline, solid), measured).mean_error
    return (Baseline(POOL, 0, error_mm),)


def beaten(error_mm: float, baselines: Sequence[Baseline], role: Role, fitted: int | None) -> bool | None:
    """Return whether a mean error is smaller than those of all baselines with no more fitted numbers.

    These are the curves with at most ``fitted`` coefficients, the number of fitted settings; if it is None (not
    declared), one is assumed. For held-out readings, only levels made without the readings count. Returns None if there
    is no such baseline.
    """
    most = 0 if role == "held-out" else 1 if fitted is None else fitted
    fair = [one.mean_error_mm for one in baselines if one.numbers <= most]
    return error_mm < min(fair) if fair else None


def nearer_baseline(error_mm: float, baselines: Sequence[Baseline]) -> str:
    """Return a sentence on the simplest baseline nearer to the readings than a mean error, and on simpler baselines."""
    names = [f"{baseline.name} ({baseline.mean_error_mm:.2f} mm)" for baseline in baselines]
    nearer = next((i for i, baseline in enumerate(baselines) if baseline.mean_error_mm <= error_mm), None)
    return sentence("nearer_baseline", baselines=baselines, names=names, nearer=nearer)


def against_baselines(
    error_mm: float,
    baselines: Sequence[Baseline],
    role: Role,
    fitted: int | None,
    stations: int | None = None,
) -> str:
    """Return the sentences that compare a mean error with those of the baselines.

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
        nearer=nearer_baseline(error_mm, baselines),
    )
