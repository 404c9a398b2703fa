"""What the particles' radius, substeps and two-level pressure do to the fronts of measured dam breaks.

    python -m benchmarks.measured_numerics

Each figure is a front at outline 8 over that of ``benchmarks/measured.py``, which has 12.5 particles across the
shortest side, one substep and local pressure. The last rows are geometric means over fronts above 10 mm. Nothing is
judged.
"""

from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

from benchmarks.measured import Box, boxes, computed_mm, content, course_of, fluid_of
from benchmarks.table import Row, run_benchmark
from sealtwin.core.errors import InputError, present
from simulate.settings import Solver

MATERIALS = ("okonomiyaki", "lotion", "tianmianjiang")
WAYS: Mapping[str, dict[str, Any]] = {
    "as benchmarks/measured.py": {},
    "another seed": {"seed": 1},
    "radius 1.25 times": {"radius": 1.25},
    "radius 0.75 times": {"radius": 0.75},
    "two substeps": {"substeps": 2},
    "four substeps": {"substeps": 4},
    "two-level pressure": {"pressure": "two-level"},
}


def front_mm(case: tuple[Box, dict[str, Any]]) -> float | None:
    """Return the front at the last outline; None if the block is too large for particles so small."""
    box, way = case
    way = dict(way)
    radius_mm, seed = box.radius_mm * way.pop("radius", 1.0), way.pop("seed", 0)
    try:
        course = course_of(box, fluid_of(box.material), Solver(radius_mm=radius_mm, **way), seed)
    except InputError:
        return None
    return float(computed_mm(course, content()["calibrated"]["shift_outlines"])[-1])


def main() -> list[Row]:
    return list(_rows())


def _rows() -> Iterator[Row]:
    cases, over = boxes(MATERIALS), {way: list[float]() for way in list(WAYS)[1:]}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        fronts_mm = iter(pool.map(front_mm, [(box, way) for box in cases for way in WAYS.values()]))
        for box in cases:
            usual_mm = present(next(fronts_mm), "front")
            yield Row(f"{box.name}: front", usual_mm, "mm")
            for way in list(WAYS)[1:]:
                if (other_mm := next(fronts_mm)) is None:
                    continue
                yield Row(f"{box.name}, {way}: front over that", other_mm / usual_mm, "")
                if box.measured_mm[-1] > content()["boxes"]["least_front_mm"]:
                    over[way].append(other_mm / usual_mm)
    for way, ratios in over.items():
        yield Row(f"{way}: fronts over those, {len(ratios)} blocks", float(np.exp(np.mean(np.log(ratios)))), "")


if __name__ == "__main__":
    run_benchmark(main)
