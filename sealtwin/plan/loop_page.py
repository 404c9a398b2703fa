"""The page of an emulated loop: the level over time, and the estimates."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sealtwin.plan.emulation import Emulated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 6  # Moments whose level is drawn


def write_loop_page(path: Path, poured: Emulated, content: dict[str, Any]) -> None:
    """Write the page, all of whose numbers are emulated."""
    from validate.figures.figure_sheet import FigureSheet, Numbers, Plot, SheetSection, write_sheet_of_figures

    columns = ("t_s", "flow estimate", "material estimate", "flow now (mm3/s)")
    states, flows = [line["state"] for line in poured.lines], [line["plan"]["flow_mm3_s"] for line in poured.lines]
    rows = [
        (line["t_s"], state["flow"], float(np.exp(state["material"])), (flow or (0.0,))[0])
        for line, state, flow in zip(poured.lines, states, flows, strict=True)
    ]
    caption, numbers = "Flow and material over the plan's.", Numbers(columns, rows)
    sheet = FigureSheet(
        title="The fill, corrected on its way: EMULATED",
        lead="Reality is particles with hidden faults, and the sensor is emulated: no number here is measured.",
        cautions=[
            *content["other_versions"],
            *content["fluid_warnings"],
            *([f"It stopped: {content['stopped']}."] if content["stopped"] else []),
        ],
        finding=loop_finding(content),
        key_figures=[
            ("updates", f"{content['updates']}"),
            ("sealant given", f"{content['given_mm3'] / 1000:.3g} ml"),
            ("tables off the fast model", f"{content['tables_off_mm']:.2f} mm"),
        ],
        parts=[
            SheetSection(
                "Level over time, EMULATED",
                ["Levels that the sensor saw, of which each is later than the one before, and the level at the end."],
                [Plot("levels-over-time", "Levels along the crack; 0 is the face.", lambda: _levels(poured))],
            ),
            SheetSection("Estimates, EMULATED", [], [Plot("estimates", caption, lambda: _estimates(rows), numbers)]),
        ],
    )
    write_sheet_of_figures(path.parent, path.name, sheet)


def loop_finding(content: dict[str, Any]) -> str:
    """Return the result in a sentence."""
    return (
        f"EMULATED: {content['under_mm3']:.0f} mm3 are missing below the face and {content['over_mm3']:.0f} mm3 stand "
        f"above it; after the first pass it was {content['after_first_pass_mm3']:.0f} mm3 in all."
    )


def _levels(poured: Emulated) -> "Figure":
    from validate.figures.figure_sheet import wide_axes
    from validate.figures.theme import ALONG, SIMULATED, label_axes

    figure, axes = wide_axes(3.2, face=True)
    frames = [line["level"] for line in poured.lines if line["level"] is not None]
    for number in np.unique(np.linspace(0, len(frames) - 1, min(SHOWN, len(frames))).astype(int)).tolist():
        frame, shade = frames[number], 0.25 + 0.5 * number / max(1, len(frames) - 1)
        how: dict[str, Any] = {"color": SIMULATED, "alpha": shade, "label": f"{frame['t_s']:.1f} s"}
        axes.plot(frame["s_mm"], frame["level_mm"], ".", markersize=3, **how)
    axes.plot(poured.level.s_mm, poured.level.level_mm, color=SIMULATED, label="at the end")
    axes.legend(fontsize=8, ncols=4)
    label_axes(axes, ALONG, "level from the face (mm)", "")
    return figure


def _estimates(rows: list[tuple[float, float, float, float]]) -> "Figure":
    from validate.figures.figure_sheet import wide_axes
    from validate.figures.theme import MEASURED, SIMULATED, label_axes

    figure, axes = wide_axes(2.4)
    for column, (name, colour) in enumerate((("flow", SIMULATED), ("material", MEASURED)), start=1):
        axes.plot([row[0] for row in rows], [row[column] for row in rows], color=colour, label=name)
    axes.legend(fontsize=8)
    label_axes(axes, "t (s)", "over the plan's", "")
    return figure
