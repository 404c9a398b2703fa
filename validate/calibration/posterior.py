"""Free settings: their prior, their posterior from the readings of trials, and which settings are identified."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sealtwin.core.arrays import Floats, rms
from validate.calibration.emulator import COMPONENTS, Emulator, Scatter, most_components
from validate.units import words

LOG_RATIO = 5.0  # A range is sampled on a logarithmic scale if the ratio of its ends is at least this
INTERVAL = 0.9  # Probability of the stated interval of a free setting


@dataclass(frozen=True)
class Free:
    """A free setting. Its prior is uniform over the range, on a log scale if the range is wide."""

    name: str  # Dotted name, for example "fluid.yield_stress_pa"
    low: float
    high: float

    @property
    def label(self) -> str:
        """Name with its unit, for example "yield stress (Pa)"."""
        return words(self.name.rpartition(".")[2])

    @property
    def logarithmic(self) -> bool:
        return self.low > 0 and self.high >= LOG_RATIO * self.low

    def values(self, shares: Floats) -> Floats:
        """Return the values of the setting at fractions of its range, (n,), from 0 to 1."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** shares
        return self.low + (self.high - self.low) * shares


LIMIT = 0.5  # Largest width of an identified setting's interval, divided by the prior's width
CONFOUNDED = 0.8  # Correlation from which on two settings are confounded


@dataclass(frozen=True)
class Marginal:
    """Posterior of a free setting."""

    free: Free
    best: float  # Value of the draw with the highest posterior density
    low: float
    high: float  # Ends of the central 90 % interval
    width_over_prior: float

    @property
    def identified(self) -> bool:
        return self.width_over_prior <= LIMIT


def marginals_of(frees: Sequence[Free], draws: Floats, best: Floats) -> list[Marginal]:
    """Return the posterior of each setting, from posterior draws in the unit cube, (count, d)."""
    ends = np.quantile(draws, [(1 - INTERVAL) / 2, (1 + INTERVAL) / 2], axis=0)
    marginals = []
    for number, free in enumerate(frees):
        low, high = free.values(ends[:, number])
        width = float(np.diff(ends[:, number])[0]) / INTERVAL
        marginals.append(Marginal(free, float(free.values(best[number])), float(low), float(high), width))
    return marginals


def confounded_pairs(frees: Sequence[Free], draws: Floats) -> list[tuple[Free, Free, float]]:
    """Return pairs of settings that the readings cannot separate, each with its correlation."""
    together = np.atleast_2d(np.corrcoef(draws.T))
    pairs = zip(*np.nonzero(np.triu(np.abs(together) > CONFOUNDED, 1)), strict=True)
    return [(frees[int(a)], frees[int(b)], float(together[a, b])) for a, b in pairs]


INFLATED = 1.2
"""Factor that enlarges all standard uncertainties. It is needed because the emulator's correlation lengths and nugget
are treated as exact: without it, the 90 % intervals of a prototype contained 81 to 88 % of the true values. It was
chosen on that prototype, not on the benchmark of this repository."""
POSSIBLE = 0.995  # Probability that the true settings satisfy the bound on the misfit
DISCREPANCIES_MM = np.array([0.0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6])
DISCREPANCY_MM = 0.3  # Scale of the half-normal prior of the model discrepancy
ALIKE_MM = 15.0  # Correlation length of the discrepancy along the crack, about the length of a wave of the level
MAX_COMPONENTS = 10
WALKERS, STRETCH = 64, 2.0
CANDIDATES = 4096  # Sobol points from which walkers start

COMMON_MM = 0.3  # Error that is equal at all stations, due to datum, mean width, shrinkage or missing volume
TILT_MM = 0.2  # Error at either end of the readings if the sample or the datum is tilted
SMOOTH_MM, SMOOTH_LENGTH_MM = 0.3, 15.0  # Size and correlation length of errors from uneven walls and omitted physics
ENDS_MM, ENDS_LENGTH_MM = 0.4, 5.0  # Error at each end of the path, and its decay length: late pump, mound, creep

