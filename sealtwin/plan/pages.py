"""Write the page of a plan, and its sentences. Importing this loads Matplotlib."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sealtwin.plan.verify import Planned
from validate.figures.figure_sheet import (
    FigureSheet,
    FigureTable,
    Numbers,
    Plot,
    SheetSection,
    wide_axes,
    write_sheet_of_figures,
)
from validate.figures.theme import ALONG, MEASURED, MUTED, SIMULATED, label_axes
from validate.units import counted

AGREES_MM = 0.4  # Mean difference of prediction and particles above which the page mentions it
BASELINES = {"constant flow": "--", "flow by local area": ":"}


def write_plan_page(path: Path, name: str, planned: Planned, fluid_warnings: Sequence[str]) -> None:
    draft = ", draft" if planned.drafts else ""
    judged = [("the plan, accurate" if planned.drafts else "the plan, mean of its seeds", planned.misfit)]
    judged += [(f"{one.name}{draft}", one.misfit) for one in (*planned.baselines, *planned.rounds)]
    figures = [[of, it.under_mm3, it.over_mm3, it.total_mm3, it.highest_mm] for of, it in judged]
    head = ("path", "under (mm3)", "over (mm3)", "total (mm3)", "highest (mm)")
    table = FigureTable(
        title="Judged by particles",
        head=head,
        rows=[[of, *(f"{value:.0f}" for value in volumes), f"{high:+.2f}"] for of, *volumes, high in figures],
        name="judged",
        numbers=Numbers(head, figures),
    )
    it, band, chances = planned.trajectory, [], planned.chances or {}
    columns = ("s_mm", "speed_mm_s", "flow_mm3_s")
    flow = Numbers(columns, np.column_stack([getattr(it, column) for column in columns]).tolist())
    if (band_mm := planned.band_95_mm) is not None:
        runs = counted(len(planned.misfits), "draft" if planned.drafts else "run")
        band = [(f"half-width of the 95 % band of a run, from {runs}", f"{band_mm:.2f} mm")]
    sheet = FigureSheet(
        title=f"Plan: {name}",
        lead="Flow and speed along the path, chosen by the fast model and judged by particles. No number is measured.",
        cautions=plan_cautions(planned, fluid_warnings),
        finding=plan_finding(planned),
        key_figures=[
            ("sealant", f"{it.dispensed_mm3 / 1000:.3g} ml"),
            ("duration", f"{it.duration_s:.1f} s"),
            ("aims below the face by", f"{planned.margin_mm + planned.reserve_mm:.2f} mm"),
            *band,
            *(
                (f"draws with {name.replace('_', ' ')}", f"{share * chances['draws']:.0f} of {chances['draws']:.0f}")
                for name, share in chances.items()
                if name != "draws"
            ),
        ],
        parts=[
            SheetSection(
                "Level",
                [],
                [
                    Plot("levels", "Level by particles along the crack; 0 is the face.", lambda: _plan_levels(planned)),
                    table,
                ],
            ),
            SheetSection("Path", [], [Plot("flow", "Flow and speed of the plan.", lambda: _flow(planned), flow)]),
        ],
    )
    write_sheet_of_figures(path.parent, path.name, sheet)


def plan_finding(planned: Planned) -> str:
    it, better = planned.misfit, min(planned.baselines, key=lambda one: one.misfit.total_mm3)
    low = "; ".join(
        f"from {one['from_mm']:.0f} to {one['to_mm']:.0f} mm the level is {one['mean_mm']:.1f} mm too low on average"
        for one in planned.low_stretches
    )
    drafts = ""
    if (draft := planned.of_draft) is not None:
        drafts = f"; as drafts, the best round has {draft.under_mm3:.0f} mm3 and {draft.over_mm3:.0f} mm3, and"
    return (
        f"{it.under_mm3:.0f} mm3 are missing below the face and {it.over_mm3:.0f} mm3 are above it, according to "
        f"particles{drafts or ';'} the better baseline ({better.name}) has {better.misfit.under_mm3:.0f} mm3 and "
        f"{better.misfit.over_mm3:.0f} mm3." + (f" {low[0].upper()}{low[1:]}." if low else "")
    )


def plan_cautions(planned: Planned, fluid_warnings: Sequence[str]) -> list[str]:
    """Return cautions about the fluid and the plan.

    There is one about the plan if it has no band, is worse than a baseline, or differs much from the fast model.
    """
    cautions = [*fluid_warnings]
    if planned.band_95_mm is None:
        cautions.append(
            "Only one seed judged this plan, so the scatter of single runs is unknown and its level has no "
            "band. Use --seeds 3."
        )
    if planned.best.off_mm is None:
        not_verified = f"NOT VERIFIED: no plan was better than {planned.best.name}, which is the result."
        if planned.unfilled_mm3 > planned.best.misfit.cost_mm3:
            not_verified += (
                f" A plan aims {planned.margin_mm + planned.reserve_mm:.2f} mm below the face, which leaves "
                f"{planned.unfilled_mm3:.0f} mm3 unfilled by itself: give a smaller --margin-mm or --reserve-mm."
            )
        return [f"{not_verified} No robot program is written.", *cautions]
    over_mm3, steady_mm3 = planned.with_more.over_mm3, planned.with_more.constant_flow_over_mm3
    if over_mm3 > steady_mm3:
        cautions.append(
            f"If the pump gives 10 % more and the yield stress is 15 % lower, the plan leaves {over_mm3:.0f} mm3 over "
            f"the face and constant flow {steady_mm3:.0f} mm3, by the fast model: aim lower (--reserve-mm)."
        )
    if planned.best.off_mm > AGREES_MM:
        cautions.append(
            f"Fast model and particles still differ by {planned.best.off_mm:.2f} mm on average. The level is "
            "that of the particles; another round (--verify), or corrections that add sealant (--reserve-mm 0), may be "
            "better."
        )
    return cautions


def _plan_levels(planned: Planned) -> Figure:
    figure, axes = wide_axes(3.2, face=True)
    if (half_mm := planned.half_width_mm) is not None:
        ends_mm = planned.level_mm - half_mm, planned.level_mm + half_mm
        axes.fill_between(planned.s_mm, *ends_mm, color=SIMULATED, alpha=0.2, linewidth=0, label="95 % band")
    axes.plot(planned.s_mm, planned.level_mm, color=SIMULATED, label="the plan")
    for one in planned.baselines:
        axes.plot(one.level.s_mm, one.level.level_mm, BASELINES[one.name], color=MUTED, label=one.name)
    axes.legend(fontsize=8, ncols=4)
    label_axes(axes, ALONG, "level from the face (mm)", "")
    return figure


def _flow(planned: Planned) -> Figure:
    figure, axes = wide_axes(2.6)
    it = planned.trajectory
    axes.stairs(it.flow_mm3_s[:-1], it.s_mm, color=SIMULATED, baseline=None)
    label_axes(axes, ALONG, "flow (mm3/s)", "")
    other = axes.twinx()
    other.stairs(it.speed_mm_s[:-1], it.s_mm, color=MEASURED, baseline=None, linestyle="--")
    other.set_ylabel("speed (mm/s), dashed")
    return figure
