"""The page of a plan: flow and speed along the crack, and its level beside those of both baselines."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sealtwin.plan.make_plan import Planned

AGREES_MM = 0.4  # Mean difference of prediction and particles up to which the page is silent on it
BASELINES = {"constant flow": "--", "flow by local area": ":"}


def write_page(path: Path, planned: "Planned", content: dict[str, Any]) -> None:
    """Write the page, whose numbers are those of plan.json."""
    from validate.figures.figure_sheet import FigureSheet, FigureTable, Numbers, Plot, SheetSection
    from validate.figures.figure_sheet import write_sheet_of_figures as write

    rows = [("the plan, mean of its seeds", content), *content["baselines"].items()]
    rows += [(f"round {number}", one) for number, one in enumerate(content["rounds"], start=1)]
    keys = ("under_mm3", "over_mm3", "total_mm3", "highest_mm")
    figures = [[name, *(one[key] for key in keys)] for name, one in rows]
    head = ("path", "under (mm3)", "over (mm3)", "in all (mm3)", "highest (mm)")
    table = FigureTable(
        title="Judged by particles",
        head=head,
        rows=[[row[0], *(f"{value:.0f}" for value in row[1:4]), f"{row[4]:+.2f}"] for row in figures],
        name="judged",
        numbers=Numbers(head, figures),
    )
    it = planned.trajectory
    flow = Numbers(
        ("s_mm", "speed_mm_s", "flow_mm3_s"), np.column_stack([it.s_mm, it.speed_mm_s, it.flow_mm3_s]).tolist()
    )
    band = []
    if content["band_95_mm"] is not None:
        band = [(f"95 % band of a run, half-width, by {len(content['seeds'])} runs", f"{content['band_95_mm']:.2f} mm")]
    sheet = FigureSheet(
        title=f"Plan: {content['name']}",
        lead="Flow and speed along the path, chosen on the fast model and judged by particles. No number is measured.",
        cautions=cautions_of(content),
        finding=finding(content),
        key_figures=[
            ("sealant", f"{content['sealant_mm3'] / 1000:.3g} ml"),
            ("duration", f"{content['duration_s']:.1f} s"),
            *band,
            *chance_rows(content["chances"] or {}),
        ],
        parts=[
            SheetSection(
                "Level",
                [],
                [Plot("levels", "Level by particles along the crack; 0 is the face.", lambda: _levels(planned)), table],
            ),
            SheetSection("Path", [], [Plot("flow", "Flow and speed of the plan.", lambda: _flow(planned), flow)]),
        ],
    )
    write(path.parent, path.name, sheet)


def chance_rows(chances: dict[str, float]) -> list[tuple[str, str]]:
    """Return how many draws of the posterior overspill, and how many stand too high; none without a posterior."""
    told = {
        "over": "draws of the posterior with more than {} over the face",
        "level": "draws that stand above {}",
    }
    rows = []
    for name, share in chances.items():
        what, _, limit = name.partition("_above_")
        if limit:
            said = told[what].format(limit.replace("_", " "))
            rows.append((said, f"{share * chances['draws']:.0f} of {chances['draws']:.0f}"))
    return rows


def finding(content: dict[str, Any]) -> str:
    """Return the result in a sentence."""
    name, least = min(content["baselines"].items(), key=lambda one: one[1]["total_mm3"])
    low = "; ".join(
        f"from {one['from_mm']:.0f} to {one['to_mm']:.0f} mm the level is {one['mean_mm']:.1f} mm too low on average"
        for one in content["low_stretches"]
    )
    return (
        f"{content['under_mm3']:.0f} mm3 are missing below the face and {content['over_mm3']:.0f} mm3 stand above it, "
        f"by particles; with {name}, the better baseline, {least['under_mm3']:.0f} and {least['over_mm3']:.0f}."
        + (f" {low[0].upper()}{low[1:]}." if low else "")
    )


def cautions_of(content: dict[str, Any]) -> list[str]:
    """Return sentences on its fluid, and on a plan without a band, worse than a baseline or far off the fast model."""
    single = [*content["fluid_warnings"]]
    if content["band_95_mm"] is None:
        single += [
            "One run of particles judged this plan, so that the scatter of single runs is not known and its level has "
            "no band. Use --seeds 3."
        ]
    if not content["verified"]:
        not_verified = f"NOT VERIFIED: no plan was better than {content['kept']}, which is kept."
        return [f"{not_verified} No robot program is written.", *single]
    if content["expected_off_mm"] <= AGREES_MM:
        return single
    return [
        *single,
        f"Fast model and particles still differ by {content['expected_off_mm']:.2f} mm on average. The level is "
        "that of the particles; another round (--verify) may find a better plan.",
    ]


def _levels(planned: "Planned") -> "Figure":
    from validate.figures.figure_sheet import wide_axes
    from validate.figures.theme import ALONG, MUTED, SIMULATED, label_axes

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


def _flow(planned: "Planned") -> "Figure":
    from validate.figures.figure_sheet import wide_axes
    from validate.figures.theme import ALONG, MEASURED, SIMULATED, label_axes

    figure, axes = wide_axes(2.6)
    it = planned.trajectory
    axes.stairs(it.flow_mm3_s[:-1], it.s_mm, color=SIMULATED, baseline=None)
    label_axes(axes, ALONG, "flow (mm3/s)", "")
    other = axes.twinx()
    other.stairs(it.speed_mm_s[:-1], it.s_mm, color=MEASURED, baseline=None, linestyle="--")
    other.set_ylabel("speed (mm/s), dashed")
    return figure
