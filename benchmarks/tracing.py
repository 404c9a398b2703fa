"""Cracks with an exact truth, traced between clicked ends: how far off, and what is refused.

    python benchmarks/tracing.py [--tier clean|hard|branched|wide|thin|refused] [--seeds N] [--wide N] [--first SEED]

Clean: at least 16 px wide, diffuse light, at most 0.15 mm/px, camera tilted to 10 degrees, every second one through a
lens with k1 to -0.2. Hard: the same with one difficulty, and the means that the tool has against it. Branched: clean
ones with a side crack, dropped or kept; they are shown and have no targets. Wide: obvious cracks of 12 to 150 px on
another ground of 1 to 24 Mpx, ends clicked up to 5 px off, and a fifth as many of that ground without one. Thin: cracks
of 2 to 8 px, whose width is fitted. Refused: photos and hints of which nothing can be measured. The photos are
procedural: they say what tracing can do, not what a camera will give it. Goals are the medians of our first study, less
a third.

Each kind of photo is a file: tracing_cases, tracing_wide, tracing_thin, tracing_refusals; real photos are judged by
real_roads.
"""

import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from typer import Option

from benchmarks.table import Row, one_of, run_benchmark
from benchmarks.tracing_cases import HARD, Case, branched_case, clean_case, hard_case
from benchmarks.tracing_figures import Figures, trace_case
from benchmarks.tracing_refusals import REFUSALS, refused
from benchmarks.tracing_thin import ENLARGED, ENLARGED_EACH, THIN_EACH, ThinFigures, thin_rows, trace_thin_photo
from benchmarks.tracing_thin import WIDTHS_PX as THIN_WIDTHS_PX
from benchmarks.tracing_wide import WideFigures, trace_wide, wide_rows
from fixtures.generate.recipe import Recipe

SHOWN = ("centreline_mm", "wall_mm", "width_percent", "length_percent", "end_mm", "scale_percent", "iou", "time_s")
GOAL = 2 / 3
WITHOUT = 5
"""Obvious cracks for each photo without one."""


@dataclass(frozen=True)
class Traced:
    case: Case
    figures: Figures


def main(
    tier: Annotated[str | None, one_of(("clean", "hard", "branched", "wide", "thin", "refused"))] = None,
    seeds: Annotated[int, Option(help="clean cracks; of each other kind an eighth of them")] = 32,
    wide: Annotated[int, Option(help="obvious cracks, and a fifth as many photos without one")] = 40,
    first: Annotated[int, Option(help="first seed: others than those that the tool was made with")] = 1,
) -> list[Row]:
    # One thread, so that process time is that of one core.
    cv2.setNumThreads(1)
    cases = list(_cases(tier, seeds, first))
    with tempfile.TemporaryDirectory() as folder:
        traced = [_traced(case, Path(folder)) for case in cases]
        answers = _refusals(Path(folder), first) if tier in (None, "refused") else {}
        obvious = _wide(Path(folder), wide, first) if tier in (None, "wide") else []
        thin = _thin(Path(folder), first) if tier in (None, "thin") else []
    rows = [*_rows(traced, "clean", 1), *_rows(traced, "hard", 2), *wide_rows(obvious), *thin_rows(thin)]
    rows += _refusal_rows(answers)
    if traced:
        _print_cases(traced)
        _print_groups(traced)
    for one in obvious:
        print(f"{one.name:<44} {one.summary}")
    for shy in filter(lambda one: one.refusal, thin):
        print(f"{shy.name:<32} {shy.refusal}")
    for name, answer in answers.items():
        print(f"{name:<32} {'refused by name' if answer is None else answer}")
    print()
    return rows


