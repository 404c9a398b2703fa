"""What the particles' radius and substeps do to the fronts of measured dam breaks.

    python -m benchmarks.measured_numerics

Each figure is a front at outline 8 over that of ``benchmarks/measured.py``, which has 12.5 particles across the
shortest side, and one substep. The last rows are geometric means over fronts above 10 mm. Nothing is judged.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from benchmarks.measured import computed_mm, course_of
from benchmarks.table import Row, processes, run_benchmark
from sealtwin.core.errors import InputError, present
from simulate.settings import Solver
from tests.support.dam_breaks import DamBreak, content, dam_breaks, with_curve

USUAL, HALF_STEP = "usual step", "two substeps"
WAYS: Mapping[str, dict[str, Any]] = {
    USUAL: {},
    "another seed": {"seed": 1},
    "radius 1.25 times": {"radius": 1.25},
    "radius 0.75 times": {"radius": 0.75},
    HALF_STEP: {"substeps": 2},
    "four substeps": {"substeps": 4},
}


def front_mm(case: tuple[DamBreak, dict[str, Any]]) -> float | None:
    """Return the front at the last outline; None if the block is too large for particles so small."""
    box, way = case
    way = dict(way)
    radius_mm, seed = box.radius_mm * way.pop("radius", 1.0), way.pop("seed", 0)
    try:
        course = course_of(box, None, Solver(radius_mm=radius_mm, **way), seed)
    except InputError:
        return None
    return float(computed_mm(course)[-1])


def main() -> list[Row]:
    cases = dam_breaks(with_curve())
    with processes(2) as pool:
        fronts_mm = iter(pool.map(front_mm, [(case, way) for case in cases for way in WAYS.values()]))
        fronts = {case: {way: next(fronts_mm) for way in WAYS} for case in cases}
    return list(_rows(fronts))


def _rows(fronts: Mapping[DamBreak, Mapping[str, float | None]]) -> Iterator[Row]:
    over = {way: list[float]() for way in WAYS if way != USUAL}
    for way in (USUAL, HALF_STEP):
        logs = [
            np.log(present(ways[way], "front") / case.measured_mm[-1])
            for case, ways in fronts.items()
            if case.measured_mm[-1] > content()["boxes"]["least_front_mm"]
        ]
        yield Row(f"{way}: computed over measured fronts over 10 mm, bias", float(np.exp(np.mean(logs))), "")
        yield Row(f"{way}: their scatter", 100 * float(np.std(logs, ddof=1)), "%")
    for case, ways in fronts.items():
        usual_mm = present(ways[USUAL], "front")
        yield Row(f"{case.name}: front", usual_mm, "mm")
        for way in over:
            if (other_mm := ways[way]) is None:
                continue
            yield Row(f"{case.name}, {way}: front over that", other_mm / usual_mm, "")
            if case.measured_mm[-1] > content()["boxes"]["least_front_mm"]:
                over[way].append(other_mm / usual_mm)
    for way, ratios in over.items():
        yield Row(f"{way}: fronts over those, {len(ratios)} blocks", float(np.exp(np.mean(np.log(ratios)))), "")


if __name__ == "__main__":
    run_benchmark(main)
