"""Fit the Herschel-Bulkley law, stress = yield stress + K rate^n, to a flow curve, with 95 % intervals.

For each n, the law is linear in the yield stress and K. Least squares of the relative differences determine both, and
neither may be less than 0.

The interval of a parameter contains the values for which the best fit is not significantly worse than the overall best
fit (profile likelihood with Student's t). An interval from a covariance matrix would be too short for curves that
hardly determine n.

If the interval of n includes 1, the Bingham law (n = 1) is chosen. The other intervals are still computed with a free
n, because n was chosen from the same rows. With n = 1 fixed, they would be too short for a paste with n = 0.95.

The package rheofit fits more laws, but requires pandas, openpyxl and matplotlib.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sealtwin.core.records import Floats
from sealtwin.material import PasteValue

TORQUE = 0.03  # Relative standard uncertainty of all stresses together: calibration, edge and filling of the gap
GAP = 0.02  # Relative standard uncertainty of all shear rates together: 20 um in a gap of 1 mm
NORMAL_95 = 1.96
MIN_N, MAX_N = 0.1, 2.5
"""Range of n in a fit. It is wider than the range of fluid.flow_index, so that a paste outside that range is detected.
"""
GRID = np.linspace(MIN_N, MAX_N, 97)
PRECISE = 1e-6  # Relative precision of the ends of an interval
DIGITS = 1e-4  # Smallest relative scatter of the stresses, since they are rounded


@dataclass(frozen=True)
class FlowLaw:
    """Herschel-Bulkley law of a paste. ``flow_index`` is 1 if the Bingham law was chosen."""

    yield_stress_pa: PasteValue
    consistency_pa_s_n: PasteValue
    """Consistency K: the viscous stress at a shear rate of 1/s. If n is 1, it is the viscosity."""
    flow_index: PasteValue
    free_index: float  # Best n, even if the Bingham law was chosen
    viscosity_percent: float
    """Relative standard uncertainty of the viscous stress K rate^n at the geometric mean of the rates, in percent."""
    misfit: float  # RMS relative difference between the law and the stresses
    bingham_misfit: float  # RMS relative difference between the Bingham line and the stresses

    @property
    def is_bingham(self) -> bool:
        return self.flow_index.value == 1

    def stress_pa(self, rate_per_s: Floats | float) -> Floats:
        rate = np.asarray(rate_per_s, dtype=float)
        return self.yield_stress_pa.value + self.consistency_pa_s_n.value * rate**self.flow_index.value


class _Best(NamedTuple):
    squares: float  # Sum of the squared relative differences
    n: float
    stress: float
    thick: float  # Viscous stress at the rate ``_Curve.middle``


Thickness = Callable[[Floats], Floats]  # Function that returns K for each flow index n


class _Curve:
    """Rows of a flow curve. Rates are divided by their geometric mean, so that K and n are hardly correlated."""

    def __init__(self, rate: Floats, stress: Floats) -> None:
        order = np.argsort(rate, kind="stable")
        self.middle = float(np.exp(np.log(rate).mean()))
        self.rate, self.inverse = rate[order] / self.middle, 1 / stress[order]
        self.count = len(rate)

    def at(
        self, n: Floats, stress: float | None = None, thick: Thickness | None = None
    ) -> tuple[Floats, Floats, Floats]:
        """Return the smallest sum of squares, the yield stress and K for each n, (m,) each. Either may be fixed."""
        a = self.inverse
        b = self.rate ** n[:, None] * self.inverse
        aa, a1 = a @ a, a.sum()
        ab, bb, b1 = b @ a, (b * b).sum(axis=1), b.sum(axis=1)
        if stress is not None:
            stresses = np.full(len(n), stress)
            thicks = np.maximum(0.0, (b1 - stress * ab) / bb)
        elif thick is not None:
            thicks = thick(n)
            stresses = np.maximum(0.0, (a1 - thicks * ab) / aa)
        else:
            determinant = np.maximum(aa * bb - ab**2, 1e-300)
            stresses, thicks = (bb * a1 - ab * b1) / determinant, (aa * b1 - ab * a1) / determinant
            # The sum is convex. If one of them would be below 0, it is 0 at the best fit, and the other follows.
            thicks = np.where(stresses < 0, b1 / bb, thicks)
            stresses = np.where(thicks < 0, a1 / aa, np.maximum(stresses, 0.0))
            thicks = np.maximum(thicks, 0.0)
        off = stresses[:, None] * a + thicks[:, None] * b - 1
        return (off * off).sum(axis=1), stresses, thicks

    def best(self, stress: float | None = None, thick: Thickness | None = None) -> _Best:
        """Return the best fit over all n."""
        from scipy.optimize import minimize_scalar

        squares = self.at(GRID, stress, thick)[0]
        near = int(squares.argmin())
        ends = GRID[max(0, near - 1)], GRID[min(len(GRID) - 1, near + 1)]
        n = minimize_scalar(
            lambda n: self.fixed(n, stress, thick).squares, bounds=ends, method="bounded", options={"xatol": 1e-6}
        ).x
        return min(self.fixed(float(GRID[near]), stress, thick), self.fixed(float(n), stress, thick))

    def fixed(self, n: float, stress: float | None = None, thick: Thickness | None = None) -> _Best:
        squares, stresses, thicks = self.at(np.array([n]), stress, thick)
        return _Best(float(squares[0]), n, float(stresses[0]), float(thicks[0]))

    def misses(self, fit: _Best) -> Floats:
        return fit.stress * self.inverse + fit.thick * self.rate**fit.n * self.inverse - 1

    def variance(self, fit: _Best, parameters: int) -> float:
        """Return the variance of a row's relative difference. It is increased if neighbouring differences are similar.

        Similar differences are due to a misfit of the law or a drift, so the rows carry less information.
        """
        off = self.misses(fit)
        alike = max(0.0, float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-300))
        return max(DIGITS**2, fit.squares / (self.count - parameters)) * (1 + alike) / (1 - min(alike, 0.9))


def fit_flow_law(rate: Floats, stress: Floats) -> FlowLaw:
    """Fit the law to shear rates in 1/s and stresses in Pa, (n,) each. All are above 0, and n is at least 4."""
    from scipy.stats import t

    curve = _Curve(rate, stress)
    free, line = curve.best(), curve.fixed(1.0)
    allowed = free.squares + curve.variance(free, 3) * float(t.ppf(0.975, curve.count - 3)) ** 2

    def beyond(fit: _Best) -> float:
        return fit.squares - allowed

    n_ends = _ends(free.n, (MIN_N, MAX_N), lambda n: beyond(curve.fixed(n)))
    bingham = n_ends[0] <= 1 <= n_ends[1]
    chosen = line if bingham else free
    stress_ends = _ends(free.stress, (0.0, 1 / curve.inverse.min()), lambda pa: beyond(curve.best(pa)))
    log_middle = np.log(curve.middle)

    def thick_of(k: float) -> Thickness:
        return lambda n: k * np.exp(n * log_middle)

    k_free, k = (fit.thick * curve.middle**-fit.n for fit in (free, chosen))
    most_k = 1 / curve.inverse.min() * max(1.0, 1 / rate.min()) ** MAX_N
    k_ends = _ends(k_free, (0.0, most_k), lambda consistency: beyond(curve.best(thick=thick_of(consistency))))
    thickness = float(np.hypot(TORQUE, GAP * chosen.n))
    return FlowLaw(
        yield_stress_pa=_value(chosen.stress, free.stress, stress_ends, TORQUE),
        consistency_pa_s_n=_value(k, k_free, k_ends, thickness),
        flow_index=_value(chosen.n, free.n, n_ends, 0.0),
        free_index=free.n,
        viscosity_percent=100 * float(np.hypot(_relative_error(curve, chosen, bingham), thickness)),
        misfit=float(np.sqrt(chosen.squares / curve.count)),
        bingham_misfit=float(np.sqrt(line.squares / curve.count)),
    )


def _ends(best: float, bounds: tuple[float, float], beyond: Callable[[float], float]) -> tuple[float, float]:
    """Return the values below and above ``best`` at which ``beyond`` crosses 0, or the bounds if it does not."""
    from scipy.optimize import brentq

    if beyond(best) >= 0:
        return best, best

    def crossing(bound: float) -> float:
        if best == bound or beyond(bound) <= 0:
            return bound
        root: Any = brentq(beyond, *sorted((best, bound)), xtol=PRECISE * (best or abs(bound)))
        return float(root)

    return crossing(bounds[0]), crossing(bounds[1])


def _value(value: float, free: float, ends: tuple[float, float], common: float) -> PasteValue:
    """Return ``value`` with an interval that includes the relative standard uncertainty ``common`` to all rows.

    ``ends`` is the interval around ``free``, the value of the fit with a free n. The result includes ``value``.
    """
    low, high = (float(np.hypot(end - free, NORMAL_95 * common * free)) for end in ends)
    interval = max(0.0, min(free - low, value)), max(free + high, value)
    return PasteValue(value, (interval[1] - interval[0]) / 4, interval)


def _relative_error(curve: _Curve, fit: _Best, bingham: bool) -> float:
    """Return the relative standard uncertainty of the viscous stress at the middle rate. Infinite if K is 0.

    It is computed to first order.
    """
    from scipy.stats import t

    if fit.thick == 0:
        return np.inf
    viscous = fit.thick * curve.rate**fit.n * curve.inverse
    slopes = np.column_stack([curve.inverse * curve.inverse.mean() ** -1, viscous, viscous * np.log(curve.rate)])
    slopes = slopes[:, : 2 if bingham else 3]
    try:
        covariance = np.linalg.inv(slopes.T @ slopes)
    except np.linalg.LinAlgError:
        return np.inf
    parameters = slopes.shape[1]
    # As for the yield stress, twice the standard uncertainty is half of the 95 % interval.
    wider = float(t.ppf(0.975, curve.count - parameters)) / NORMAL_95
    return wider * float(np.sqrt(curve.variance(fit, parameters) * covariance[1, 1]))