SMOOTH_ERRORS_MM = {"common": COMMON_MM, "tilt": TILT_MM, "smooth": SMOOTH_MM, "ends": ENDS_MM}
"""Assumed standard deviations of smooth errors of readings and model together, which no setting describes. One profile
cannot distinguish such an error from a setting that changes the level in the same way. If the error were left out, a
setting would absorb it, and the setting's narrow interval would miss the true value (Kennedy and O'Hagan 2001, J. R.
Stat. Soc. B 63:425; Brynjarsdottir and O'Hagan 2014, Inverse Probl. 30:114007)."""


@dataclass(frozen=True)
class ReadLevels:
    """Measured levels of a trial, with the covariance of their errors."""

    s_mm: Floats  # (n,)
    level_mm: Floats  # (n,)
    covariance_mm2: Floats  # (n, n) covariance of the levels' errors
    smooth_mm2: Floats | float = 0.0  # (n, n) covariance of the smooth errors of readings and model


def smooth_errors_mm2(s_mm: Floats, path_mm: tuple[float, float]) -> Floats:
    """Return the covariance of the smooth errors at stations, (n, n). ``path_mm`` are the ends of the nozzle's path."""
    middle_mm, half_mm = (s_mm.max() + s_mm.min()) / 2, max(float(np.ptp(s_mm)) / 2, 1e-9)
    tilt = TILT_MM * (s_mm - middle_mm) / half_mm
    apart = (s_mm[:, None] - s_mm) / SMOOTH_LENGTH_MM
    near, far = path_mm
    total = COMMON_MM**2 + np.outer(tilt, tilt) + SMOOTH_MM**2 * np.exp(-(apart**2) / 2)
    for inward_mm in (s_mm - near, far - s_mm):
        end = ENDS_MM * np.exp(-np.maximum(inward_mm, 0.0) / ENDS_LENGTH_MM)
        total = total + np.outer(end, end)
    return total


@dataclass(frozen=True)
class BasisReach:
    """Smallest residual that a weighted sum of the runs' components leaves in the readings, for any weights."""

    residual_mm: float  # Root mean square residual at the stations
    noise_mm: float  # Root mean square over the stations of the standard uncertainty of reading minus run
    possible: bool
    components: int


def reach_of(points: Floats, levels_mm: Floats, evidence: ReadLevels) -> BasisReach:
    """Fit the readings with as many components of the runs, (r, n), as needed, at most ``MAX_COMPONENTS``.

    With too few components, a correct model would seem wrong (Salter et al. 2019, J. Am. Stat. Assoc. 114:1800). The
    limit of the misfit is the chi-square quantile at ``POSSIBLE``. The misfit is computed with the largest scatter of
    all runs, because the true settings are unknown.
    """
    from scipy.stats import chi2

    mean_mm = levels_mm.mean(axis=0)
    basis = np.linalg.svd(levels_mm - mean_mm, full_matrices=False)[2]
    stations = len(mean_mm)
    most = most_components(len(levels_mm), stations)
    fewest = min(COMPONENTS, most)
    reach = BasisReach(np.inf, 0.0, False, fewest)
    for components in range(fewest, min(MAX_COMPONENTS, most) + 1):
        scatter = Scatter.fitted(points, levels_mm, components)
        rest_mm2 = scatter.rest_mm2 * scatter.relative(points).max()
        covariance = INFLATED**2 * (evidence.covariance_mm2 + rest_mm2)
        root = np.linalg.cholesky(covariance)
        off, shapes = np.linalg.solve(root, evidence.level_mm - mean_mm), np.linalg.solve(root, basis[:components].T)
        residual = off - shapes @ np.linalg.lstsq(shapes, off)[0]
        residual_mm = rms(root @ residual)
        noise_mm = float(np.sqrt(covariance.trace() / stations))
        possible = bool(residual @ residual <= chi2.ppf(POSSIBLE, stations - components))
        reach = BasisReach(residual_mm, noise_mm, possible, components)
        if possible:
            break
    return reach


