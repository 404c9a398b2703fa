"""Emulator of the level profile: a Gaussian process for each of the profile's principal components.

See Higdon et al. 2008, J. Am. Stat. Assoc. 103:570. The covariance is Matern's with nu = 5/2. It has a correlation
length for each setting, and a nugget for the scatter of runs that differ only in seed. Lengths and nugget are fitted to
the runs. The scatter is a log-linear function of the settings, because stiff paste scatters two to three times more
than runny paste.
"""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats

COMPONENTS = 5
LENGTH, AMPLITUDE, NUGGET = (0.05, 20.0), (0.05, 50.0), (1e-5, 2.0)
"""Bounds for fitting a process: correlation lengths, as fractions of a setting's range, and amplitude and nugget, as
fractions of the variance of the scores."""
USUAL_LENGTH, FACTOR = 1.0, 3.0
"""Log-normal prior of the correlation lengths: its median, and one standard deviation as a factor. Without a prior, the
likelihood of 16 runs has maxima at lengths of 0 and of infinity."""
STARTS = (0.4, 1.5)  # Initial lengths of the optimisation
ROOT5 = np.sqrt(5.0)
SLOPE, OF_A_RUN = 1.5, 0.5
"""Prior standard deviations of two quantities: the change of ln(variance) over a setting's range, and the deviation of
a single run's ln(variance) from this trend."""
MIN_MM2 = 1e-6  # Added to the mean squared residual of each run. The residual is 0 if a formula gives the level.


