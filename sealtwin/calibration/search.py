"""Choose the runs of a calibration one after the other, until its budget is spent.

Sixteen runs are points of a Sobol sequence, and one of them is repeated with three more seeds. Then each round runs
three settings at which the emulator is least certain under the posterior. At the end three new seeds confirm the most
likely setting. The emulator models the profile, not its error (Astudillo and Frazier 2019, Proc. Mach. Learn. Res.
97:354).

If the runs are drafts, three accurate runs correct their levels before the first round, and the three runs at the end
are accurate and correct them again: the posterior is that of accurate runs (Kennedy and O'Hagan 2000, Biometrika 87:1,
with a difference between the two codes that does not depend on the settings).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from sealtwin.core.errors import NumericalError
from sealtwin.core.records import Floats
from validate.calibration.emulator import Emulator
from validate.calibration.free import Free
from validate.calibration.posterior import BasisReach, Posterior, ReadLevels, reach_of
from validate.uncertainty.computed import require_different

FIRST, AGAIN, ROUND, CONFIRM = 16, 3, 3, 3
"""Numbers of runs: of the first design, of further seeds for one of these, of a round, and of seeds that confirm the
best setting."""
CORRECT = 3  # Number of accurate runs that correct drafts before the first round
FEWEST = FIRST + AGAIN + CORRECT + ROUND + CONFIRM
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
    accurate: Runner | None = None  # Accurate runs if those of ``run`` are drafts


@dataclass(frozen=True)
class Correction:
    """A correction of the levels of a trial's drafts."""

    add_mm: Floats  # (n,) added to the levels
    error_mm2: Floats  # (n, n) covariance of the error of ``add_mm``


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
    accurate: int = 0  # Number of each trial's runs that are accurate and correct the others, which are drafts
    corrections: Sequence[Correction | None] = ()  # Of each trial; None if its runs are not drafts

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
        self.accurate = np.zeros(0, dtype=bool)  # Which runs are accurate ones that correct drafts
        self.levels_mm: list[Sequence[Floats | None]] = [[] for _ in sources]
        self.corrections: list[Correction | None] = [None for _ in sources]

    @property
    def corrects(self) -> bool:
        return any(source.accurate for source in self.sources)

    def run(self, points: Floats, *, accurate: bool = False) -> None:
        self.points = np.vstack([self.points, points])
        self.accurate = np.append(self.accurate, np.full(len(points), accurate))
        self.levels_mm = [self._levels_mm(source) for source in self.sources]
        for source, levels_mm in zip(self.sources, self.levels_mm, strict=True):
            failed = sum(level is None for level in levels_mm)
            if failed > (1 - LEAST_USABLE) * max(FIRST, len(levels_mm)):
                raise NumericalError(
                    f"{source.name}: {failed} of {len(levels_mm)} runs failed, or their volume is off by over 5 %; "
                    "too few runs are left to cover the ranges. Narrow the ranges, or use finer particles."
                )
            for point in np.unique(self.points, axis=0):
                alike = np.flatnonzero((self.points == point).all(axis=1) & (self.accurate == accurate)).tolist()
                again = {f"{number + 1} (seed + {number})": levels_mm[number] for number in alike}
                done = {name: level_mm for name, level_mm in again.items() if level_mm is not None}
                require_different(done.values(), list(done), source.name)

    def _levels_mm(self, source: Source) -> list[Floats | None]:
        wanted = [(settings_at(self.frees, point), seed) for seed, point in enumerate(self.points)]
        levels_mm: list[Floats | None] = [None] * len(wanted)
        for accurate, runner in ((False, source.run), (True, source.accurate)):
            numbers = self._of_kind(source, accurate=accurate)
            if runner and numbers:
                done = runner([wanted[number] for number in numbers])
                for number, level_mm in zip(numbers, done, strict=True):
                    levels_mm[number] = level_mm
        return levels_mm

    def _of_kind(self, source: Source, *, accurate: bool) -> list[int]:
        """Return the numbers of the runs that correct a trial's drafts, or of its other runs."""
        return np.flatnonzero((self.accurate & (source.accurate is not None)) == accurate).tolist()

    def done(self, trial: int, *, accurate: bool = False) -> tuple[Floats, Floats]:
        """Return points and levels of a trial's runs of one kind that have a result."""
        levels_mm = self.levels_mm[trial]
        numbers = [at for at in self._of_kind(self.sources[trial], accurate=accurate) if levels_mm[at] is not None]
        return self.points[numbers], np.array([levels_mm[number] for number in numbers])

    def _corrected(self, trial: int) -> Correction:
        """Return the mean difference of accurate runs from the levels that drafts have at the same settings."""
        at, levels_mm = self.done(trial, accurate=True)
        if not len(at):
            raise NumericalError(
                f"{self.sources[trial].name}: all accurate runs failed, or their volume is off by over 5 %; nothing "
                "corrects the drafts. Use finer particles."
            )
        drafts = Emulator.fitted(*self.done(trial))
        scatter = drafts.scatter.relative(at).mean() / len(at)
        return Correction((levels_mm - drafts.levels_mm(at)).mean(axis=0), scatter * drafts.run_noise_mm2)

    def posterior(self) -> tuple[Posterior, list[BasisReach]]:
        emulators, reaches, evidence = [], [], []
        for trial, source in enumerate(self.sources):
            points, levels_mm = self.done(trial)
            covariance_mm2 = source.evidence.covariance_mm2
            if source.accurate:
                self.corrections[trial] = correction = self._corrected(trial)
                at, accurate_mm = self.done(trial, accurate=True)
                points, levels_mm = np.vstack([points, at]), np.vstack([levels_mm + correction.add_mm, accurate_mm])
                covariance_mm2 = covariance_mm2 + correction.error_mm2
            evidence.append(replace(source.evidence, covariance_mm2=covariance_mm2))
            reach = reach_of(points, levels_mm, evidence[-1])
            emulators.append(Emulator.fitted(points, levels_mm, reach.components))
            reaches.append(reach)
        return Posterior(self.frees, emulators, evidence), reaches

    def result(
        self, posterior: Posterior, reaches: Sequence[BasisReach], least: float, draws: Floats | None
    ) -> SearchResult:
        values = self.frees, self.points, self.levels_mm, reaches, posterior, least, draws
        return SearchResult(*values, accurate=int(self.accurate.sum()), corrections=self.corrections)

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


