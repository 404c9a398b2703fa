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
from validate.figures.page import FigureColumn, FigureTable, Page, Plot, Section
from validate.figures.theme import MEASURED, SIMULATED, label_axes, themed, wide_axes
from validate.units import counted

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
    options = ComputeOptions(device, progress=progress or Progress())
    run = release(block, fluid, solver, options=options, seed=seed)
    return run.t_s, run.front_mm


def computed_mm(course: Course, shift: float | None = None) -> Floats:
    """Return the fronts at outlines 0 to 8, with the clock ``shift`` outlines ahead. Default: the fitted shift."""
    t_s, front_mm = course
    ahead: float = content()["calibrated"]["shift_outlines"] if shift is None else shift
    return np.interp((np.arange(9) + ahead) * content()["clock"]["outline_s"], t_s, front_mm)


def measured_page(courses: Mapping[DamBreak, Course]) -> Page:
    """Return the page on the dam breaks of ``courses``. Its table has kept fronts of the other cases."""
    step_s, least_mm = content()["clock"]["outline_s"], content()["boxes"]["least_front_mm"]
    shift_ms = f"{1000 * content()['calibrated']['shift_outlines'] * step_s:.0f} ms"
    kept = {dam_break_of(row): row for row in table("computed.csv")}
    kept = {case: row for case, row in kept.items() if case.measured_mm[-1] > least_mm}
    fronts_mm = {case: row["front_mm"] for case, row in kept.items()}
    fronts_mm |= {case: float(computed_mm(course)[-1]) for case, course in courses.items()}
    seen_mm = np.array([case.measured_mm[-1] for case in fronts_mm])
    ratios = np.array([*fronts_mm.values()]) / seen_mm
    bias, half_step_bias = (
        np.exp(np.mean([np.log(row[step] / case.measured_mm[-1]) for case, row in kept.items()]))
        for step in ("front_mm", "half_step_front_mm")
    )
    fluid, after = fluid_of(SHOWN), f"after {8 * step_s:.2f} s"
    differences = [f"{100 * (r - 1):+.0f} %" for case, r in zip(fronts_mm, ratios, strict=True) if case in courses]
    gaps_mm = np.abs([computed_mm(course) - case.measured_mm for case, course in courses.items()])[:, 1:]
    caption = (
        "Lines are computed fronts, markers measured ones. Time is that of the films; the computed gate is gone "
        f"{shift_ms} before its 0. The largest difference is {gaps_mm.max():.1f} mm, at "
        f"{(gaps_mm.max(axis=0).argmax() + 1) * step_s:.2f} s."
    )
    columns = [
        FigureColumn("fluid", "material"),
        FigureColumn("block", "size"),
        FigureColumn("computed (mm)", [*fronts_mm.values()], "{:.1f}".format),
        FigureColumn("measured (mm)", seen_mm, "{:.1f}".format),
        FigureColumn("computed over measured", ratios, "{:.2f}".format),
        FigureColumn("run", ["now" if case in courses else "kept" for case in fronts_mm]),
    ]
    return Page(
        title="Two dam breaks that others measured",
        lead=f"Two blocks of {SHOWN} sauce flow onto a plate. Their fronts are computed from its flow curve: yield "
        f"stress {fluid.yield_stress_pa:.3g} Pa, K {fluid.consistency_pa_s_n:.3g} Pa s^n, n {fluid.flow_index:.3g}.",
        cautions=["Nothing here is a crack: these flows test the fluid solver, not a fill."],
        finding=f"The computed fronts differ by {' and '.join(differences)} from the measured ones {after}. One clock "
        f"shift of {shift_ms} is fitted to the films, the same in all cases, and nothing else.",
        key_figures=[
            (
                f"front of the block of {case.size}",
                f"{fronts_mm[case]:.1f} mm computed, {case.measured_mm[-1]:.1f} mm measured",
            )
            for case in courses
        ],
        sections=[
            Section("Fronts over time", [Plot("fronts", caption, lambda: _draw(courses))]),
            Section(
                f"All {counted(len(fronts_mm), 'case')} with a flow curve and fronts over {least_mm:g} mm",
                [
                    "This command computed the fronts of runs marked 'now'. Those marked 'kept' are results of "
                    "'python -m benchmarks.measured_numerics', computed in the same way.",
                    FigureTable(f"Fronts {after}", "cases", columns, [*fronts_mm]),
                ],
            ),
            Section(
                "Effect of the step",
                [
                    f"The bias, which is the geometric mean of computed over measured fronts of these cases, is "
                    f"{bias:.2f} with the default time step and {half_step_bias:.2f} with half of it (kept results). "
                    "The fronts are not converged in the step."
                ],
            ),
            Section("Sources", [_source_words(**source) for source in content()["sources"].values()]),
        ],
    )


def _source_words(repository: str, licence: str, paper: str = "") -> str:
    return f"{paper}{'; ' if paper else ''}{repository}. Licence: {licence}."


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
