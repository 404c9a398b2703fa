"""Dam breaks that others have filmed: sizes, fluids and fronts. Sources are in benchmarks/measured/measured.toml."""

import csv
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from sealtwin.core.records import Floats
from sealtwin.material.by_rheometer import FlowCurve, material_of_table
from simulate.settings import Fluid
from tests.support.paths import ROOT

DATA = ROOT / "benchmarks" / "measured"


@cache
def content() -> dict[str, Any]:
    return tomllib.loads((DATA / "measured.toml").read_text(encoding="utf-8"))


def with_curve() -> list[str]:
    """Return the materials whose flow curve a rheometer gave."""
    return [name for name, it in content()["materials"].items() if "curve" in it or "yield_stress_pa" in it]


@dataclass(frozen=True)
class DamBreak:
    """A block of fluid behind a gate."""

    material: str
    length_mm: float
    height_mm: float

    @property
    def name(self) -> str:
        return f"{self.material}, {self.length_mm:g} x {self.height_mm:g} mm"

    @property
    def measured_mm(self) -> Floats:
        """Measured positions of the front at outlines 0 to 8, in mm. The first one is 0."""
        return np.array([0.0, *(_fronts()[self][outline] for outline in range(1, 9))])

    @property
    def radius_mm(self) -> float:
        """Radius of the simulated particles."""
        boxes = content()["boxes"]
        shortest_mm = min(self.length_mm, self.height_mm, boxes["width_mm"])
        return float(np.clip(shortest_mm / boxes["diameters"] / 2, *boxes["radii_mm"]))


@cache
def _fronts() -> dict[DamBreak, dict[int, float]]:
    """Return the measured positions of the front in mm by dam break and outline."""
    fronts: dict[DamBreak, dict[int, float]] = {}
    for row in csv.DictReader((DATA / "fronts.csv").read_text(encoding="utf-8").splitlines()):
        case = DamBreak(row["material"], float(row["length_mm"]), float(row["height_mm"]))
        fronts.setdefault(case, {})[int(row["outline"])] = float(row["front_mm"])
    return fronts


def dam_breaks(materials: Sequence[str]) -> list[DamBreak]:
    return [case for case in _fronts() if case.material in materials]


@cache
def fluid_of(material: str) -> Fluid:
    """Return the settings of a material, from a fit to its flow curve or from the fit that its authors published."""
    facts = content()["materials"][material]
    fluid = {key: value for key, value in facts.items() if key != "curve"}
    if "curve" in facts:
        paste = FlowCurve(density_kg_m3=facts["density_kg_m3"], data="measured")
        fitted = material_of_table(DATA / facts["curve"], paste).material
        fluid |= fitted.model_dump(include={"yield_stress_pa", "consistency_pa_s_n", "flow_index"})
    return Fluid.model_validate({"freeze_after_s": "never", **fluid})
