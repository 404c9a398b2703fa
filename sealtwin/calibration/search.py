"""Choose the runs of a calibration one after the other, until its budget is spent.

Sixteen runs are points of a Sobol sequence, and one of them is repeated with three more seeds. Then each round runs
three settings at which the emulator is least certain under the posterior. At the end three new seeds confirm the most
likely setting. The emulator models the profile, not its error (Astudillo and Frazier 2019, Proc. Mach. Learn. Res.
97:354).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from sealtwin.core.errors import NumericalError
from sealtwin.core.records import Floats
from validate.calibration.emulator import Emulator
from validate.calibration.posterior import BasisReach, Free, Posterior, ReadLevels, reach_of
from validate.uncertainty.computed import require_different

FIRST, AGAIN, ROUND, CONFIRM = 16, 3, 3, 3
"""Numbers of runs: of the first design, of further seeds for one of these, of a round, and of seeds that confirm the
best setting."""
FEWEST = FIRST + AGAIN + ROUND + CONFIRM
HOPELESS = 3.0
"""Implausibility of the best setting above which the search stops early. It is above 1, since an emulator of few runs
is overconfident: one search of four by drafts began at 2.0, with readings of a run of the same paste."""
LEAST_USABLE = 0.75  # Least share of runs with a result
DRAWS, STEPS, STEPS_OF_A_ROUND = 500, 1200, 200

Setting = dict[str, float]
Runner = Callable[[Sequence[tuple[Setting, int]]], Sequence[Floats | None]]
"""Function that takes the settings of all runs so far, each with the number that is added to the seed. It computes only
new runs, and returns each run's levels at the stations, or None if the run failed."""


@dataclass(frozen=True)
class Source:
    """A trial whose readings are used for the calibration."""

    name: str
    evidence: ReadLevels
    run: Runner


@dataclass(frozen=True)
class SearchResult:
    frees: Sequence[Free]
    points: Floats  # (r, d) of all runs, in the unit cube
    levels_mm: Sequence[Sequence[Floats | None]]  # Of each trial's runs
    reaches: Sequence[BasisReach]
    posterior: Posterior
    least_implausibility: float
    draws: Floats | None  # (500, d) in the unit cube; None if no setting makes the readings
    mixing: float = 1.0
    best: Floats = field(default_factory=lambda: np.zeros(0))  # (d,)

    @property
    def possible(self) -> bool:
        return self.draws is not None

    @property
    def discrepancy_mm(self) -> float | None:
        """Posterior mean of the standard deviation of the model's own error; None if only one trial was used."""
        if self.draws is None or len(self.levels_mm) < 2:
            return None
        logs = self.posterior.log_densities(self.draws)
        chance = np.exp(logs - np.logaddexp.reduce(logs, axis=0)).mean(axis=1)
        return float(chance @ self.posterior.discrepancies_mm)

    def confirmed_mm(self, trial: int) -> Floats:
        """Return the levels of the runs that confirm the best setting, (m, n), for m finished runs and n stations."""
        return np.array([level for level in self.levels_mm[trial][-CONFIRM:] if level is not None])


