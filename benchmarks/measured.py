"""Dam breaks and pours that others measured, computed with nothing fitted to a flow.

    python -m benchmarks.measured [--picture docs/images/measured.png]

``measured/measured.toml`` has the cases, their sources and licences, and the targets, written before the first run.
It takes about a quarter of an hour. The materials of the dam breaks have flow curves from a rheometer, fitted by
'sealtwin material rheometer'. One shift of the clock is the same in all of them. Fronts under 10 mm and outlines 4 and
6 are reported.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks import measured_pours
from benchmarks.block_release import FluidBlock, release
from benchmarks.table import Row, processes, run_benchmark
from sealtwin.core.records import Floats
from simulate.injection import ComputeOptions
from simulate.settings import Fluid, Solver
from tests.support.dam_breaks import DamBreak, content, dam_breaks, fluid_of, with_curve

Course = tuple[Floats, Floats]
"""Course of a dam break: times in s after the gate was removed, and the positions of the front in mm."""


def course_of(case: DamBreak, fluid: Fluid | None = None, solver: Solver | None = None, seed: int = 0) -> Course:
    """Simulate a dam break until shortly after the last measured outline, and return the course of its front.

    The fluid and the particles' size are by default those of the case.
    """
    outline_s = content()["clock"]["outline_s"]
    block = FluidBlock(
        length_mm=case.length_mm,
        width_mm=content()["boxes"]["width_mm"],
        height_mm=case.height_mm,
        ahead_mm=2.5 * (case.length_mm + case.height_mm),
        duration_s=9.2 * outline_s,
        every_s=outline_s / 4,
    )
    fluid, solver = fluid or fluid_of(case.material), solver or Solver(radius_mm=case.radius_mm)
    run = release(block, fluid, solver, options=ComputeOptions("cpu", threads=1), seed=seed)
    return run.t_s, run.front_mm


def computed_mm(course: Course, shift: float | None = None) -> Floats:
    """Return the computed front positions at the times of outlines 0 to 8 of the film, in mm, (9,).

    ``shift`` is how far the simulation is ahead of the film, in outlines. Default: the shift in measured.toml.
    """
    t_s, front_mm = course
    ahead: float = content()["calibrated"]["shift_outlines"] if shift is None else shift
    return np.interp((np.arange(9) + ahead) * content()["clock"]["outline_s"], t_s, front_mm)


Fronts = Mapping[DamBreak, Floats]
"""Computed positions of the front at outlines 0 to 8 in mm, (9,), by dam break."""


def best_shift(courses: Mapping[DamBreak, Course]) -> float:
    """Return the one shift in outlines with which the fronts at the outlines that no target judges differ least."""
    clock = content()["clock"]
    at = clock["chosen_from"]

    def difference(shift: float) -> float:
        logs = (np.log(computed_mm(course, shift)[at] / box.measured_mm[at]) for box, course in courses.items())
        return float(sum(np.square(each).sum() for each in logs))

    return min(np.linspace(0.0, clock["most_outlines"], 51).tolist(), key=difference)


def rows_of(fronts: Fronts, shift: float) -> Iterator[Row]:
    clock, targets = content()["clock"], content()["targets"]
    judged = clock["judged"]
    yield Row("shift of the clock, all cases", 1000 * shift * clock["outline_s"], "ms")
    for box, front_mm in fronts.items():
        for outline in judged:
            name = f"{box.name}, outline {outline}: {box.measured_mm[outline]:g} mm, computed"
            yield Row(name, float(front_mm[outline]), "mm")
    logs = np.array([np.log(front_mm[judged] / box.measured_mm[judged]) for box, front_mm in fronts.items()])
    at_end = logs[[box.measured_mm[-1] > content()["boxes"]["least_front_mm"] for box in fronts], -1]
    of = "computed over measured, outline 8, fronts over 10 mm"
    yield Row(f"{of}: bias", float(np.exp(at_end.mean())), "", *targets["bias"])
    yield Row(f"{of}: scatter", 100 * float(at_end.std(ddof=1)), "%", 0.0, targets["scatter_percent"])
    worst = 100 * float(np.abs(np.expm1(at_end)).max())
    yield Row(f"{of}: worst", worst, "%", 0.0, targets["worst_percent"])
    of = "computed over measured, outlines 4, 6 and 8, all fronts"
    yield Row(f"{of}: bias", float(np.exp(logs.mean())), "")
    yield Row(f"{of}: scatter", 100 * float(logs.std(ddof=1)), "%")


def draw(fronts: Fronts, poured: Iterable[tuple[measured_pours.Pour, Floats]], path: Path) -> None:
    """Draw all pairs, of dam breaks at the judged outlines, with lines at 0.9 and 1.1 times the measured front."""
    from matplotlib import pyplot

    judged = content()["clock"]["judged"]
    figure, axes = pyplot.subplots(figsize=(6.0, 5.6), layout="constrained")
    ends = np.array([1.5, 130.0])
    axes.fill_between(ends, 0.9 * ends, 1.1 * ends, color="0.9", linewidth=0, label="within 10 %")
    axes.plot(ends, ends, color="0.4", linewidth=1.0)
    for box, front_mm in fronts.items():
        (line,) = axes.plot(box.measured_mm[judged], front_mm[judged], "-o", markersize=4, label=box.name)
        end_mm, colour = (box.measured_mm[-1], front_mm[-1]), line.get_color()
        axes.plot(*end_mm, "o", markersize=9, color=colour, markerfacecolor="none")
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
        cases = dam_breaks(with_curve())
        courses = dict(zip(cases, pool.map(course_of, cases), strict=True))
        poured = list(zip(pours, extents_mm, strict=True))
    shift = best_shift(courses)
    fronts = {box: computed_mm(course, shift) for box, course in courses.items()}
    if picture is not None:
        draw(fronts, poured, picture)
    return [*rows_of(fronts, shift), *measured_pours.rows_of(poured)]


if __name__ == "__main__":
    run_benchmark(main)
