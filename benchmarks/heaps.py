"""Heaps of paste let go in a slot: how they go down, against interFoam, and where they stop, against limit analysis.

    python -m benchmarks.heaps [--only 5|9|12|15|limit|interfoam]

The paste is given as a trial file gives it, by viscosity and yield stress, and sticks to the walls by both. A heap
12 mm long and 24 mm high lies against the end of a slot of 3.1 mm, as in ``physics_yield.py``. interFoam's courses are
tables in ``benchmarks/interfoam``; it is not run. Levels are those in the slot's middle:
interFoam leaves films on the walls, thinner than a particle. While interFoam's
heap still goes down, ``heap_limit.py`` says where paste of that yield stress must stop. interFoam's heaps go on past
that: where particles differ, they are also given the lower yield stress that holds interFoam's. Two minutes.
"""

import csv
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, NamedTuple

import numpy as np
from typer import Option

from benchmarks.heap_limit import holding_pa
from benchmarks.interfoam.__main__ import LIMIT_M2_S, VISCOSITY_PA_S, slope
from benchmarks.interfoam.cases import DENSITY_KG_M3, HEAP_MM, SIZE_MM, TABLES, WIDTH_MM
from benchmarks.physics_tanks import GRAVITY_MM_S2, Pit, Tank, resolution, size_of, spacing_mm
from benchmarks.table import Row, run_benchmark
from sealtwin.core.records import Floats
from simulate.loose_fluid import filled_box_mm, substep_s
from simulate.settings import PAPERS_D_CM
from tests.fluids import FRAME_S, sealant

PIT = Pit(60.0, WIDTH_MM, 26.0)
WEIGHT_N_M3 = DENSITY_KG_M3 * GRAVITY_MM_S2 / 1e3
EVERY_S = 0.0125
SEEN_S, REST_S = 0.5, 2.0
"""The end of interFoam's courses, and when particles rest."""
AWAKE_PA = 12.0
"""The heap that is let go without sleep too."""
OFF, LATE = 0.1, 0.25
"""Of a slope, a height or a stress, and of a time."""
FACE_MM, FACE, FACE_OFF = 10.0, 3.83, 0.03
"""A vertical face that clay just holds is 3.83 tau / (rho g) high, by Taylor's slip circle; the best is 3.78."""


HALF_WAY, AT_REST = "time of half of the way down", "at rest, stress that holds it"
AS_LARGE = (0.98, 1.0, 1.02)
"""Sizes of particles, over a radius, whose mean is judged: by how they lie, times scatter by 6 % and slopes by 8 %."""


class Course(NamedTuple):
    """How a heap goes down: a row for each time."""

    t_s: Floats
    tan: Floats
    height_mm: Floats
    centre_mm: Floats
    """Height of the centre of all paste."""

    def time_at(self, centre_mm: float) -> float:
        """Time at which the centre comes down to a height."""
        return float(np.interp(-centre_mm, -self.centre_mm, self.t_s))

    def at(self, t_s: float) -> tuple[float, float]:
        """Tan and height."""
        row = int(np.abs(self.t_s - t_s).argmin())
        return float(self.tan[row]), float(self.height_mm[row])


@cache
def references() -> dict[tuple[float, float, float], Course]:
    """What interFoam found, by yield stress in Pa, cells in mm and limit of the viscosity in m2/s."""
    with (TABLES / "heaps.csv").open(newline="") as file:
        rows = [[float(part) for part in row] for row in list(csv.reader(file))[1:]]
    keys = dict.fromkeys((row[0], row[1], row[2]) for row in rows)
    return {key: Course(*np.array([row[3:] for row in rows if tuple(row[:3]) == key]).T) for key in keys}


def last_mm(yield_pa: float) -> tuple[Floats, Floats]:
    """Columns and levels of interFoam's heap at the end, in the slot's middle."""
    with (TABLES / "profiles.csv").open(newline="") as file:
        rows = np.array([[float(part) for part in row] for row in list(csv.reader(file))[1:]])
    x, level = rows[(rows[:, :3] == [yield_pa, SIZE_MM, SEEN_S]).all(axis=1)][:, [3, 5]].T
    return np.append(x, x[-1] + 1), np.append(level, 0.0)


