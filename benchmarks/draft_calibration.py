"""Calibrations by drafts that accurate runs correct, against those by accurate runs alone, for fourteen truths.

    python -m benchmarks.draft_calibration [--truths 14] [--radius-mm 1.2]

The truths, their EMULATED readings and the accurate runs are those of ``benchmarks.calibration``. The drafts fill the
same slot, with larger particles and longer substeps as ``sealtwin calibrate`` has them. Each truth is searched by
accurate runs, by drafts alone, and by drafts that six accurate runs correct. The median of each setting is compared
with that by accurate runs, over the 90 % width that it has there.

Two searches by accurate runs that differ in their seeds alone have different medians too: their difference is what a
perfect method would show, and the target is a multiple of it. All takes some 12 minutes of one core.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks.calibration import (
    ACCURATE,
    BAR,
    BUDGET,
    FREES,
    NOZZLE,
    SETTLE_S,
    TRUTHS,
    Library,
    fill,
    readings,
    slot,
    truths,
)
from benchmarks.table import Row, run_benchmark
from sealtwin.calibration.search import SearchResult, Setting, Source, search
from sealtwin.core.records import Floats
from simulate.settings import Solver
from validate.calibration.free import marginals_of

OTHER_SEEDS = 5000  # Added to the seeds of the second search by accurate runs
QUARTER = 0.25  # Difference of two medians over the width
WORSE = 1.5
"""Largest ratio of the root mean squares. By fourteen truths, a method as good as accurate runs misses it once in a
hundred draws."""


class Runs:
    """Runs of one solver, each computed once."""

    def __init__(self, solver: Solver, first_seed: int = 0) -> None:
        self._solver, self._first_seed = solver, first_seed
        self._levels_mm: dict[tuple[float, ...], Floats] = {}

    def run(self, wanted: Sequence[tuple[Setting, int]]) -> Sequence[Floats | None]:
        return [self._one(setting, self._first_seed + seed) for setting, seed in wanted]

    def _one(self, setting: Setting, seed: int) -> Floats:
        key = (*setting.values(), float(seed))
        if key not in self._levels_mm:
            self._levels_mm[key] = fill(setting, seed, self._solver)
        return self._levels_mm[key]


def main(
    count: Annotated[int, Option("--truths")] = TRUTHS,
    radius_mm: Annotated[float | None, Option(help="of the drafts; their own by default")] = None,
) -> list[Row]:
    (outline, _), size_mm = slot(), radius_mm or "auto"
    draft = Solver(preset="draft", radius_mm=size_mm, settle_s=SETTLE_S).for_crack(outline.mean_width_mm, NOZZLE)
    library, drafts, accurate, again = Library(), Runs(draft), Runs(ACCURATE), Runs(ACCURATE, OTHER_SEEDS)
    ways = {
        "accurate runs": (library.run, None),
        "accurate runs of other seeds": (again.run, None),
        "drafts alone": (drafts.run, None),
        "drafts, corrected": (drafts.run, accurate.run),
    }
    results: dict[str, list[SearchResult]] = {way: [] for way in ways}
    for number, truth in enumerate(truths()[:count]):
        evidence = readings(library, number, truth)
        for way, (run, correcting) in ways.items():
            result = search(FREES, [Source("slot", evidence, run, correcting)], BUDGET, lambda _: None)
            results[way].append(result)
            print(f"truth {number + 1}, {way}: implausibility {result.least_implausibility:.2f}", flush=True)
    return rows(results)


def rows(results: Mapping[str, Sequence[SearchResult]]) -> list[Row]:
    """Return the figures; the first of ``results`` is the reference, the second shows chance, the last has targets."""
    reference, *others = results
    apart = {way: _apart(results[way], results[reference]) for way in others}
    by_chance, total = _rms(apart[others[0]]), len(results[reference])
    corrections_mm = np.array([one.add_mm for result in results[others[-1]] if (one := result.corrections[0])])
    table = [
        Row("what is added to the drafts, mean", float(corrections_mm.mean()), "mm"),
        Row("what is added to the drafts, RMS along the slot", _rms(corrections_mm), "mm"),
    ]
    for way, values in apart.items():
        table += [
            Row(f"{way}: {free.name}, medians apart over the 90 % width, RMS", _rms(column), "")
            for free, column in zip(FREES, values.T, strict=True)
        ]
        far = 100 * float((np.abs(values) > QUARTER).mean())
        table.append(Row(f"{way}: medians apart by over a quarter of the width", far, "%"))
        worse = WORSE if way == others[-1] else np.inf
        table.append(
            Row(f"{way}: medians apart, RMS, over that of other seeds", _rms(values) / by_chance, "", 0, worse)
        )
    for way, its in results.items():
        judged = way == others[-1]
        possible = sum(one.possible for one in its)
        table.append(Row(f"{way}: truths in 90 % intervals", 100 * _held(its), "%", BAR[0] if judged else 0.0))
        table.append(Row(f"{way}: readings possible, of {total}", possible, "", total - 1 if judged else 0.0))
    return table


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _apart(ours: Sequence[SearchResult], theirs: Sequence[SearchResult]) -> Floats:
    """Return how far medians are apart, over the 90 % widths of ``theirs``, (truths, settings), if both have draws."""
    rows = []
    for one, other in zip(ours, theirs, strict=True):
        if one.draws is not None and other.draws is not None:
            low, middle, high = np.quantile(other.draws, [0.05, 0.5, 0.95], axis=0)
            rows.append((np.median(one.draws, axis=0) - middle) / (high - low))
    return np.array(rows)


def _held(results: Sequence[SearchResult]) -> float:
    """Return the share of the true settings that 90 % intervals hold, of readings that are possible."""
    holds = [
        one.low <= truth[one.free.name] <= one.high
        for truth, result in zip(truths(), results, strict=False)
        if result.draws is not None
        for one in marginals_of(FREES, result.draws, result.best)
    ]
    return float(np.mean(holds))


if __name__ == "__main__":
    run_benchmark(main)
