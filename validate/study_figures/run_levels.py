"""Levels and errors of several runs in one plot; of a study as in the paper's Fig. 7."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sealtwin.core.drawing.theme import (
    ALONG,
    INK,
    MEASURED,
    MUTED,
    SIMULATED,
    THIRD,
    label_axes,
    put_legend_under_title,
    themed,
)
from validate.metrics.curve_distances import Difference
from validate.study_figures.chart import Chart
from validate.study_figures.figure_sheet import wide_figure
from validate.study_figures.side_by_side import Side, first_with_readings

COLOURS = (SIMULATED, MEASURED, THIRD, "#cc79a7", "#e69f00", "#9467bd", INK)
"""Okabe and Ito's colours, without their sky blue, which the first one becomes on a dark page.

Colours four apart, which have the same stroke, are no shades of each other.
"""
STROKES = ("-", "--", ":", "-.")
MOST = len(COLOURS) * len(STROKES)  # Largest number of runs that look different: every stroke in every colour
LEGEND_COLUMNS = 10  # Largest number of two-digit labels, with their strokes, side by side


@themed()
def draw_levels_of_runs(sides: Sequence[Side]) -> Figure:
    """Draw levels as lines and readings as circles, in the colour of their run, or in ink if shared."""
    figure, axes = _around_zero(4.2)
    first_with = first_with_readings(sides)
    for index, side in enumerate(sides):
        readings = side.readings
        if readings is not None and first_with[index] == index:
            colour = COLOURS[index % len(COLOURS)] if first_with.count(index) == 1 else INK
            axes.plot(readings.s_mm, readings.level_mm, "o", color=colour, markersize=4, markerfacecolor="none")
        _draw_line(axes, index, side.profile.s_mm, side.profile.level_mm)
    kinds = sorted({side.readings.data for side in sides if side.readings is not None})
    told = " and ".join(kind if kind == "measured" else kind.upper() for kind in kinds)
    _finish(axes, sides, "level from the face (mm)", f"Levels, and readings ({told}) as circles" if kinds else "Levels")
    return figure


@themed()
def draw_errors_of_runs(sides: Sequence[Side]) -> Figure:
    """Draw the signed errors of the runs with readings."""
    figure, axes = _around_zero(3.2)
    for index, side in enumerate(sides):
        if side.readings is not None:
            profile, readings = side.profile, side.readings
            error = Difference(profile.s_mm, profile.level_mm, readings.s_mm, readings.level_mm)
            _draw_line(axes, index, error.x, error.value)
    _finish(axes, sides, "error (mm)", "Signed error: positive where the simulated level is too high")
    return figure


def _around_zero(height_in: float) -> tuple[Figure, Axes]:
    figure = wide_figure(height_in)
    axes = figure.add_subplot()
    axes.axhline(0.0, color=INK, linewidth=1.0)
    return figure, axes


def _draw_line(axes: Axes, index: int, s_mm: np.ndarray, value_mm: np.ndarray) -> None:
    # Neighbours have different strokes, so that coinciding lines are both visible.
    stroke, colour = STROKES[index % len(STROKES)], COLOURS[index % len(COLOURS)]
    axes.plot(s_mm, value_mm, stroke, color=colour, label=str(index + 1))


def _finish(axes: Axes, sides: Sequence[Side], y: str, title: str) -> None:
    axes.set_xlim(0, max(side.profile.s_mm[-1] for side in sides))
    label_axes(axes, ALONG, y, title)
    put_legend_under_title(axes, columns=LEGEND_COLUMNS)


@themed()
def draw_levels_of_study(chart: Chart) -> Figure:
    """Draw the levels of all runs over the readings, the nearest one in bold."""
    figure = wide_figure(4.2)
    axes = figure.add_subplot()
    curves = [np.column_stack([run.profile.s_mm, run.profile.level_mm]) for run in chart.runs]
    axes.add_collection(LineCollection(curves, colors=MUTED, linewidths=0.7, alpha=0.5, rasterized=True))
    readings, best = chart.readings, chart.best
    axes.axhline(0.0, color=INK, linewidth=1.0)
    low_mm, high_mm = readings.level_mm - chart.band_mm, readings.level_mm + chart.band_mm
    axes.fill_between(readings.s_mm, low_mm, high_mm, color=MEASURED, alpha=0.3, linewidth=0)
    axes.plot(readings.s_mm, readings.level_mm, "--o", color=MEASURED, markersize=3.5)
    axes.plot(best.profile.s_mm, best.profile.level_mm, color=SIMULATED, linewidth=3.0)
    s_mm, level_mm = np.vstack([*curves, np.column_stack([readings.s_mm, readings.level_mm])]).T
    axes.set_xlim(0, s_mm.max())
    axes.set_ylim(level_mm.min() - 1, level_mm.max() + 1)
    label_axes(axes, ALONG, "level from the face (mm)", f"Levels of {len(chart.runs)} runs")
    kind = "" if readings.data == "measured" else f", {readings.data.upper()}"
    strokes = {
        "a run": Line2D([], [], color=MUTED, linewidth=0.7),
        f"nearest: {chart.said(best)}, {best.mean_error_mm:.2f} mm off": Line2D([], [], color=SIMULATED, linewidth=3.0),
        f"caliper{kind}, 95 % band": Line2D([], [], color=MEASURED, linestyle="--", marker="o", markersize=3.5),
    }
    axes.legend(strokes.values(), strokes.keys(), loc="lower right")
    return figure
