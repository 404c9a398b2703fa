"""Dam breaks and pours that others measured, computed with nothing fitted to a flow.

    python -m benchmarks.measured [--picture docs/images/measured.png]

``measured/measured.toml`` has the cases, their sources and licences, and the targets, written before the first run.
It takes about a quarter of an hour. The materials of the dam breaks have flow curves from a rheometer, fitted by
'sealtwin material rheometer'. One shift of the clock is the same in all of them. Fronts under 10 mm and outlines 4 and
6 are reported.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks import measured_pours
from benchmarks.measured_blocks import (
    Course,
    DamBreak,
    computed_mm,
    content,
    course_of,
    dam_breaks,
    fluid_of,
    with_curve,
)
from benchmarks.table import Row, processes, run_benchmark
from sealtwin.core.records import Floats


def _course(box: DamBreak) -> Course:
    return course_of(box, fluid_of(box.material))


def best_shift(courses: Mapping[DamBreak, Course]) -> float:
    """Return the one shift in outlines with which the fronts at the outlines that no target judges differ least."""
    clock = content()["clock"]
    at = clock["chosen_from"]

    def difference(shift: float) -> float:
        logs = (np.log(computed_mm(course, shift)[at] / box.measured_mm[at]) for box, course in courses.items())
        return float(sum(np.square(each).sum() for each in logs))

    return min(np.linspace(0.0, clock["most_outlines"], 51).tolist(), key=difference)


@dataclass(frozen=True)
class Pairs:
    """Computed and measured fronts of the materials with a flow curve."""

    boxes: Sequence[DamBreak]
    shift: float  # Of the clock, in outlines
    computed_mm: Floats  # (boxes, 9) at outlines 0 to 8

    @property
    def measured_mm(self) -> Floats:
        return np.array([box.measured_mm for box in self.boxes])

    @property
    def ratio(self) -> Floats:
        """Computed over measured fronts at outlines 1 to 8."""
        return self.computed_mm[:, 1:] / self.measured_mm[:, 1:]


def pairs(pool: Executor) -> Pairs:
    cases = dam_breaks(with_curve())
    courses = dict(zip(cases, pool.map(_course, cases), strict=True))
    shift = best_shift(courses)
    return Pairs(cases, shift, np.array([computed_mm(course, shift) for course in courses.values()]))


def rows_of(fronts: Pairs) -> Iterator[Row]:
    clock, targets = content()["clock"], content()["targets"]
    judged = clock["judged"]
    yield Row("shift of the clock, all cases", 1000 * fronts.shift * clock["outline_s"], "ms")
    for box, seen_mm, front_mm in zip(fronts.boxes, fronts.measured_mm, fronts.computed_mm, strict=True):
        for outline in judged:
            yield Row(
                f"{box.name}, outline {outline}: {seen_mm[outline]:g} mm, computed", float(front_mm[outline]), "mm"
            )
    long = fronts.measured_mm[:, -1] > content()["boxes"]["least_front_mm"]
    at_end = np.log(fronts.ratio[long, -1])
    of = "computed over measured, outline 8, fronts over 10 mm"
    yield Row(f"{of}: bias", float(np.exp(at_end.mean())), "", *targets["bias"])
    yield Row(f"{of}: scatter", 100 * float(at_end.std(ddof=1)), "%", 0.0, targets["scatter_percent"])
    worst = 100 * float(np.abs(np.expm1(at_end)).max())
    yield Row(f"{of}: worst", worst, "%", 0.0, targets["worst_percent"])
    everywhere = np.log(fronts.ratio[:, [outline - 1 for outline in judged]])
    of = "computed over measured, outlines 4, 6 and 8, all fronts"
    yield Row(f"{of}: bias", float(np.exp(everywhere.mean())), "")
    yield Row(f"{of}: scatter", 100 * float(everywhere.std(ddof=1)), "%")


def draw(fronts: Pairs, poured: Iterable[tuple[measured_pours.Pour, Floats]], path: Path) -> None:
    """Draw all pairs, of dam breaks at the judged outlines, with lines at 0.9 and 1.1 times the measured front."""
    from matplotlib import pyplot

    judged = content()["clock"]["judged"]
    figure, axes = pyplot.subplots(figsize=(6.0, 5.6), layout="constrained")
    ends = np.array([1.5, 130.0])
    axes.fill_between(ends, 0.9 * ends, 1.1 * ends, color="0.9", linewidth=0, label="within 10 %")
    axes.plot(ends, ends, color="0.4", linewidth=1.0)
    for box, seen_mm, front_mm in zip(fronts.boxes, fronts.measured_mm, fronts.computed_mm, strict=True):
        (line,) = axes.plot(seen_mm[judged], front_mm[judged], "-o", markersize=4, label=box.name)
        axes.plot(seen_mm[-1], front_mm[-1], "o", markersize=9, color=line.get_color(), markerfacecolor="none")
    for pour, mm in poured:
        axes.plot([seen_mm for _, _, seen_mm in pour.extents], mm, "s", markersize=5, label=pour.table["label"])
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends, aspect="equal")
    axes.set(xlabel="measured (mm)", ylabel="computed (mm)")
    axes.legend(fontsize=8, loc="upper left")
    axes.grid(color="0.9", linewidth=0.6)
    figure.savefig(path, dpi=130)


def main(
    picture: Annotated[Path | None, Option(help="a PNG for the plot of all pairs")] = None,
) -> list[Row]:
    pours = [measured_pours.Pour(name, table) for name, table in content()["poured"].items()]
    with processes(2) as pool:
        extents_mm = pool.map(measured_pours.computed_mm, pours)  # They take longest
        fronts = pairs(pool)
        poured = list(zip(pours, extents_mm, strict=True))
    if picture is not None:
        draw(fronts, poured, picture)
    return [*rows_of(fronts), *measured_pours.rows_of(poured)]


if __name__ == "__main__":
    run_benchmark(main)
