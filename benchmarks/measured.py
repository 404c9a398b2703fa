"""Flows that others measured, computed with nothing fitted to a flow: fronts of dam breaks, and outlines from a source.

    python -m benchmarks.measured [--only fronts] [--only curves] [--only source]

``measured/measured.toml`` has the cases, their sources and licences, and the targets, written before the first run.
The materials of the dam breaks have flow curves from a rheometer, fitted by 'sealtwin material rheometer'. One shift of
the clock is the same in all of them. Fronts under 10 mm, outlines 4 and 6 and the flows from a source are reported.
"""

import csv
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import date
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from benchmarks.table import Row, one_of, run_benchmark
from sealtwin.core.records import Floats
from sealtwin.material.by_rheometer import material_of_table
from sealtwin.material.paste import PasteOnPlate
from simulate.block import Block
from simulate.block_release import release
from simulate.settings import Fluid, Solver

FACTS = Path(__file__).with_suffix("")


@cache
def content() -> dict[str, Any]:
    return tomllib.loads((FACTS / "measured.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Box:
    """A dam break: the block behind the gate, and the fronts that were seen."""

    material: str
    length_mm: float
    height_mm: float

    @property
    def name(self) -> str:
        return f"{self.material}, {self.length_mm:g} x {self.height_mm:g} mm"

    @property
    def measured_mm(self) -> Floats:
        """Fronts at outlines 0 to 8; 0 at first."""
        fronts = {row["outline"]: row["front_mm"] for row in _rows() if _box_of(row) == self}
        return np.array([0.0, *(fronts[float(outline)] for outline in range(1, 9))])

    @property
    def radius_mm(self) -> float:
        boxes = content()["boxes"]
        least, most = boxes["radii_mm"]
        shortest_mm = min(self.length_mm, self.height_mm, boxes["width_mm"])
        return float(np.clip(shortest_mm / boxes["diameters"] / 2, least, most))


@cache
def _rows() -> tuple[dict[str, Any], ...]:
    with (FACTS / "fronts.csv").open(newline="", encoding="utf-8") as file:
        return tuple({key: _number(text) for key, text in row.items()} for row in csv.DictReader(file))


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _box_of(row: Mapping[str, Any]) -> Box:
    return Box(row["material"], row["length_mm"], row["height_mm"])


def boxes(materials: Sequence[str]) -> list[Box]:
    return list(dict.fromkeys(_box_of(row) for row in _rows() if row["material"] in materials))


def with_curve() -> list[str]:
    """Return the materials whose flow curve a rheometer gave."""
    return [name for name, it in content()["materials"].items() if "curve" in it or "yield_stress_pa" in it]


@cache
def fluid_of(material: str) -> Fluid:
    """Return a material as its flow curve gives it, or as its authors fitted that."""
    table = content()["materials"][material]
    fluid = {key: value for key, value in table.items() if key != "curve"}
    if "curve" in table:
        paste = PasteOnPlate(density_kg_m3=table["density_kg_m3"])
        fitted = material_of_table(FACTS / table["curve"], paste, "measured", date(2023, 1, 1)).material
        thickness = fitted.thickness
        if thickness is None:
            raise ValueError(f"{material}: its curve gives no viscosity")
        fluid |= {"yield_stress_pa": fitted.yield_stress_pa, thickness[0]: thickness[1]}
        fluid |= {} if fitted.flow_index is None else {"flow_index": fitted.flow_index}
    return Fluid.model_validate({"freeze_after_s": "never", **fluid})


def course_of(box: Box, fluid: Fluid, solver: Solver | None = None, seed: int = 0) -> tuple[Floats, Floats]:
    """Return times in s and fronts in mm of a dam break, computed until one outline after the last."""
    outline_s = content()["clock"]["outline_s"]
    block = Block(
        length_mm=box.length_mm,
        width_mm=content()["boxes"]["width_mm"],
        height_mm=box.height_mm,
        ahead_mm=2.5 * (box.length_mm + box.height_mm),
        duration_s=9.2 * outline_s,
        every_s=outline_s / 4,
    )
    run = release(block, fluid, solver or Solver(radius_mm=box.radius_mm), seed=seed)
    return run.t_s, run.front_mm


def _course(box: Box) -> tuple[Floats, Floats]:
    return course_of(box, fluid_of(box.material))


def computed_mm(course: tuple[Floats, Floats], shift: float) -> Floats:
    """Return the fronts at outlines 0 to 8, with the clock ``shift`` outlines ahead."""
    t_s, front_mm = course
    return np.interp((np.arange(9) + shift) * content()["clock"]["outline_s"], t_s, front_mm)


def best_shift(courses: Mapping[Box, tuple[Floats, Floats]]) -> float:
    """Return the one shift in outlines with which the fronts at the outlines that no target judges differ least."""
    clock = content()["clock"]
    at = clock["chosen_from"]

    def difference(shift: float) -> float:
        logs = (np.log(computed_mm(course, shift)[at] / box.measured_mm[at]) for box, course in courses.items())
        return float(sum(np.square(each).sum() for each in logs))

    return min(np.linspace(0.0, clock["most_outlines"], 51).tolist(), key=difference)


def fronts() -> Iterator[Row]:
    cases = boxes(with_curve())
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        courses = dict(zip(cases, pool.map(_course, cases), strict=True))
    clock, targets = content()["clock"], content()["targets"]
    shift = best_shift(courses)
    yield Row("shift of the clock, all cases", 1000 * shift * clock["outline_s"], "ms")
    ratio = {box: computed_mm(course, shift)[1:] / box.measured_mm[1:] for box, course in courses.items()}
    for box in cases:
        for outline in clock["judged"]:
            seen_mm = box.measured_mm[outline]
            yield Row(
                f"{box.name}, outline {outline}: {seen_mm:g} mm, computed", ratio[box][outline - 1] * seen_mm, "mm"
            )
    least_mm = content()["boxes"]["least_front_mm"]
    for outlines in ((8,), tuple(clock["judged"])):
        logs = np.array([
            np.log(ratio[box][outline - 1])
            for box in cases
            for outline in outlines
            if outlines != (8,) or box.measured_mm[outline] > least_mm
        ])  # fmt: skip
        of = "outline 8, fronts over 10 mm" if outlines == (8,) else "outlines 4, 6 and 8, all fronts"
        judged = outlines == (8,)
        low, high = targets["bias"] if judged else (0.0, np.inf)
        yield Row(f"computed over measured, {of}: bias", float(np.exp(logs.mean())), "", low, high)
        most = targets["scatter_percent"] if judged else np.inf
        yield Row(f"computed over measured, {of}: scatter", 100 * float(logs.std(ddof=1)), "%", 0.0, most)
        if judged:
            worst = 100 * float(np.abs(np.expm1(logs)).max())
            yield Row(f"computed over measured, {of}: worst", worst, "%", 0.0, targets["worst_percent"])


PARTS = {"fronts": fronts}


def main(only: Annotated[list[str] | None, one_of(PARTS)] = None) -> list[Row]:
    return [row for name in only or PARTS for row in PARTS[name]()]


if __name__ == "__main__":
    run_benchmark(main)
