"""How far single runs scatter: the pairs that decide, with other seeds, and draws for the judgements."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reports.reproduction.claims import FARTHEST, NEAREST
from reports.reproduction.redrawn import errors_against
from reports.reproduction.surface import CHOSEN, Surface, along, surfaces_of
from sealtwin.core.records import Floats, Profile
from sealtwin.core.replicates import require_different
from validate.figures.chart import Chart, Finished

Pair = tuple[float, float]
SEEDS = (1, 2, 3, 4, 5)
"""Beside the study's own, 0."""
ALONG_U: tuple[Pair, ...] = ((1.0, 0.01), (10_000.0, 0.01))
"""Thin and stiff fluids, so that every pair of the map has one near it that was run again."""


@dataclass(frozen=True)
class Replicates:
    """Pairs of a study that were run again, each by its run in the study and those with other seeds."""

    pairs: tuple[Pair, ...]
    runs: tuple[tuple[Finished, ...], ...]
    """As many for each pair, the study's own first."""

    def of(self, pair: Pair) -> tuple[Finished, ...]:
        return self.runs[self.pairs.index(pair)]

    def errors_mm(self, readings: Profile, redrawn: Sequence[Profile]) -> Floats:
        """Mean errors against each set of readings, (sets, pairs, runs of a pair)."""
        flat = [run for runs in self.runs for run in runs]
        return errors_against(flat, readings, redrawn).reshape(len(redrawn), len(self.pairs), -1)


def deciding_pairs(chart: Chart) -> list[Pair]:
    """The pairs that the paper names, the nearest and the farthest of ours, and two that span U; each once."""
    farthest = chart.runs[int(np.argmax(chart.errors_mm))].at
    there = {run.at for run in chart.runs}
    wanted = (CHOSEN, NEAREST, FARTHEST, chart.best.at, farthest, *ALONG_U)
    return [pair for pair in dict.fromkeys(wanted) if pair in there]


def join(chart: Chart, again: Sequence[tuple[Pair, Finished]]) -> Replicates:
    """Return the pairs of which there are runs ``again``, each with its run in the study."""
    pairs = tuple(dict.fromkeys(pair for pair, _ in again))
    own = {run.at: run for run in chart.runs}
    runs = tuple((own[pair], *(run for at, run in again if at == pair)) for pair in pairs)
    for pair, alike in zip(pairs, runs, strict=True):
        names = [f"{number} with another seed" if number else "of the study" for number in range(len(alike))]
        require_different([run.profile.level_mm for run in alike], names, f"U and D of {pair}")
    # Where one failed, all pairs are known by as many as the least known one.
    fewest = min(len(each) for each in runs)
    return Replicates(pairs, tuple(each[:fewest] for each in runs))


def draws_of(chart: Chart, replicates: Replicates | None, redrawn: Sequence[Profile]) -> list[Surface]:
    """Return a surface for each set of readings, its runs scattered once more.

    A pair scatters as the pair that was run again and lies nearest to it on the map, by a standard deviation that so
    many runs leave unsure: t-distributed. The error along the crack is that of one of the chosen pair's runs. Without
    replicates, pairs scatter as their neighbours on the map do.
    """
    random = np.random.default_rng(1)
    surfaces = surfaces_of(chart, errors_against(chart.runs, chart.readings, redrawn), redrawn)
    normal = random.standard_normal((len(redrawn), len(chart.runs)))
    if replicates is None:
        return [each.scattered(chart.scatter_mm * by, each.chosen) for each, by in zip(surfaces, normal, strict=True)]
    errors_mm = replicates.errors_mm(chart.readings, redrawn)
    freedom = errors_mm.shape[2] - 1
    spread_mm = errors_mm.std(axis=2, ddof=1) * np.sqrt(freedom / random.chisquare(freedom, errors_mm.shape[:2]))
    by_mm = spread_mm[:, _nearest(chart, replicates)] * normal
    chosen = replicates.of(CHOSEN)
    taken = random.integers(len(chosen), size=len(redrawn))
    return [
        surface.scattered(by, along(chosen[one].profile, readings))
        for surface, by, one, readings in zip(surfaces, by_mm, taken, redrawn, strict=True)
    ]


def _nearest(chart: Chart, replicates: Replicates) -> Floats:
    """Number of the replicated pair that is nearest to each run, by powers of ten of U and of D, (r,)."""
    at, around = (np.log10(np.array(pairs)) for pairs in ([run.at for run in chart.runs], replicates.pairs))
    return np.argmin(((at[:, None] - around) ** 2).sum(axis=2), axis=1)