def surface_mm(place_mm: Floats, radius_mm: float) -> tuple[Floats, Floats]:
    """Middles and levels of columns of a millimetre, in the middle half of the slot's width.

    Half a spacing above the topmost centres of strips as wide as a particle, and their mean.
    """
    strips = max(1, round(WIDTH_MM / 2 / (2 * radius_mm)))
    place = place_mm[np.abs(place_mm[:, 1]) < WIDTH_MM / 4]
    across = ((place[:, 1] / WIDTH_MM + 0.25) * 2 * strips).astype(int)
    top = np.zeros((round(PIT.length_mm), strips))
    np.maximum.at(top, (place[:, 0].astype(int), across), place[:, 2] + spacing_mm(radius_mm) / 2)
    return np.arange(len(top)).astype(float) + 0.5, np.asarray(top.mean(axis=1), dtype=float)


def collapse(
    yield_pa: float, radius_mm: float, preset: str = "accurate", *, sleep: bool = True, dragged: bool = False
) -> tuple[Course, float]:
    """The same heap in particles, and the yield stress that holds it as it lies at last.

    Walls may drag it by the paper's D beside its yield stress, in place of its viscosity.
    """
    paste = {"density_kg_m3": DENSITY_KG_M3, "yield_stress_pa": yield_pa, "viscosity_pa_s": VISCOSITY_PA_S}
    how = resolution(preset, radius_mm, substep_s(radius_mm))
    given: dict[str, Any] = {"fluid": sealant(**paste)}
    if dragged:
        given = {
            "viscosity_mm2_s": VISCOSITY_PA_S / DENSITY_KG_M3 * 1e6,
            "drag_mm": 10 * PAPERS_D_CM * how["step_s"] / FRAME_S,
            "yield_mm2_s2": yield_pa / DENSITY_KG_M3 * 1e6,
        }
    heap = filled_box_mm((0.0, -WIDTH_MM / 2, 0.0), (HEAP_MM[0], WIDTH_MM / 2, HEAP_MM[1]), radius_mm)
    tank = Tank.of(PIT, heap, sleep=sleep, **how, **given)
    rows = [(0.0, *_figures(tank))]
    for t_s in tank.run(REST_S):
        if t_s >= rows[-1][0] + EVERY_S:
            rows.append((t_s, *_figures(tank)))
    rows.append((REST_S, *_figures(tank)))
    holds_pa = holding_pa(*surface_mm(tank.place_mm, radius_mm), WIDTH_MM, WEIGHT_N_M3)
    return Course(*np.array(rows).T), holds_pa


def _figures(tank: Tank) -> tuple[float, float, float]:
    x, level = surface_mm(tank.place_mm, tank.radius_mm)
    return slope(x, level), float(level.max()), float(tank.place_mm[:, 2].mean())


def compared(ours: Course, theirs: Course) -> dict[str, float]:
    """One course over another, by the figure's name."""
    half_mm = (theirs.centre_mm[0] + theirs.centre_mm[-1]) / 2
    heights = {f"height after {t_s:g} s": ours.at(t_s)[1] / theirs.at(t_s)[1] for t_s in (SEEN_S / 2, SEEN_S)}
    time, tan = ours.time_at(half_mm) / theirs.time_at(half_mm), ours.at(SEEN_S)[0] / theirs.at(SEEN_S)[0]
    return {HALF_WAY: time, **heights, f"tan after {SEEN_S:g} s": tan}


def _row(case: str, figure: str, value: float, because: str = "") -> Row:
    off = LATE if figure == HALF_WAY else OFF
    return Row(f"{case}: {figure}", value, "", 1 - off, 1 + off, "1", because=because)