def launches_after(done: int, budget: int, *, corrects: bool = False) -> list[tuple[int, bool]]:
    """Return the launches of a trial that follow ``done`` runs, if the search does not stop.

    Each is a number of runs, and True for accurate runs that correct drafts, as ``corrects`` tells.
    """
    before = FIRST + AGAIN + CORRECT * corrects
    ends = {0: False, FIRST: False, FIRST + AGAIN: False, before: corrects}
    ends |= dict.fromkeys([*range(before + ROUND, budget - CONFIRM, ROUND), budget - CONFIRM], False)
    ends[budget] = corrects
    launches = [(begin, end, ends[end]) for begin, end in pairwise(sorted(ends))]
    return [(end - max(begin, done), accurate) for begin, end, accurate in launches if end > done]


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
    nearest = at.points[[at.nearest()]]
    at.run(np.repeat(nearest, AGAIN, axis=0))
    if at.corrects:
        at.run(np.repeat(nearest, CORRECT, axis=0), accurate=True)
    posterior, reaches = at.posterior()
    while len(at.points) < budget - CONFIRM and posterior.least_implausibility <= HOPELESS:
        error = f"implausibility of the best setting {posterior.least_implausibility:.2f} (at most 1 is plausible)"
        say(f"{len(at.points)} of {budget} runs: {error}.")
        at.run(at.next_round(posterior, min(ROUND, budget - CONFIRM - len(at.points))))
        posterior, reaches = at.posterior()
    least = posterior.least_implausibility
    if least > 1 or not all(reach.possible for reach in reaches):
        return at.result(posterior, reaches, least, None)
    best = at.next_round(posterior, 1)[0]
    at.run(np.tile(best, (CONFIRM, 1)), accurate=at.corrects)
    posterior, reaches = at.posterior()
    draws, mixing = posterior.draws(DRAWS, STEPS)
    return replace(at.result(posterior, reaches, least, draws), mixing=mixing, best=best)