@dataclass(frozen=True)
class Processes:
    """Gaussian processes, one for each column of scores. Points are settings, scaled to the unit cube."""

    points: Floats  # (n, d)
    scores: Floats  # (n, k)
    length: Floats  # (k, d)
    variance: Floats  # (k,)
    nugget: Floats  # (k,) variance of a single run about the process, where its relative variance is 1
    relative: Floats  # (n,) variance of each run's scatter, divided by the nugget
    inverse: Floats  # (k, n, n), inverse of the scores' covariance
    weights: Floats  # (k, n)

    @classmethod
    def fitted(cls, points: Floats, scores: Floats, relative: Floats) -> "Processes":
        """Fit the lengths, variance and nugget of each process at the maximum of its posterior."""
        logs = np.array([_most_likely(points, column, relative) for column in scores.T])
        dimensions = points.shape[1]
        size = scores.var(axis=0)
        length, variance, nugget = np.exp(logs[:, :dimensions]), *(np.exp(logs[:, dimensions:]).T * size)
        fitted = cls.given(points, scores, length, variance, nugget, relative)
        # If left-out runs miss by more than the process predicts, its variance is increased by that factor.
        precision = np.einsum("kii->ki", fitted.inverse)
        missed = np.maximum(1.0, (fitted.weights**2 / precision).mean(axis=1))
        return cls.given(points, scores, length, variance * missed, nugget * missed, relative)

    @classmethod
    def given(
        cls, points: Floats, scores: Floats, length: Floats, variance: Floats, nugget: Floats, relative: Floats
    ) -> "Processes":
        covariance = matern(points, points, length, variance) + nugget[:, None, None] * np.diag(relative)
        inverse = np.asarray(np.linalg.inv(covariance), np.float64)
        weights = np.einsum("kij,jk->ki", inverse, scores)
        return cls(points, scores, length, variance, nugget, relative, inverse, weights)

    def predicted(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the mean and the variance of the scores, averaged over seeds, (m, k) each."""
        across = matern(points, self.points, self.length, self.variance)
        mean = np.einsum("kmn,kn->mk", across, self.weights)
        explained = np.einsum("kmn,kmn->mk", across @ self.inverse, across)
        return mean, np.maximum(self.variance - explained, 1e-12 * self.variance)

    def with_points(self, points: Floats, relative: Floats) -> "Processes":
        """Return the processes with additional runs at ``points``, assumed to give the predicted scores.

        Only the variance of the returned processes is valid.
        """
        both = np.vstack([self.points, points]), np.vstack([self.scores, self.predicted(points)[0]])
        return Processes.given(*both, self.length, self.variance, self.nugget, np.append(self.relative, relative))


def matern(a: Floats, b: Floats, length: Floats, variance: Floats) -> Floats:
    """Return Matern's covariance with nu = 5/2, (k, m, n), between points ``a``, (m, d), and ``b``, (n, d)."""
    scaled = (a[:, None, :] - b) / length[:, None, None, :]
    far = ROOT5 * np.sqrt((scaled**2).sum(axis=-1))
    return variance[:, None, None] * (1 + far + far**2 / 3) * np.exp(-far)


def minus_log_posterior(logs: Floats, points: Floats, score: Floats, relative: Floats) -> tuple[float, Floats]:
    """Return -ln(likelihood times prior), and its gradient, (d + 2,).

    ``logs`` are the logarithms of lengths, variance and nugget.

    The constant n/2 ln(2 pi) of the likelihood is left out. ``score`` and ``relative`` are (n,).
    """
    length, variance, nugget = np.exp(logs[:-2]), np.exp(logs[-2]), np.exp(logs[-1])
    squares = ((points[:, None, :] - points) / length) ** 2
    far = ROOT5 * np.sqrt(squares.sum(axis=-1))
    decay = variance * np.exp(-far)
    smooth = decay * (1 + far + far**2 / 3)
    root = np.linalg.cholesky(smooth + nugget * np.diag(relative))
    inverse = np.linalg.inv(root)
    inverse = inverse.T @ inverse
    weights = inverse @ score
    off = np.log(length / USUAL_LENGTH) / np.log(FACTOR)
    value = score @ weights / 2 + np.log(root.diagonal()).sum() + (off**2).sum() / 2
    change = (inverse - np.outer(weights, weights)) / 2
    # d smooth / d ln length_j = 5/3 variance (1 + far) exp(-far) (x_j / length_j)^2.
    by_length = np.einsum("ij,ijd->d", change * decay * (1 + far) * 5 / 3, squares)
    gradient = [*(by_length + off / np.log(FACTOR)), (change * smooth).sum(), nugget * (change.diagonal() @ relative)]
    return float(value), np.array(gradient)


def _most_likely(points: Floats, score: Floats, relative: Floats) -> Floats:
    from scipy.optimize import minimize

    scaled = score / score.std()
    bounds = np.log([LENGTH] * points.shape[1] + [AMPLITUDE, NUGGET])
    fits = [
        minimize(
            minus_log_posterior,
            np.log([start] * points.shape[1] + [1.0, 0.05]),
            args=(points, scaled, relative),
            jac=True,
            method="L-BFGS-B",
            bounds=bounds,
        )
        for start in STARTS
    ]
    return min(fits, key=lambda fit: fit.fun).x


@dataclass(frozen=True)
class Scatter:
    """Covariance of the part of a level that the components do not fit, and its change with the settings."""

    rest_mm2: Floats  # (n, n) covariance of this part, at ``middle``
    middle: Floats  # (d,) mean of the runs' points
    slopes: Floats  # (d,) slopes of ln(variance) over the settings

    @classmethod
    def fitted(cls, points: Floats, levels_mm: Floats, components: int) -> "Scatter":
        """Fit the scatter to the part of each run that ``components`` components of the other runs do not fit.

        Components computed from all runs would fit each run too well.
        """
        rows = []
        for number, level_mm in enumerate(levels_mm):
            others = np.delete(levels_mm, number, axis=0)
            basis = np.linalg.svd(others - others.mean(axis=0), full_matrices=False)[2][:components]
            off = level_mm - others.mean(axis=0)
            rows.append(off - (off @ basis.T) @ basis)
        residual_mm, middle = np.array(rows), points.mean(axis=0)
        logs, apart = np.log((residual_mm**2).mean(axis=1) + MIN_MM2), points - middle
        prior = (OF_A_RUN / SLOPE) ** 2 * np.eye(points.shape[1])
        slopes = np.linalg.solve(apart.T @ apart + prior, apart.T @ (logs - logs.mean()))
        evened = residual_mm / np.exp(apart @ slopes / 2)[:, None]
        return cls(evened.T @ evened / len(residual_mm), middle, slopes)

    def relative(self, points: Floats) -> Floats:
        """Return the variance at points (m, d), divided by the variance at ``middle``, (m,)."""
        return np.exp((points - self.middle) @ self.slopes)


@dataclass(frozen=True)
class Emulator:
    """Levels at a trial's stations as a function of the free settings."""

    mean_mm: Floats  # (n,) mean level of all runs
    basis_mm: Floats  # (k, n) level of each component for a score of 1
    processes: Processes
    scatter: Scatter

    @classmethod
    def fitted(cls, points: Floats, levels_mm: Floats, components: int = COMPONENTS) -> "Emulator":
        """Fit an emulator to runs at ``points`` in the unit cube, (r, d), and their levels at the stations, (r, n)."""
        mean_mm = levels_mm.mean(axis=0)
        scores, size, basis = np.linalg.svd(levels_mm - mean_mm, full_matrices=False)
        components = min(components, most_components(*levels_mm.shape), int((size > 1e-9 * size[0]).sum()))
        scatter = Scatter.fitted(points, levels_mm, components)
        processes = Processes.fitted(points, scores[:, :components] * size[:components], scatter.relative(points))
        return cls(mean_mm, basis[:components], processes, scatter)

    @property
    def run_noise_mm2(self) -> Floats:
        """Covariance between stations, (n, n), of a single run's deviation from its average over seeds.

        It is valid at the mean of the runs' settings.
        """
        return (self.basis_mm.T * self.processes.nugget) @ self.basis_mm + self.scatter.rest_mm2

    def levels_mm(self, points: Floats) -> Floats:
        """Return the levels at ``points`` (m, d), averaged over seeds, (m, n)."""
        return self.mean_mm + self.processes.predicted(points)[0] @ self.basis_mm


def most_components(runs: int, stations: int) -> int:
    """Return the largest number of components with which readings can still contradict the model."""
    return max(1, min(runs - 2, stations // 2))