class _Misfit:
    """An emulator compared with readings, for one size of the model discrepancy."""

    def __init__(self, emulator: Emulator, evidence: ReadLevels, discrepancy_mm: float, smooth: bool) -> None:
        apart = (evidence.s_mm[:, None] - evidence.s_mm) / ALIKE_MM
        own_mm2 = discrepancy_mm**2 * np.exp(-(apart**2) / 2) + (evidence.smooth_mm2 if smooth else 0.0)
        root = np.linalg.cholesky(INFLATED**2 * evidence.covariance_mm2 + own_mm2 + 1e-8 * np.eye(len(apart)))
        # In these coordinates the covariance of the errors is the unit matrix, and the scatter of runs, of any size, is
        # diagonal.
        scattered = np.linalg.solve(root, np.linalg.solve(root, INFLATED**2 * emulator.run_noise_mm2).T)
        self.scatter, turned = np.linalg.eigh((scattered + scattered.T) / 2)
        self.shapes = turned.T @ np.linalg.solve(root, emulator.basis_mm.T)
        self.off = turned.T @ np.linalg.solve(root, evidence.level_mm - emulator.mean_mm)
        self.log_size = 2 * float(np.log(root.diagonal()).sum())

    def misfit(self, mean: Floats, variance: Floats, relative: Floats) -> tuple[Floats, Floats]:
        """Return the squared misfit and ln of the covariance's determinant, (m,) each, computed as low-rank updates."""
        size = 1 + relative[:, None] * np.maximum(self.scatter, 0.0)
        residual = self.off - mean @ self.shapes.T
        spread = INFLATED * np.sqrt(variance)
        across = (self.shapes.T / size[:, None, :]) @ self.shapes
        inner = np.eye(len(self.shapes.T)) + spread[:, :, None] * across * spread[:, None, :]
        projected = ((residual / size) @ self.shapes) * spread
        explained = np.einsum("mk,mk->m", projected, np.linalg.solve(inner, projected[:, :, None])[:, :, 0])
        log_size = self.log_size + np.log(size).sum(axis=1) + np.linalg.slogdet(inner)[1]
        return (residual**2 / size).sum(axis=1) - explained, log_size