def course_rows(yield_pa: float, preset: str = "accurate") -> Iterator[Row]:
    """Particles of two sizes over interFoam, and where they rest."""
    runs = [(0.4, True), (0.3, True)]
    if yield_pa == AWAKE_PA:
        runs.append((0.4, False))
    for radius_mm, sleep in runs:
        name = f"{yield_pa:g} Pa, R {radius_mm:g} mm{'' if sleep else ', awake'}"
        means = _mean_over_sizes(yield_pa, yield_pa, radius_mm, preset, sleep=sleep)
        rows = {figure: _row(name, figure, mean) for figure, mean in means.items()}
        if any(row.missed for row in rows.values()):
            weaker_pa = holding_pa(*last_mm(yield_pa), WIDTH_MM, WEIGHT_N_M3)
            paste = f"{weaker_pa:.3g} Pa"
            for figure, mean in _mean_over_sizes(yield_pa, weaker_pa, radius_mm, preset, sleep=sleep).items():
                if _row(name, figure, mean).met:
                    why = f"interFoam's heap lies where {paste} hold it, and particles of {paste} have {mean:.3g} here"
                    rows[figure] = _row(name, figure, means[figure], why)
        yield from rows.values()


def _mean_over_sizes(
    theirs_pa: float, ours_pa: float, radius_mm: float, preset: str, *, sleep: bool
) -> dict[str, float]:
    """Mean of each figure over ``AS_LARGE``."""
    theirs = references()[theirs_pa, SIZE_MM, LIMIT_M2_S]
    ratios = []
    for share in AS_LARGE:
        ours, holds_pa = collapse(ours_pa, share * size_of(preset, radius_mm, WIDTH_MM), preset, sleep=sleep)
        ratios.append({**compared(ours, theirs), AT_REST: holds_pa / ours_pa})
    return {figure: float(np.mean([each[figure] for each in ratios])) for figure in ratios[0]}


def own_rows() -> Iterator[Row]:
    """What mesh and largest viscosity change in interFoam."""
    for (yield_pa, size_mm, limit_m2_s), course in references().items():
        if (size_mm, limit_m2_s) != (SIZE_MM, LIMIT_M2_S):
            name = f"interFoam, {size_mm:g} mm, {limit_m2_s:g} m2/s"
            for figure, ratio in compared(course, references()[yield_pa, SIZE_MM, LIMIT_M2_S]).items():
                yield _row(name, figure, ratio)
        else:
            holds_pa = holding_pa(*last_mm(yield_pa), WIDTH_MM, WEIGHT_N_M3)
            name = f"interFoam, {yield_pa:g} Pa after {SEEN_S:g} s"
            yield _row(name, "stress that holds it", holds_pa / yield_pa)


def wall_row() -> Row:
    """Walls with the paper's D, as those of the shipped trial: no rheology gives D, and nothing bounds the figure."""
    dragged, _ = collapse(AWAKE_PA, 0.4, dragged=True)
    theirs = references()[AWAKE_PA, SIZE_MM, LIMIT_M2_S]
    half_mm = (theirs.centre_mm[0] + theirs.centre_mm[-1]) / 2
    late = dragged.time_at(half_mm) / theirs.time_at(half_mm)
    return Row(f"{AWAKE_PA:g} Pa, walls with D: time of half of the way down", late, "")


def limit_rows() -> Iterator[Row]:
    """Limit analysis against a textbook."""
    x_mm = np.arange(0.125, 5 * FACE_MM, 0.25)
    holds_pa = holding_pa(x_mm, np.where(x_mm < 3 * FACE_MM, FACE_MM, 0.0), np.inf, WEIGHT_N_M3, cell_mm=0.25)
    face = WEIGHT_N_M3 * FACE_MM * 1e-3 / holds_pa
    yield Row("limit analysis: vertical face over the slip circle's", face / FACE, "", 1 - FACE_OFF, 1 + FACE_OFF, "1")


def main(
    only: Annotated[str | None, Option(help="yield stress of a heap in Pa, or limit, or interfoam")] = None,
) -> list[Row]:
    stresses = sorted(stress for stress, *rest in references() if tuple(rest) == (SIZE_MM, LIMIT_M2_S))
    rows = list(limit_rows()) if only in (None, "limit") else []
    if only in (None, "interfoam"):
        rows += own_rows()
    for stress in stresses:
        if only in (None, f"{stress:g}"):
            rows += course_rows(stress)
    if only in (None, f"{AWAKE_PA:g}"):
        rows.append(wall_row())
    return rows


if __name__ == "__main__":
    run_benchmark(main)
