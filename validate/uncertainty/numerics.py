"""Errors of a level by the numerics: the size of the particles, the scatter of single runs, volume that is not kept."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sealtwin.core.records import Floats
from validate.comparison import SizeSeries
from validate.uncertainty.budget import Component, draws_for, half_width, normals, uniforms

ORDERS = np.linspace(0.5, 2.0, 61)
"""Orders of convergence that are allowed for: below the first an error over so few sizes looks like a constant, and the
last is the highest that any part of the scheme has (Oberkampf & Roy 2010, 8.6.4)."""
LEAST_RUNS = 2  # Runs at each size without which nothing is known of their scatter
ROUNDING_MM2 = 1e-12  # Square of a residual that is rounding alone


@dataclass(frozen=True)
class Replicates:
    """Numbers from runs that differ in seed at each of three particle sizes.

    The error of the middle size is a, by least squares of f0 + a h^p, where h is the radius over the middle one. The
    order p is averaged over by its likelihood, for flat priors of f0 and a; one p serves all numbers, by their mean.
    All sizes scatter alike.
    """

    radii_mm: Sequence[float]  # From the finest to the coarsest
    runs: Sequence[Floats]  # (runs, k) for each size

    @property
    def suffice(self) -> bool:
        """True with so many runs at each size that their scatter is known."""
        return min(map(len, self.runs)) >= LEAST_RUNS

    @cached_property
    def means(self) -> Floats:
        """Mean over the runs of each size, (3, k)."""
        return np.array([runs.mean(axis=0) for runs in self.runs])

    @cached_property
    def scatter(self) -> Floats:
        """Standard deviation of a single run, pooled over the sizes, (k,)."""
        return np.sqrt((self._residuals**2).sum(axis=0) / (self._count - len(self.runs)))

    def size_errors(self, draws: int) -> Floats:
        """Return draws of the middle size's error, (draws, k).

        Given p they have Student's t distribution, with the covariance of the k numbers that the residuals show.
        """
        error, squares, lack = self._fits(self.orders(draws))
        noise = normals("particle size", self._count + 1, draws)
        off = noise[:, :-1] @ self._residuals + noise[:, -1:] * lack
        freedom = self._count - 2
        return error + off / np.sqrt(squares[:, None] * _chi_squares("particle size", freedom, draws))

    def single_runs(self, draws: int) -> Floats:
        """Return draws of what one run is off the mean of all that differ in seed, (draws, k)."""
        freedom = self._count - len(self.runs)
        off = normals("single run", self._count, draws) @ self._residuals
        return off / np.sqrt(_chi_squares("single run", freedom, draws))

    def orders(self, draws: int) -> Floats:
        """Return draws of the order p, (draws,)."""
        _, squares, lack = self._fits(ORDERS)
        residual = (self._residuals.mean(axis=1) ** 2).sum() + lack.mean(axis=1) ** 2 + ROUNDING_MM2
        likelihood = -np.log(squares) / 2 - (self._count - 2) / 2 * np.log(residual)
        density = np.exp(likelihood - likelihood.max())
        share = np.append(0.0, np.cumsum(density[1:] + density[:-1]))
        return np.interp(uniforms("order of convergence", 1, draws)[:, 0], share / share[-1], ORDERS)

    @cached_property
    def _residuals(self) -> Floats:
        """Difference of each run from the mean of its size, (runs of all sizes, k)."""
        return np.vstack([runs - mean for runs, mean in zip(self.runs, self.means, strict=True)])

    @property
    def _count(self) -> int:
        return sum(map(len, self.runs))

    def _fits(self, orders: Floats) -> tuple[Floats, Floats, Floats]:
        """Return for each order the fitted a, (m, k), the squares of h^p about its mean, (m,), and the rest, (m, k)."""
        weight = np.array([len(runs) for runs in self.runs], dtype=float)
        root = np.sqrt(weight)
        power = (np.asarray(self.radii_mm) / self.radii_mm[1]) ** orders[:, None]
        slope = power - (power @ weight / weight.sum())[:, None]
        squares = slope**2 @ weight
        error = (slope * weight) @ self.means / squares[:, None]
        # The one direction of three means that no f0 and a can follow.
        across = np.cross(root, root * power)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        return error, squares, across @ (root[:, None] * self.means)


def size_series(values: Sequence[Sequence[float]], radii_mm: Sequence[float]) -> SizeSeries:
    """Return a number over three particle sizes, given for each run of each size."""
    replicates = Replicates(radii_mm, [np.array(runs)[:, None] for runs in values])
    means, counts = tuple(float(mean) for mean in replicates.means[:, 0]), tuple(map(len, values))
    if not replicates.suffice:
        return SizeSeries(values=means, runs=counts, scatter=None, order_95=None, band=None)
    draws = draws_for(1)
    low, high = np.quantile(replicates.orders(draws), (0.025, 0.975))
    return SizeSeries(
        values=means,
        runs=counts,
        scatter=float(replicates.scatter[0]),
        order_95=(float(low), float(high)),
        band=float(half_width(replicates.size_errors(draws)[:, 0])),
    )


def numerical_errors(replicates: Replicates, volume_level_mm: float | None) -> list[Component]:
    """Return the errors of the levels at k stations by the numerics; none where each size was run once.

    Volume that the numerics gained or lost moves the level by up to what it makes alike everywhere, either way: how
    much of it the fit over particle sizes already has is not known.
    """
    if not replicates.suffice:
        return []
    stations = replicates.means.shape[1]
    draws = draws_for(stations)
    parts = [
        ("particle size", replicates.size_errors(draws)),
        ("scatter of single runs", replicates.single_runs(draws)),
    ]
    if volume_level_mm is not None:
        moved_mm = volume_level_mm * (2 * uniforms("volume of the numerics", 1, draws) - 1)
        parts.append(("volume gained or lost by the numerics", np.tile(moved_mm, stations)))
    return [Component(name, "computed", draws_mm, shared=True, kind="numerics") for name, draws_mm in parts]


def _chi_squares(name: str, freedom: int, draws: int) -> Floats:
    """Return stratified draws of the chi-squared distribution, (draws, 1)."""
    from scipy.special import gammaincinv

    return 2 * gammaincinv(freedom / 2, uniforms(f"{name}, chi squared", 1, draws))
