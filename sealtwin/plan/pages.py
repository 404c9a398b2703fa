"""Write the page of a plan, and its sentences. Importing this loads Matplotlib."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from sealtwin.plan.verify import Planned
from validate.figures.page import FigureColumn, FigureTable, Page, Plot, Section, write_page
from validate.figures.theme import ALONG, LEVEL, MEASURED, MUTED, SIMULATED, draw_curve, label_axes, themed, wide_axes
from validate.units import counted

AGREES_MM = 0.4  # Mean difference of prediction and particles above which the page mentions it
BASELINES = {"constant flow": "--", "flow by local area": ":"}


def write_plan_page(path: Path, name: str, planned: Planned, fluid_warnings: Sequence[str]) -> None:
    draft = ", draft" if not planned.options.accurate else ""
    by, others = "accurate" if draft else "mean of its seeds", [*planned.baselines, *planned.rounds]
    columns = [
        FigureColumn("path", [f"the plan, {by}", *(f"{other.name}{draft}" for other in others)]),
        FigureColumn("under (mm3)", "under_mm3", "{:.0f}".format),
        FigureColumn("over (mm3)", "over_mm3", "{:.0f}".format),
        FigureColumn("total (mm3)", "total_mm3", "{:.0f}".format),
        FigureColumn("highest (mm)", "highest_mm", "{:+.2f}".format),
    ]
    judged = FigureTable(
        "Judged by particles", "judged", columns, [planned.misfit, *(other.misfit for other in others)]
    )
    it, chances = planned.trajectory, planned.chances or {}
    key_figures = [
        ("sealant", f"{it.dispensed_mm3 / 1000:.3g} ml"),
        ("duration", f"{it.duration_s:.1f} s"),
        ("aims below the face by", f"{planned.options.aim_mm:.2f} mm"),
    ]
    if (band_mm := planned.band_95_mm) is not None:
        runs = counted(len(planned.misfits), "draft" if draft else "run")
        key_figures.append((f"half-width of the 95 % band of a run, from {runs}", f"{band_mm:.2f} mm"))
    key_figures += [
        (f"draws with {name.replace('_', ' ')}", f"{share * chances['draws']:.0f} of {chances['draws']:.0f}")
        for name, share in chances.items()
        if name != "draws"
    ]
    caption = "Level by particles along the crack; 0 is the face."
    flow = {"s_mm": it.s_mm, "speed_mm_s": it.speed_mm_s, "flow_mm3_s": it.flow_mm3_s}
    page = Page(
        title=f"Plan: {name}",
        lead="Flow and speed along the path, chosen by the fast model and judged by particles. No number is measured.",
        cautions=plan_cautions(planned, fluid_warnings),
        finding=plan_finding(planned),
        key_figures=key_figures,
        sections=[
            Section("Level", [Plot("levels", caption, lambda: _draw_levels(planned)), judged]),
            Section("Path", [Plot("flow", "Flow and speed of the plan.", lambda: _draw_flow(planned), flow)]),
        ],
    )
    write_page(path, page)


def plan_finding(planned: Planned) -> str:
    it, better = planned.misfit, min(planned.baselines, key=lambda baseline: baseline.misfit.total_mm3)
    low = "; ".join(
        f"from {part['from_mm']:.0f} to {part['to_mm']:.0f} mm the level is {part['mean_mm']:.1f} mm too low on average"
        for part in planned.low_stretches
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
                f" A plan aims {planned.options.aim_mm:.2f} mm below the face, which leaves "
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


@themed()
def _draw_levels(planned: Planned) -> Figure:
    _, axes = wide_axes(3.2, face=True)
    plan = {"color": SIMULATED, "label": "the plan"}
    draw_curve(axes, planned.level.s_mm, planned.level.level_mm, "-", planned.half_width_mm, 0.2, "95 % band", **plan)
    for baseline in planned.baselines:
        level, style = baseline.level, BASELINES[baseline.name]
        draw_curve(axes, level.s_mm, level.level_mm, style, color=MUTED, label=baseline.name)
    axes.legend(fontsize=8, ncols=4)
    return label_axes(axes, ALONG, LEVEL, "")


@themed()
def _draw_flow(planned: Planned) -> Figure:
    _, axes = wide_axes(2.6)
    it, speed = planned.trajectory, axes.twinx()
    axes.stairs(it.flow_mm3_s[:-1], it.s_mm, color=SIMULATED, baseline=None)
    speed.stairs(it.speed_mm_s[:-1], it.s_mm, color=MEASURED, baseline=None, linestyle="--")
    speed.set_ylabel("speed (mm/s), dashed")
    return label_axes(axes, ALONG, "flow (mm3/s)", "")
