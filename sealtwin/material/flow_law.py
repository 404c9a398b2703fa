"""Fit the Herschel-Bulkley law, stress = yield stress + K rate^n, to a flow curve, with 95 % intervals.

For each n, the law is linear in the yield stress and K. Least squares of the relative differences determine both, and
neither may be less than 0.

The interval of a parameter contains the values for which the best fit is not significantly worse than the overall best
fit (profile likelihood with Student's t). An interval from a covariance matrix would be too short for curves that
hardly determine n.

If the interval of n includes 1, the Bingham law (n = 1) is chosen. The other intervals are still computed with a free
n, because n was chosen from the same rows. With n = 1 fixed, they would be too short for a paste with n = 0.95.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import Span
from sealtwin.material import PasteValue

TORQUE = 0.03  # Relative standard uncertainty of all stresses together: calibration, edge and filling of the gap
GAP = 0.02  # Relative standard uncertainty of all shear rates together: 20 um in a gap of 1 mm
NORMAL_95 = 1.96
MIN_N, MAX_N = 0.1, 2.5
"""Range of n in a fit. It is wider than the range of fluid.flow_index, so that a paste outside that range is detected.
"""
GRID = np.linspace(MIN_N, MAX_N, 25)
PRECISE = 1e-6  # Relative precision of the ends of an interval
DIGITS = 1e-4  # Smallest relative scatter of the stresses, since they are rounded
FREE = np.nan  # Value of a parameter that is fitted


@dataclass(frozen=True)
class FlowLaw:
    """Herschel-Bulkley law of a paste. ``flow_index`` is 1 if the Bingham law was chosen."""

    yield_stress_pa: PasteValue
    consistency_pa_s_n: PasteValue
    """Consistency K: the viscous stress at a shear rate of 1/s. If n is 1, it is the viscosity."""
    flow_index: PasteValue
    viscous_pa: PasteValue
    """Viscous stress K rate^n at the geometric mean of the rates."""
    misfit: float  # RMS relative difference between the law and the stresses

    @property
    def is_bingham(self) -> bool:
        return self.flow_index.value == 1

    @property
    def viscosity_percent(self) -> float:
        """Relative standard uncertainty of ``viscous_pa`` in percent. Infinite if the stress does not rise."""
        return 100 * self.viscous_pa.error / self.viscous_pa.value if self.viscous_pa.value > 0 else np.inf

    def stress_pa(self, rate_per_s: Floats | float) -> Floats:
        rate = np.asarray(rate_per_s, float)
        return self.yield_stress_pa.value + self.consistency_pa_s_n.value * rate**self.flow_index.value


class _Fit(NamedTuple):
    squares: float  # Sum of the squared relative differences
    stress: float  # Yield stress
    viscous: float  # Viscous stress at the rate ``_Curve.middle``
    n: float


class _Curve:
    """Rows of a flow curve. Rates are divided by their geometric mean, so that K and n are hardly correlated."""

    def __init__(self, rate: Floats, stress: Floats) -> None:
        order = np.argsort(rate, kind="stable")
        self.middle = float(np.exp(np.log(rate).mean()))
        self.rate, self.stress = rate[order] / self.middle, stress[order]

    def fit(self, n: float, stress: float = FREE, viscous: float = FREE) -> _Fit:
        """Return the best fit with this n, and with the yield stress or the viscous stress if they are given."""
        from scipy.optimize import nnls

        columns = np.column_stack([np.ones(len(self.rate)), self.rate**n]) / self.stress[:, None]
        values = np.array([stress, viscous])
        free = np.isnan(values)
        values[free], distance = nnls(columns[:, free], 1 - columns[:, ~free] @ values[~free])
        stress, viscous = values.tolist()
        return _Fit(distance**2, stress, viscous, n)

    def best(self, fit: Callable[[float], _Fit]) -> _Fit:
        """Return the best of the fits that ``fit`` returns for each n."""
        from scipy.optimize import minimize_scalar

        near = int(np.argmin([fit(n).squares for n in GRID]))
        bounds = GRID[max(0, near - 1)], GRID[min(len(GRID) - 1, near + 1)]
        n: Any = minimize_scalar(lambda n: fit(n).squares, bounds=bounds, method="bounded", options={"xatol": 1e-6}).x
        return min(fit(float(GRID[near])), fit(float(n)))

    def variance(self, fit: _Fit) -> float:
        """Return the variance of a row's relative difference. It is increased if neighbouring differences are similar.

        Similar differences are due to a misfit of the law or a drift, so the rows carry less information.
        """
        off = (fit.stress + fit.viscous * self.rate**fit.n) / self.stress - 1
        alike = max(0.0, float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-300))
        return max(DIGITS**2, fit.squares / (len(off) - 3)) * (1 + alike) / (1 - min(alike, 0.9))


def fit_flow_law(rate: Floats, stress: Floats) -> FlowLaw:
    """Fit the law to shear rates in 1/s and stresses in Pa, (n,) each. All are above 0, and n is at least 4."""
    from scipy.stats import t

    curve = _Curve(rate, stress)
    free = curve.best(curve.fit)
    allowed = free.squares + curve.variance(free) * float(t.ppf(0.975, len(rate) - 3)) ** 2

    def interval(value: float, bounds: Span, fit: Callable[[float], _Fit]) -> Span:
        return _ends(value, bounds, lambda value: fit(value).squares - allowed)

    n_ends = interval(free.n, (MIN_N, MAX_N), curve.fit)
    chosen = curve.fit(1.0) if n_ends[0] <= 1 <= n_ends[1] else free
    most = float(stress.max())
    stress_ends = interval(free.stress, (0.0, most), lambda pa: curve.best(lambda n: curve.fit(n, stress=pa)))

    def viscous_stress(rate: float) -> PasteValue:
        """Return the viscous stress K rate^n."""
        ratio = rate / curve.middle
        value, best = (fit.viscous * ratio**fit.n for fit in (chosen, free))
        ends = interval(
            best,
            (0.0, most * max(1.0, ratio**MIN_N, ratio**MAX_N)),
            lambda pa: curve.best(lambda n: curve.fit(n, viscous=pa * ratio**-n)),
        )
        return _value(value, best, ends, float(np.hypot(TORQUE, GAP * chosen.n)))

    return FlowLaw(
        yield_stress_pa=_value(chosen.stress, free.stress, stress_ends, TORQUE),
        consistency_pa_s_n=viscous_stress(1.0),
        flow_index=_value(chosen.n, free.n, n_ends, 0.0),
        viscous_pa=viscous_stress(curve.middle),
        misfit=float(np.sqrt(chosen.squares / len(rate))),
    )


def _ends(best: float, bounds: Span, beyond: Callable[[float], float]) -> Span:
    """Return the values below and above ``best`` at which ``beyond`` crosses 0, or the bounds if it does not."""
    from scipy.optimize import brentq

    def crossing(bound: float) -> float:
        if best == bound or beyond(bound) <= 0:
            return bound
        root: Any = brentq(beyond, *sorted((best, bound)), xtol=PRECISE * (best or abs(bound)))
        return float(root)

    return crossing(bounds[0]), crossing(bounds[1])


def _value(value: float, free: float, ends: Span, common: float) -> PasteValue:
    """Return ``value`` with an interval that includes the relative standard uncertainty ``common`` to all rows.

    ``ends`` is the interval around ``free``, the value of the fit with a free n. The result includes ``value``.
    """
    low, high = (float(np.hypot(end - free, NORMAL_95 * common * free)) for end in ends)
    interval = max(0.0, min(free - low, value)), max(free + high, value)
    return PasteValue(value, (interval[1] - interval[0]) / 4, interval)