class _Search:
    def __init__(self, frees: Sequence[Free], sources: Sequence[Source]) -> None:
        self.frees, self.sources = frees, sources
        self.points = np.zeros((0, len(frees)))
        self.levels_mm: list[Sequence[Floats | None]] = [[] for _ in sources]

    def run(self, points: Floats) -> None:
        self.points = np.vstack([self.points, points])
        wanted = [(settings_at(self.frees, point), seed) for seed, point in enumerate(self.points)]
        self.levels_mm = [source.run(wanted) for source in self.sources]
        for source, levels_mm in zip(self.sources, self.levels_mm, strict=True):
            failed = sum(level is None for level in levels_mm)
            if failed > (1 - LEAST_USABLE) * max(FIRST, len(levels_mm)):
                raise NumericalError(
                    f"{source.name}: {failed} of {len(levels_mm)} runs failed, or their volume is off by over 5 %; "
                    "too few runs are left to cover the ranges. Narrow the ranges, or use finer particles."
                )
            for point in np.unique(self.points, axis=0):
                alike = np.flatnonzero((self.points == point).all(axis=1)).tolist()
                again = {f"{number + 1} (seed + {number})": levels_mm[number] for number in alike}
                done = {name: level_mm for name, level_mm in again.items() if level_mm is not None}
                require_different(done.values(), list(done), source.name)

    def posterior(self) -> tuple[Posterior, list[BasisReach]]:
        emulators, reaches = [], []
        for source, all_mm in zip(self.sources, self.levels_mm, strict=True):
            done = [number for number, level_mm in enumerate(all_mm) if level_mm is not None]
            points, levels_mm = self.points[done], np.array([all_mm[number] for number in done])
            reach = reach_of(points, levels_mm, source.evidence)
            emulators.append(Emulator.fitted(points, levels_mm, reach.components))
            reaches.append(reach)
        return Posterior(self.frees, emulators, [source.evidence for source in self.sources]), reaches

    def nearest(self) -> int:
        """Return the index of the run with the levels nearest to all readings, weighted by the readings' covariance."""
        total = np.zeros(len(self.points))
        for levels_mm, source in zip(self.levels_mm, self.sources, strict=True):
            root = np.linalg.cholesky(source.evidence.covariance_mm2)
            for number, level_mm in enumerate(levels_mm):
                off = np.inf if level_mm is None else np.linalg.solve(root, level_mm - source.evidence.level_mm)
                total[number] += np.sum(np.square(off))
        return int(total.argmin())

    def next_round(self, posterior: Posterior, count: int) -> Floats:
        """Return ``count`` points to run: the most likely draw, then draws at which the emulators are least certain.

        The certainty is computed as if the points before had been run.
        """
        posterior = replace(posterior, smooth=False)
        draws, _ = posterior.draws(DRAWS, STEPS_OF_A_ROUND)
        chosen = [draws[posterior.log_density(draws).argmax()]]
        while len(chosen) < count:
            open_mm2 = np.zeros(len(draws))
            for emulator in posterior.emulators:
                relative = emulator.scatter.relative(np.array(chosen))
                _, variance = emulator.processes.with_points(np.array(chosen), relative).at(draws)
                open_mm2 += variance.sum(axis=1)
            chosen.append(draws[open_mm2.argmax()])
        return np.array(chosen)


def launches_after(done: int, budget: int) -> list[int]:
    """Return the sizes of a trial's launches that follow ``done`` runs, if the search does not stop."""
    ends = sorted({0, FIRST, *range(FIRST + AGAIN, budget - CONFIRM, ROUND), budget - CONFIRM, budget})
    return [end - max(begin, done) for begin, end in pairwise(ends) if end > done]


def settings_at(frees: Sequence[Free], point: Floats) -> Setting:
    """Return the settings at a point of the unit cube, rounded to six digits: precise enough, and easy to read."""
    return {free.name: float(f"{free.values(share):.6g}") for free, share in zip(frees, point, strict=True)}


def search(frees: Sequence[Free], sources: Sequence[Source], budget: int, say: Callable[[str], None]) -> SearchResult:
    """Spend ``budget`` runs of each trial, at least ``FEWEST``, and return the posterior.

    Stops early if no setting in the ranges, or no combination of the runs' levels, can reproduce the readings. The same
    runs give the same search. Raises NumericalError if over a quarter of the runs are unusable.
    """
    from scipy.stats import qmc

    at = _Search(frees, sources)
    at.run(qmc.Sobol(len(frees), rng=0).random(FIRST))
    at.run(np.repeat(at.points[[at.nearest()]], AGAIN, axis=0))
    posterior, reaches = at.posterior()
    while len(at.points) < budget - CONFIRM and posterior.least_implausibility <= HOPELESS:
        error = f"implausibility of the best setting {posterior.least_implausibility:.2f} (at most 1 is plausible)"
        say(f"{len(at.points)} of {budget} runs: {error}.")
        at.run(at.next_round(posterior, min(ROUND, budget - CONFIRM - len(at.points))))
        posterior, reaches = at.posterior()
    least = posterior.least_implausibility
    if least > 1 or not all(reach.possible for reach in reaches):
        return SearchResult(frees, at.points, at.levels_mm, reaches, posterior, least, None)
    best = at.next_round(posterior, 1)[0]
    at.run(np.tile(best, (CONFIRM, 1)))
    posterior, reaches = at.posterior()
    draws, mixing = posterior.draws(DRAWS, STEPS)
    return SearchResult(frees, at.points, at.levels_mm, reaches, posterior, least, draws, mixing, best)
