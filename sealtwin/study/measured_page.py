"""Page of 'sealtwin demo --measured': fronts of dam breaks, computed beside measured. Importing it loads Matplotlib."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from sealtwin.study.measured_blocks import SHOWN, Course, DamBreak, computed_mm, content, dam_break_of, fluid_of, table
from validate.figures.figure_sheet import FigureSheet, FigureTable, Plot, SheetSection, wide_axes
from validate.figures.theme import MEASURED, SIMULATED, label_axes, themed
from validate.units import counted

STYLES = (("-", "o"), ("--", "s"))  # Line and marker of each dam break in the figure
HEAD = ("fluid", "block", "computed (mm)", "measured (mm)", "computed over measured", "run")


def measured_sheet(courses: Mapping[DamBreak, Course]) -> FigureSheet:
    """Return the page on the two dam breaks of ``courses``. Its table has kept fronts of the other cases."""
    step_s, least_mm = content()["clock"]["outline_s"], content()["boxes"]["least_front_mm"]
    shift_s = content()["calibrated"]["shift_outlines"] * step_s
    by_step_mm = {dam_break_of(row): (row["front_mm"], row["half_step_front_mm"]) for row in table("computed.csv")}
    by_step_mm = {case: fronts_mm for case, fronts_mm in by_step_mm.items() if case.measured_mm[-1] > least_mm}
    fronts_mm = {case: both_mm[0] for case, both_mm in by_step_mm.items()}
    fronts_mm |= {case: float(computed_mm(course)[-1]) for case, course in courses.items()}
    ratios = {case: mm / case.measured_mm[-1] for case, mm in fronts_mm.items()}
    logs = [np.log(np.divide(both_mm, case.measured_mm[-1])) for case, both_mm in by_step_mm.items()]
    bias, half_step_bias = np.exp(np.mean(logs, axis=0))
    rows = [
        [
            *(case.material, case.size, f"{mm:.1f}", f"{case.measured_mm[-1]:.1f}", f"{ratios[case]:.2f}"),
            "now" if case in courses else "kept",
        ]
        for case, mm in fronts_mm.items()
    ]
    fluid, after = fluid_of(SHOWN), f"after {8 * step_s:.2f} s"
    differences = " and ".join(f"{100 * (ratios[case] - 1):+.0f} %" for case in courses)
    gaps_mm = np.array([computed_mm(course) - case.measured_mm for case, course in courses.items()])[:, 1:]
    largest = np.argmax(np.abs(gaps_mm).max(axis=0))
    caption = (
        "Lines are computed fronts, markers measured ones. Time is that of the films; the computed gate is gone "
        f"{1000 * shift_s:.0f} ms before its 0. The largest difference is {np.abs(gaps_mm).max():.1f} mm, at "
        f"{(largest + 1) * step_s:.2f} s."
    )
    return FigureSheet(
        title="Two dam breaks that others measured",
        lead=f"Two blocks of {SHOWN} sauce flow onto a plate. Their fronts are computed from its flow curve: yield "
        f"stress {fluid.yield_stress_pa:.3g} Pa, K {fluid.consistency_pa_s_n:.3g} Pa s^n, n {fluid.flow_index:.3g}.",
        cautions=["Nothing here is a crack: these flows test the fluid solver, not a fill."],
        finding=f"The computed fronts differ by {differences} from the measured ones {after}. One clock shift of "
        f"{1000 * shift_s:.0f} ms is fitted to the films, the same in all cases, and nothing else.",
        key_figures=[
            (
                f"front of the block of {case.size}",
                f"{fronts_mm[case]:.1f} mm computed, {case.measured_mm[-1]:.1f} mm measured",
            )
            for case in courses
        ],
        parts=[
            SheetSection("Fronts over time", [], [Plot("fronts", caption, lambda: _draw(courses, step_s, shift_s))]),
            SheetSection(
                f"All {counted(len(rows), 'case')} with a flow curve and fronts over {least_mm:g} mm",
                [
                    "This command computed the fronts of runs marked 'now'. Those marked 'kept' are results of "
                    "'python -m benchmarks.measured_numerics', computed in the same way."
                ],
                [FigureTable(f"Fronts {after}", HEAD, rows, "cases")],
            ),
            SheetSection(
                "Effect of the step",
                [
                    f"The bias, which is the geometric mean of computed over measured fronts of these cases, is "
                    f"{bias:.2f} with the default time step and {half_step_bias:.2f} with half of it (kept results). "
                    "The fronts are not converged in the step."
                ],
                [],
            ),
            SheetSection("Sources", [_source_words(**source) for source in content()["sources"].values()], []),
        ],
    )


def _source_words(repository: str, licence: str, paper: str = "") -> str:
    return f"{paper}{'; ' if paper else ''}{repository}. Licence: {licence}."


@themed()
def _draw(courses: Mapping[DamBreak, Course], step_s: float, shift_s: float) -> Figure:
    _, axes = wide_axes(3.8)
    for (case, (t_s, front_mm)), (line, marker) in zip(courses.items(), STYLES, strict=True):
        axes.plot(t_s - shift_s, front_mm, line, color=SIMULATED, label=f"{case.size}, computed")
        axes.plot(
            step_s * np.arange(1, 9), case.measured_mm[1:], marker, color=MEASURED, label=f"{case.size}, measured"
        )
    return label_axes(axes, "time (s)", "front from the gate (mm)", "Front of each block", 4)