@dataclass(frozen=True)
class Posterior:
    """Posterior of the free settings, in the unit cube."""

    frees: Sequence[Free]
    emulators: Sequence[Emulator]  # One emulator for each trial
    evidence: Sequence[ReadLevels]
    smooth: bool = True
    """True to include the assumed smooth errors. False for a search, whose best run must be close to the readings. A
    search ignores these errors, and takes into account that the scatter of runs depends on the settings."""

    @cached_property
    def discrepancies_mm(self) -> Floats:
        """Sizes of an additional model discrepancy, (k,). The posterior is averaged over them.

        Only several trials together can distinguish the discrepancy from the effect of a setting.
        """
        return DISCREPANCIES_MM if len(self.evidence) > 1 else DISCREPANCIES_MM[:1]

    @cached_property
    def _misfits(self) -> list[list[_Misfit]]:
        return [self._misfits_with(float(size_mm), self.smooth) for size_mm in self.discrepancies_mm]

    @cached_property
    def _exact(self) -> list[_Misfit]:
        return self._misfits_with(0.0, smooth=False)

    def _misfits_with(self, discrepancy_mm: float, smooth: bool) -> list[_Misfit]:
        pairs = zip(self.emulators, self.evidence, strict=True)
        return [_Misfit(*pair, discrepancy_mm, smooth) for pair in pairs]

    def _expected(self, points: Floats) -> list[tuple[Floats, Floats, Floats]]:
        return [
            (*emulator.processes.predicted(points), emulator.scatter.relative(points)) for emulator in self.emulators
        ]

    def log_densities(self, points: Floats) -> Floats:
        """Return ln of the density for each size of the model discrepancy, up to a constant, (sizes, m)."""
        inside = ((points >= 0) & (points <= 1)).all(axis=1)
        expected = self._expected(points)
        if self.smooth:
            # Simulated levels of stiff paste scatter more, but real ones do not, so an even level is no evidence of
            # runny paste.
            expected = [(mean, variance, np.ones_like(relative)) for mean, variance, relative in expected]
        rows = []
        for size_mm, fits in zip(self.discrepancies_mm, self._misfits, strict=True):
            total = np.full(len(points), -((size_mm / DISCREPANCY_MM) ** 2) / 2)
            for fit, predicted in zip(fits, expected, strict=True):
                square, log_size = fit.misfit(*predicted)
                total = total - (square + log_size) / 2
            rows.append(np.where(inside, total, -np.inf))
        return np.array(rows)

    def log_density(self, points: Floats) -> Floats:
        return np.logaddexp.reduce(self.log_densities(points), axis=0)

    def implausibility(self, points: Floats) -> Floats:
        """Return each point's squared misfit, divided by the bound that true settings satisfy, (m,).

        True settings satisfy the bound with the probability ``POSSIBLE``. The result is the largest of all trials,
        without model discrepancy or smooth errors (Vernon et al. 2010, Bayesian Anal. 5:619).
        """
        from scipy.stats import chi2

        ratios = [
            fit.misfit(*prediction)[0] / chi2.ppf(POSSIBLE, len(fit.off))
            for fit, prediction in zip(self._exact, self._expected(points), strict=True)
        ]
        return np.max(ratios, axis=0)

    @cached_property
    def least_implausibility(self) -> float:
        """Smallest implausibility within the ranges. If it is above 1, no setting reproduces the readings."""
        return float(self.implausibility(self._candidates).min())

    @cached_property
    def _candidates(self) -> Floats:
        from scipy.stats import qmc

        sobol = qmc.Sobol(len(self.frees), rng=1).random(CANDIDATES)
        return np.vstack([sobol, *(emulator.processes.points for emulator in self.emulators)])

    def draws(self, count: int, steps: int) -> tuple[Floats, float]:
        """Return draws, (count, d), and the largest Gelman-Rubin ratio of a setting between halves of the chain.

        The sampler is an affine-invariant ensemble (Goodman and Weare 2010, Commun. Appl. Math. Comput. Sci. 5:65). The
        first half of ``steps`` is discarded. Seeds are fixed.
        """
        random = np.random.default_rng(0)
        log_density = self.log_density(self._candidates)
        weight = np.exp((log_density - log_density.max()) / 4)
        walkers = self._candidates[random.choice(len(weight), WALKERS, p=weight / weight.sum())]
        walkers = np.clip(walkers + 0.01 * random.standard_normal(walkers.shape), 1e-6, 1 - 1e-6)
        log_densities, chain, dimensions = self.log_density(walkers), [], len(self.frees)
        half = np.arange(WALKERS) < WALKERS // 2
        for _ in range(steps):
            for moving in (half, ~half):
                others = walkers[~moving][random.integers(WALKERS // 2, size=WALKERS // 2)]
                stretch = (1 + (STRETCH - 1) * random.random(WALKERS // 2)) ** 2 / STRETCH
                tried = others + stretch[:, None] * (walkers[moving] - others)
                tried_log_densities = self.log_density(tried)
                chance = (dimensions - 1) * np.log(stretch) + tried_log_densities - log_densities[moving]
                taken = np.log(random.random(WALKERS // 2)) < chance
                walkers[moving] = np.where(taken[:, None], tried, walkers[moving])
                log_densities[moving] = np.where(taken, tried_log_densities, log_densities[moving])
            chain.append(walkers.copy())
        sampled = np.array(chain[steps // 2 :])
        flat = sampled.reshape(-1, dimensions)
        return flat[np.linspace(0, len(flat) - 1, count).astype(int)], _mixing(sampled)


def _mixing(chain: Floats) -> float:
    """Return the largest Gelman-Rubin ratio of a setting between halves of the chain, (steps, walkers, d)."""
    halves = np.array_split(chain, 2)
    means, variances = (
        np.array([function(half.reshape(-1, chain.shape[2]), axis=0) for half in halves])
        for function in (np.mean, np.var)
    )
    within = variances.mean(axis=0)
    return float(np.sqrt(1 + means.var(axis=0, ddof=1) / within).max())
