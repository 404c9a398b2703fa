"""Compute dam breaks that others have filmed, and write the page of 'sealtwin demo --measured'.

The data and their sources are in measured.toml.
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

SHOWN = "okonomiyaki"  # Material that 'sealtwin demo --measured' shows
STYLES = (("-", "o"), ("--", "s"))  # Line style and marker of each dam break in the figure
Course = tuple[Floats, Floats]
"""Course of a dam break: times in s after the gate was removed, and the positions of the front in mm."""


@cache
def content() -> dict[str, Any]:
    return tomllib.loads(read_text(shipped_measured() / "measured.toml"))


@cache
def table(name: str) -> tuple[dict[str, Any], ...]:
    """Return the rows of a CSV in the folder of measured.toml. All columns except ``material`` are numbers."""
    rows = csv.DictReader(read_text(shipped_measured() / name).splitlines())
    return tuple({key: text if key == "material" else float(text) for key, text in row.items()} for row in rows)


@dataclass(frozen=True)
class DamBreak:
    """A block of fluid behind a gate, and the positions of the front that were measured after the gate was opened."""

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
        """Measured positions of the front at outlines 0 to 8, in mm. The first one is 0."""
        fronts = {row["outline"]: row["front_mm"] for row in table("fronts.csv") if dam_break_of(row) == self}
        return np.array([0.0, *(fronts[float(outline)] for outline in range(1, 9))])

    @property
    def radius_mm(self) -> float:
        """Radius of the simulated particles."""
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
    """Return the settings of a material, from a fit to its flow curve or from the fit that its authors published."""
    facts = content()["materials"][material]
    fluid = {key: value for key, value in facts.items() if key != "curve"}
    if "curve" in facts:
        paste = FlowCurve(density_kg_m3=facts["density_kg_m3"], data="measured")
        fitted = material_of_table(shipped_measured() / facts["curve"], paste).material
        thickness = fitted.thickness
        if thickness is None:
            raise ValueError(f"{material}: no viscosity can be fitted to the flow curve")
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
    """Simulate a dam break until shortly after the last measured outline, and return the course of its front."""
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
    """Return the computed front positions at the times of outlines 0 to 8 of the film, in mm, (9,).

    ``shift`` is how far the simulation is ahead of the film, in intervals between two outlines. Default: the fitted
    shift.
    """
    t_s, front_mm = course
    ahead: float = content()["calibrated"]["shift_outlines"] if shift is None else shift
    return np.interp((np.arange(9) + ahead) * content()["clock"]["outline_s"], t_s, front_mm)


def measured_page(courses: Mapping[DamBreak, Course]) -> Page:
    """Return the page about the dam breaks in ``courses``, whose material is ``SHOWN``."""
    step_s, fluid = content()["clock"]["outline_s"], fluid_of(SHOWN)
    shift_ms = f"{1000 * content()['calibrated']['shift_outlines'] * step_s:.0f} ms"
    seen_mm = np.array([case.measured_mm for case in courses])
    fronts_mm = np.array([computed_mm(course) for course in courses.values()])
    ratios, gaps_mm = fronts_mm[:, -1] / seen_mm[:, -1], np.abs(fronts_mm - seen_mm)[:, 1:].max(axis=0)
    differences = " and ".join(f"{100 * (ratio - 1):+.0f} %" for ratio in ratios)
    caption = (
        "Lines show the computed fronts, and markers the measured fronts. The time is the time of the films. In the "
        f"simulation, the gate is removed {shift_ms} before time 0. The largest difference is {gaps_mm.max():.1f} mm, "
        f"at {(gaps_mm.argmax() + 1) * step_s:.2f} s."
    )
    return Page(
        title="Two dam breaks that others measured",
        lead=f"Two blocks of {SHOWN} sauce flow onto a plate. Their fronts are computed from its flow curve: yield "
        f"stress {fluid.yield_stress_pa:.3g} Pa, K {fluid.consistency_pa_s_n:.3g} Pa s^n, n {fluid.flow_index:.3g}.",
        cautions=["These flows are not in a crack: they test the fluid solver, not the filling of a crack."],
        finding=f"The computed fronts differ by {differences} from the measured fronts after {8 * step_s:.2f} s. Only "
        f"one number is fitted to the films: a time shift of {shift_ms}, the same in all cases. With half the time "
        "step, the fronts are a little longer, so they have not converged with the time step.",
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
    """Draw the positions of the fronts over the time of the films."""
    _, axes = wide_axes(3.8)
    step_s, shift = content()["clock"]["outline_s"], content()["calibrated"]["shift_outlines"]
    for (case, (t_s, front_mm)), (line, marker) in zip(courses.items(), STYLES, strict=True):
        axes.plot(t_s - shift * step_s, front_mm, line, color=SIMULATED, label=f"{case.size}, computed")
        seen_s, label = step_s * np.arange(1, 9), f"{case.size}, measured"
        axes.plot(seen_s, case.measured_mm[1:], marker, color=MEASURED, label=label)
    return label_axes(axes, "time (s)", "front from the gate (mm)", "Front of each block", 4)
