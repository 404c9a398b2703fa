"""All profiles of a study over the readings, the nearest one in bold: the paper's Fig. 7."""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from sealtwin.records import Floats
from validate.drawing.level_curves import ALONG
from validate.drawing.theme import INK, MEASURED, MUTED, SIMULATED, canvas, label_axes, themed
from validate.studies.chart import Chart

FAINT = 0.5


def draw_levels(chart: Chart, on: FigureBase | None = None) -> FigureBase:
    with themed():
        figure = canvas(on, 9.0, 4.2)
        axes = figure.add_subplot()
        curves = [np.column_stack([run.run.profile.s_mm, run.run.profile.level_mm]) for run in chart.runs]
        axes.add_collection(LineCollection(curves, colors=MUTED, linewidths=0.7, alpha=FAINT, rasterized=True))
        readings, best = chart.readings, chart.best
        axes.axhline(0.0, color=INK, linewidth=1.0)
        axes.fill_between(
            readings.s_mm,
            readings.level_mm - chart.band_mm,
            readings.level_mm + chart.band_mm,
            color=MEASURED,
            alpha=0.3,
            linewidth=0,
        )
        axes.plot(readings.s_mm, readings.level_mm, "--o", color=MEASURED, markersize=3.5)
        axes.plot(best.run.profile.s_mm, best.run.profile.level_mm, color=SIMULATED, linewidth=3.0)
        s_mm, level_mm = np.vstack([*curves, np.column_stack([readings.s_mm, readings.level_mm])]).T
        axes.set_xlim(0, s_mm.max())
        axes.set_ylim(level_mm.min() - 1, level_mm.max() + 1)
        label_axes(axes, ALONG, "level from the face (mm)", f"Levels of {len(chart.runs)} runs")
        kind = "" if readings.data == "measured" else f", {readings.data.upper()}"
        axes.legend(
            [
                Line2D([], [], color=MUTED, linewidth=0.7),
                Line2D([], [], color=SIMULATED, linewidth=3.0),
                Line2D([], [], color=MEASURED, linestyle="--", marker="o", markersize=3.5),
            ],
            ["a run", f"nearest: {chart.said(best)}, {best.mean_error_mm:.2f} mm off", f"caliper{kind}, 95 % band"],
            loc="lower right",
        )
    return figure


def level_columns(chart: Chart) -> tuple[list[str], Floats]:
    """s, the level of each run and the readings where a station is, for a CSV."""
    s_mm = chart.best.run.profile.s_mm
    levels = [np.interp(s_mm, run.run.profile.s_mm, run.run.profile.level_mm) for run in chart.runs]
    names = [f"level_of_run_{run.run.number}_mm" for run in chart.runs]
    return ["s_mm", *names], np.column_stack([s_mm, *levels])
