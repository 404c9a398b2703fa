"""Fit of Herschel and Bulkley's law, tau = yield stress + K rate^n, to a flow curve, with 95 % intervals.

For a given n the law is linear in yield stress and K, which least squares of the relative differences then determine;
neither may be below 0. An interval of a parameter has the values at which the best fit is not worse than the overall
best by more than Student's t allows (profile likelihood), since an ellipse would be too short for curves that hardly
determine n. Bingham's law, n = 1, is chosen if the interval of n includes 1, and the intervals remain those of a free
n: the choice is made from the same rows, and intervals at n = 1 would be too short for a paste of n = 0.95.

The package rheofit fits more laws, but needs pandas, openpyxl and matplotlib; two parameters of this law are linear.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sealtwin.core.records import Floats
from sealtwin.material import PasteValue

TORQUE = 0.03  # Relative standard uncertainty of the stress that is common to all rows: calibration, edge, fill
GAP = 0.02  # Relative standard uncertainty of the shear rate that is common to all rows: 20 um in a gap of 1 mm
NORMAL_95 = 1.96
LEAST_N, MOST_N = 0.1, 2.5
"""Range in which n is sought. It is wider than that of fluid.flow_index, so that a paste outside of it is noticed."""
GRID = np.linspace(LEAST_N, MOST_N, 97)
PRECISE = 1e-6  # Relative precision of an interval's ends
DIGITS = 1e-4  # Least relative scatter of the stresses: their digits


@dataclass(frozen=True)
class FlowLaw:
    """Herschel and Bulkley's law of a paste. ``flow_index`` is 1 if Bingham's law was chosen."""

    yield_stress_pa: PasteValue
    consistency_pa_s_n: PasteValue
    """K: the viscous stress at a shear rate of 1/s, or the viscosity if n is 1."""
    flow_index: PasteValue
    free_index: float  # n of the best fit, also if Bingham's law was chosen
    viscosity_percent: float
    """Standard uncertainty of the viscous stress K rate^n at the rates' geometric mean; of the viscosity if n is 1."""
    misfit: float  # RMS of the relative differences between law and stress
    bingham_misfit: float

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
    thick: float  # K per rate of ``_Curve.middle``


Thickness = Callable[[Floats], Floats]  # Returns K for each of some indices n


class _Curve:
    """Rows of a flow curve. Rates are divided by their geometric mean, so that K and n hardly depend on each other."""

    def __init__(self, rate: Floats, stress: Floats) -> None:
        order = np.argsort(rate, kind="stable")
        self.middle = float(np.exp(np.log(rate).mean()))
        self.rate, self.inverse = rate[order] / self.middle, 1 / stress[order]
        self.count = len(rate)

    def at(
        self, n: Floats, stress: float | None = None, thick: Thickness | None = None
    ) -> tuple[Floats, Floats, Floats]:
        """Return the least sum of squares for each n, with its yield stress and K, of which one may be given."""
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
            # The sum is convex: if one is below 0 it is 0 at the best, and the other follows.
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
        """Return the variance of a row's relative difference, raised if neighbouring rows have similar differences.

        These are a misfit of the law or a drift, and carry less information than their number.
        """
        off = self.misses(fit)
        alike = max(0.0, float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-300))
        return max(DIGITS**2, fit.squares / (self.count - parameters)) * (1 + alike) / (1 - min(alike, 0.9))


def fit_flow_law(rate: Floats, stress: Floats) -> FlowLaw:
    """Fit the law to rates in 1/s and stresses in Pa, (n,), all above 0, of four rows or more."""
    from scipy.stats import t

    curve = _Curve(rate, stress)
    free, line = curve.best(), curve.fixed(1.0)
    allowed = free.squares + curve.variance(free, 3) * float(t.ppf(0.975, curve.count - 3)) ** 2

    def beyond(fit: _Best) -> float:
        return fit.squares - allowed

    n_ends = _ends(free.n, (LEAST_N, MOST_N), lambda n: beyond(curve.fixed(n)))
    bingham = n_ends[0] <= 1 <= n_ends[1]
    chosen = line if bingham else free
    stress_ends = _ends(free.stress, (0.0, 1 / curve.inverse.min()), lambda pa: beyond(curve.best(pa)))
    log_middle = np.log(curve.middle)

    def thick_of(k: float) -> Thickness:
        return lambda n: k * np.exp(n * log_middle)

    k_free, k = (fit.thick * curve.middle**-fit.n for fit in (free, chosen))
    most_k = 1 / curve.inverse.min() * max(1.0, 1 / rate.min()) ** MOST_N
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
    """Return where ``beyond`` crosses 0 below and above ``best``, or the bound if it does not."""
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
    """Return a value whose interval includes the relative standard uncertainty ``common`` to all rows.

    ``ends`` are those around the value of the ``free`` fit; the chosen one is within them.
    """
    low, high = (float(np.hypot(end - free, NORMAL_95 * common * free)) for end in ends)
    interval = max(0.0, min(free - low, value)), max(free + high, value)
    return PasteValue(value, (interval[1] - interval[0]) / 4, interval)


def _relative_error(curve: _Curve, fit: _Best, bingham: bool) -> float:
    """Return the relative standard uncertainty of K at the middle rate, to first order; infinite if K is 0."""
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
    # Twice the standard uncertainty is half the 95 % interval, as for the yield stress.
    wider = float(t.ppf(0.975, curve.count - parameters)) / NORMAL_95
    return wider * float(np.sqrt(curve.variance(fit, parameters) * covariance[1, 1]))
