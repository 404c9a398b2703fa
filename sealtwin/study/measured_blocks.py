"""Dam breaks that others filmed, their fronts computed by particles, and the page of 'sealtwin demo --measured'.

Facts and sources are in measured.toml.
"""

import csv
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sealtwin.core.plain_files import read_text
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats
from sealtwin.material.by_rheometer import FlowCurve, material_of_table
from sealtwin.trial.starter_files import shipped_measured
from simulate.block import FluidBlock
from simulate.block_release import release
from simulate.injection import ComputeOptions
from simulate.settings import Fluid, Solver
from validate.figures.page import Page, Plot, Section
from validate.figures.theme import MEASURED, SIMULATED, label_axes, themed, wide_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = "okonomiyaki"  # Material of 'sealtwin demo --measured'
STYLES = (("-", "o"), ("--", "s"))  # Line and marker of each dam break in the figure
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
    options = ComputeOptions(device, threads=1, progress=progress or Progress())
    run = release(block, fluid, solver, options=options, seed=seed)
    return run.t_s, run.front_mm


def computed_mm(course: Course, shift: float | None = None) -> Floats:
    """Return the fronts at outlines 0 to 8, with the clock ``shift`` outlines ahead. Default: the fitted shift."""
    t_s, front_mm = course
    ahead: float = content()["calibrated"]["shift_outlines"] if shift is None else shift
    return np.interp((np.arange(9) + ahead) * content()["clock"]["outline_s"], t_s, front_mm)


def measured_page(courses: Mapping[DamBreak, Course]) -> Page:
    """Return the page on the dam breaks of ``courses``, which are of the material ``SHOWN``."""
    step_s, fluid = content()["clock"]["outline_s"], fluid_of(SHOWN)
    shift_ms = f"{1000 * content()['calibrated']['shift_outlines'] * step_s:.0f} ms"
    seen_mm = np.array([case.measured_mm for case in courses])
    fronts_mm = np.array([computed_mm(course) for course in courses.values()])
    ratios, gaps_mm = fronts_mm[:, -1] / seen_mm[:, -1], np.abs(fronts_mm - seen_mm)[:, 1:].max(axis=0)
    differences = " and ".join(f"{100 * (ratio - 1):+.0f} %" for ratio in ratios)
    caption = (
        "Lines are computed fronts, markers measured ones. Time is that of the films; the computed gate is gone "
        f"{shift_ms} before its 0. The largest difference is {gaps_mm.max():.1f} mm, at "
        f"{(gaps_mm.argmax() + 1) * step_s:.2f} s."
    )
    return Page(
        title="Two dam breaks that others measured",
        lead=f"Two blocks of {SHOWN} sauce flow onto a plate. Their fronts are computed from its flow curve: yield "
        f"stress {fluid.yield_stress_pa:.3g} Pa, K {fluid.consistency_pa_s_n:.3g} Pa s^n, n {fluid.flow_index:.3g}.",
        cautions=["Nothing here is a crack: these flows test the fluid solver, not a fill."],
        finding=f"The computed fronts differ by {differences} from the measured ones after {8 * step_s:.2f} s. One "
        f"clock shift of {shift_ms} is fitted to the films, the same in all cases, and nothing else. With half of the "
        "time step fronts are a little longer: they are not converged in it.",
        key_figures=[
            (
                f"front of the block of {case.size}",
                f"{front_mm:.1f} mm computed, {case.measured_mm[-1]:.1f} mm measured",
            )
            for case, front_mm in zip(courses, fronts_mm[:, -1], strict=True)
        ],
        sections=[
            Section("Fronts over time", [Plot("fronts", caption, lambda: _draw(courses))]),
            Section("Sources", ["; ".join(source.values()) for source in content()["sources"].values()]),
        ],
    )


@themed()
def _draw(courses: Mapping[DamBreak, Course]) -> "Figure":
    """Draw the fronts over the time of the films."""
    _, axes = wide_axes(3.8)
    step_s, shift = content()["clock"]["outline_s"], content()["calibrated"]["shift_outlines"]
    for (case, (t_s, front_mm)), (line, marker) in zip(courses.items(), STYLES, strict=True):
        axes.plot(t_s - shift * step_s, front_mm, line, color=SIMULATED, label=f"{case.size}, computed")
        seen_s, label = step_s * np.arange(1, 9), f"{case.size}, measured"
        axes.plot(seen_s, case.measured_mm[1:], marker, color=MEASURED, label=label)
    return label_axes(axes, "time (s)", "front from the gate (mm)", "Front of each block", 4)
