"""Dam breaks that others filmed, and their fronts computed by particles. Facts and sources are in measured.toml."""

import csv
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from sealtwin.core.plain_files import read_text
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats
from sealtwin.material.by_rheometer import FlowCurve, material_of_table
from sealtwin.trial.starter_files import shipped_measured
from simulate.block import FluidBlock
from simulate.block_release import release
from simulate.settings import Fluid, Solver

SHOWN = "okonomiyaki"  # Material of 'sealtwin demo --measured'
Course = tuple[Floats, Floats]
"""Times in s from the moment at which the gate is gone, and fronts in mm."""


@cache
def content() -> dict[str, Any]:
    return tomllib.loads(read_text(shipped_measured() / "measured.toml"))


@cache
def table(name: str) -> tuple[dict[str, Any], ...]:
    """Return the rows of a CSV beside measured.toml. All columns but ``material`` are numbers."""
    rows = csv.DictReader(read_text(shipped_measured() / name).splitlines())
    return tuple({key: text if key == "material" else float(text) for key, text in row.items()} for row in rows)


@dataclass(frozen=True)
class DamBreak:
    """A block of fluid behind a gate, and the fronts that were measured after the gate was pulled up."""

    material: str
    length_mm: float
    height_mm: float

    @property
    def size(self) -> str:
        return f"{self.length_mm:g} x {self.height_mm:g} mm"

    @property
    def name(self) -> str:
        return f"{self.material}, {self.size}"

    @property
    def measured_mm(self) -> Floats:
        """Fronts at outlines 0 to 8; 0 at first."""
        fronts = {row["outline"]: row["front_mm"] for row in table("fronts.csv") if dam_break_of(row) == self}
        return np.array([0.0, *(fronts[float(outline)] for outline in range(1, 9))])

    @property
    def radius_mm(self) -> float:
        """Radius of the particles."""
        boxes = content()["boxes"]
        least, most = boxes["radii_mm"]
        shortest_mm = min(self.length_mm, self.height_mm, boxes["width_mm"])
        return float(np.clip(shortest_mm / boxes["diameters"] / 2, least, most))


def dam_break_of(row: dict[str, Any]) -> DamBreak:
    return DamBreak(row["material"], row["length_mm"], row["height_mm"])


def dam_breaks(materials: Sequence[str]) -> list[DamBreak]:
    return list(dict.fromkeys(dam_break_of(row) for row in table("fronts.csv") if row["material"] in materials))


@cache
def fluid_of(material: str) -> Fluid:
    """Return a material as its flow curve gives it, or as its authors fitted that."""
    facts = content()["materials"][material]
    fluid = {key: value for key, value in facts.items() if key != "curve"}
    if "curve" in facts:
        paste = FlowCurve(density_kg_m3=facts["density_kg_m3"], data="measured")
        fitted = material_of_table(shipped_measured() / facts["curve"], paste).material
        thickness = fitted.thickness
        if thickness is None:
            raise ValueError(f"{material}: its curve gives no viscosity")
        fluid |= {"yield_stress_pa": fitted.yield_stress_pa, thickness[0]: thickness[1]}
        fluid |= {} if fitted.flow_index is None else {"flow_index": fitted.flow_index}
    return Fluid.model_validate({"freeze_after_s": "never", **fluid})


def course_of(
    case: DamBreak,
    fluid: Fluid,
    solver: Solver | None = None,
    seed: int = 0,
    device: str = "cpu",
    progress: Progress | None = None,
) -> Course:
    """Compute the front of a dam break until one outline after the last."""
    outline_s = content()["clock"]["outline_s"]
    block = FluidBlock(
        length_mm=case.length_mm,
        width_mm=content()["boxes"]["width_mm"],
        height_mm=case.height_mm,
        ahead_mm=2.5 * (case.length_mm + case.height_mm),
        duration_s=9.2 * outline_s,
        every_s=outline_s / 4,
    )
    solver = solver or Solver(radius_mm=case.radius_mm)
    run = release(block, fluid, solver, seed=seed, device=device, progress=progress)
    return run.t_s, run.front_mm


def computed_mm(course: Course, shift: float | None = None) -> Floats:
    """Return the fronts at outlines 0 to 8, with the clock ``shift`` outlines ahead. Default: the fitted shift."""
    t_s, front_mm = course
    ahead: float = content()["calibrated"]["shift_outlines"] if shift is None else shift
    return np.interp((np.arange(9) + ahead) * content()["clock"]["outline_s"], t_s, front_mm)
