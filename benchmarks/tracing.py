"""Cracks with an exact truth, traced between clicked ends: how far off, and what is refused.

    python -m benchmarks.tracing [--tier clean|hard|oblique|wide|thin] [--seeds N] [--wide N] [--first SEED]

Clean: at least 16 px wide, diffuse light, at most 0.15 mm/px, camera tilted to 10 degrees, every second one through a
lens with k1 to -0.2. Hard: the same with one difficulty, and the means that the tool has against it. Oblique: open at
both edges, 0 to 60 degrees from square. Wide: obvious cracks of 12 to 150 px on another ground of 1 to 24 Mpx, ends
clicked up to 5 px off, and a fifth as many of that ground without one. Thin: cracks of 2 to 8 px, whose width is
fitted. The photos are procedural: they say what tracing can do, not what a camera will give it.

Each kind of photo is a file: tracing_cases, tracing_wide, tracing_thin; coarse roads are judged by tracing_roads, real
photos by real_roads.
"""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from typer import Option

from benchmarks.table import Row, one_of, run_benchmark
from benchmarks.tracing_cases import HARD, Case, clean_case, hard_case, oblique_case
from benchmarks.tracing_figures import Figures, trace_case
from benchmarks.tracing_thin import thin_rows, trace_thin
from benchmarks.tracing_wide import trace_obvious, wide_rows
from fixtures.generate.recipe import Recipe


@dataclass(frozen=True)
class Traced:
    case: Case
    figures: Figures


@dataclass(frozen=True)
class Target:
    """What the worst clean case may miss by."""

    name: str
    figure: str
    unit: str
    limit: float
    counts: Callable[[Recipe], bool] = lambda recipe: True


TARGETS = (
    Target("centreline RMS", "centreline_mm", "mm", 0.1),
    Target("walls RMS", "wall_mm", "mm", 0.15),
    Target("mean width", "width_percent", "%", 2),
    Target("length, closed", "length_percent", "%", 0.5, lambda recipe: recipe.ends == "closed"),
    Target("length, open", "length_mm", "mm", 2, lambda recipe: recipe.ends == "open"),
    Target("scale", "scale_percent", "%", 0.1, lambda recipe: recipe.lens_k1 == 0),
    Target("scale, bent", "scale_percent", "%", 0.3, lambda recipe: recipe.lens_k1 != 0),
)
MAX_LENGTH_PERCENT = 0.3
HARDER = {"clean": 1, "hard": 2}
"""How much more than a clean case a case of each tier may miss by."""


def main(
    tier: Annotated[str | None, one_of((*HARDER, "oblique", "wide", "thin"))] = None,
    seeds: Annotated[int, Option(help="clean cracks; of each hard kind an eighth of them")] = 32,
    wide: Annotated[int, Option(help="obvious cracks, and a fifth as many photos without one")] = 40,
    first: Annotated[int, Option(help="first seed: others than those that the tool was made with")] = 1,
) -> list[Row]:
    # One thread, so that processor time is that of one core.
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        traced = [Traced(case, trace_case(case, folder)) for case in _cases(seeds, first) if tier in (None, case.tier)]
        oblique = [oblique_case(seed) for seed in range(first, first + seeds)] if tier in (None, "oblique") else []
        lengths = [trace_case(case, folder).length_percent for case in oblique]
        obvious = list(trace_obvious(first, wide, folder)) if tier in (None, "wide") else []
        thin = list(trace_thin(first, folder)) if tier in (None, "thin") else []
    for each in traced:
        print(f"{each.case.name}: {each.figures.summary}")
    for each in (*obvious, *thin):
        print(f"{each.name}: {each.summary}")
    tiers = (row for harder in HARDER for row in tier_rows(traced, harder))
    return [*tiers, *oblique_rows(lengths), *wide_rows(obvious), *thin_rows(thin)]


def oblique_rows(length_percent: Sequence[float]) -> list[Row]:
    if not length_percent:
        return []
    # A refused photo is as far off as can be.
    values = np.nan_to_num(length_percent, nan=np.inf)
    worst = f"worst {values.max():.2g}, {np.sum(values > MAX_LENGTH_PERCENT)} over the target"
    name = f"oblique: length, median of {len(values)}"
    return [Row(name, float(np.median(values)), "%", 0, MAX_LENGTH_PERCENT, worst)]


def _cases(seeds: int, first: int) -> Iterator[Case]:
    for seed in range(first, first + seeds):
        yield clean_case(seed)
    for kind in HARD:
        for seed in range(first, first + max(2, seeds // 8)):
            yield hard_case(kind, seed)


def tier_rows(traced: Sequence[Traced], tier: str) -> list[Row]:
    """Return the targets of a tier, each with its worst case."""
    rows = []
    for target in TARGETS:
        figures = [
            getattr(each.figures, target.figure)
            for each in traced
            if each.case.tier == tier and target.counts(each.case.recipe)
        ]
        if figures:
            # A refused photo is as far off as can be.
            values = np.nan_to_num(figures, nan=np.inf)
            name = f"{tier}: {target.name}, worst of {len(values)}"
            median = f"median {np.median(values):.2g}"
            rows.append(Row(name, float(values.max()), target.unit, 0, HARDER[tier] * target.limit, median))
    return rows


if __name__ == "__main__":
    run_benchmark(main)