def _cases(tier: str | None, seeds: int, first: int) -> Sequence[Case]:
    clean = [clean_case(seed) for seed in range(first, first + seeds)] if tier in (None, "clean") else []
    each = range(first, first + max(2, seeds // 8))
    hard = [hard_case(kind, seed) for kind in HARD for seed in each] if tier in (None, "hard") else []
    branched = [branched_case(keep, seed) for keep in (False, True) for seed in each]
    return [*clean, *hard, *(branched if tier in (None, "branched") else [])]


def _traced(case: Case, folder: Path) -> Traced:
    figures = trace_case(case, folder)
    print(
        f"{case.name}: {figures.refusal or f'walls {figures.wall_mm:.3f} mm, {figures.time_s:.1f} s'}", file=sys.stderr
    )
    return Traced(case, figures)


def _refusals(folder: Path, first: int) -> dict[str, str | None]:
    answers = {}
    for case in REFUSALS:
        answers[case.name] = refused(case, first, folder)
        print(f"{case.name}: {answers[case.name] or 'refused by name'}", file=sys.stderr)
    return answers


def _wide(folder: Path, count: int, first: int) -> list[WideFigures]:
    seeds = [(True, first + number) for number in range(count)]
    seeds += [(False, first + number) for number in range(count // WITHOUT)]
    traced = []
    for drawn, seed in seeds:
        traced.append(trace_wide(seed, drawn, folder))
        print(f"{traced[-1].name}: {traced[-1].summary}", file=sys.stderr)
    return traced


def _thin(folder: Path, first: int) -> list[ThinFigures]:
    plain = [(seed, width_px, 1) for width_px in THIN_WIDTHS_PX for seed in range(first, first + THIN_EACH)]
    enlarged = [(seed, *ENLARGED) for seed in range(first, first + ENLARGED_EACH)]
    return [trace_thin_photo(seed, width_px, folder, times) for seed, width_px, times in (*plain, *enlarged)]


def _print_cases(traced: Sequence[Traced]) -> None:
    print(f"{'case':<34} {'mm/px':>6} {'width px':>8} " + _heading())
    for one in traced:
        recipe = one.case.recipe
        begin = f"{one.case.name:<34} {recipe.mm_per_px:>6.3f} {recipe.width_mm / recipe.mm_per_px:>8.1f} "
        print(begin + (one.figures.refusal or _line([getattr(one.figures, name) for name in SHOWN])))
    print()


def _print_groups(traced: Sequence[Traced]) -> None:
    print(f"{'group':<42} {'':<8}" + _heading())
    for group in dict.fromkeys(f"{one.case.tier} {one.case.group}" for one in traced):
        members = [one.figures for one in traced if f"{one.case.tier} {one.case.group}" == group]
        columns = [np.nan_to_num([getattr(member, name) for member in members], nan=np.inf) for name in SHOWN]
        worst = [
            float(column.min() if name == "iou" else column.max()) for name, column in zip(SHOWN, columns, strict=True)
        ]
        print(f"{f'{group} ({len(members)})':<42} {'worst':<8}{_line(worst)}")
        print(f"{'':<42} {'median':<8}{_line([float(np.median(column)) for column in columns])}")
    print()


def _heading() -> str:
    names = [name.removesuffix("_mm").removesuffix("_percent").removesuffix("_s") for name in SHOWN]
    units = ["mm", "mm", "%", "%", "mm", "%", "", "s"]
    return " ".join(f"{f'{name} {unit}'.strip():>13}" for name, unit in zip(names, units, strict=True))


def _line(values: Sequence[float]) -> str:
    return " ".join(f"{value:>13.3f}" for value in values)


@dataclass(frozen=True)
class Target:
    """What the worst clean case may miss by, and the median of the study."""

    name: str
    figure: str
    unit: str
    limit: float
    study: float
    counts: Callable[[Recipe], bool] = lambda recipe: True


TARGETS = (
    Target("centreline RMS", "centreline_mm", "mm", 0.1, 0.019),
    Target("walls RMS", "wall_mm", "mm", 0.15, 0.052),
    Target("mean width", "width_percent", "%", 2, 0.8),
    Target("length, closed", "length_percent", "%", 0.5, 0.11, lambda recipe: recipe.ends == "closed"),
    Target("length, open", "length_mm", "mm", 2, 0.54, lambda recipe: recipe.ends == "open"),
    Target("scale", "scale_percent", "%", 0.1, 0.008, lambda recipe: recipe.lens_k1 == 0),
    Target("scale, bent", "scale_percent", "%", 0.3, 0.09, lambda recipe: recipe.lens_k1 != 0),
)


def _rows(traced: Sequence[Traced], tier: str, slack: float) -> list[Row]:
    """The targets of a tier, worst case; ``slack`` is how much more the hard ones may miss."""
    rows = []
    for target in TARGETS:
        figures = [
            getattr(one.figures, target.figure)
            for one in traced
            if one.case.tier == tier and target.counts(one.case.recipe)
        ]
        if figures:
            # A refused photo is as far off as can be.
            values = np.nan_to_num(figures, nan=np.inf)
            name = f"{tier}: {target.name}, worst of {len(values)}"
            goal = f"median {GOAL * target.study:.2g}: {np.median(values):.2g}"
            rows.append(Row(name, float(values.max()), target.unit, 0, slack * target.limit, goal))
    return rows


def _refusal_rows(answers: dict[str, str | None]) -> list[Row]:
    if not answers:
        return []
    by_name = sum(answer is None for answer in answers.values())
    return [Row("out of range: refused by name", by_name, "", len(answers), len(answers))]


if __name__ == "__main__":
    run_benchmark(main)
