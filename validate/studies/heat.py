"""Mean error over a study's two settings, with the runs as crosses: the paper's Fig. 8."""

from collections.abc import Sequence
from string import ascii_lowercase

import numpy as np
from matplotlib.figure import FigureBase
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter

from sealtwin.records import Floats
from validate.drawing.theme import INK, MEASURED, canvas, label_axes, themed
from validate.studies.chart import Chart
from validate.studies.held import Held

CELLS = 240
"""Of the heat map, along each axis: finer than a page shows."""
COLOURS = "viridis"


def draw_heat(chart: Chart, chosen: Sequence[Held] = (), on: FigureBase | None = None) -> FigureBase:
    """``chosen`` get letters, by which their fills are found."""
    with themed():
        figure = canvas(on, 9.0, 5.4)
        axes = figure.add_subplot()
        across, up, error_mm = heat(chart)
        drawn = axes.pcolormesh(across, up, error_mm, cmap=COLOURS, shading="auto", rasterized=True)
        bar = figure.colorbar(drawn, ax=axes, pad=0.01)
        bar.set_label("mean error (mm)")
        places = np.array([run.at for run in chart.runs])
        near = np.array(chart.as_near)
        axes.plot(*places.T, "x", color=MEASURED, markersize=5, markeredgewidth=1.1, label="a run", clip_on=False)
        axes.plot(
            *places[near].T,
            "o",
            color="white",
            markerfacecolor="none",
            markersize=9,
            label="as near, by readings and scatter of runs",
            clip_on=False,
            path_effects=[withStroke(linewidth=2.5, foreground=INK)],
        )
        axes.plot(
            *chart.best.at,
            "*",
            color="white",
            markeredgecolor=INK,
            markersize=16,
            linestyle="none",
            label=f"nearest: {chart.said(chart.best)}, {chart.best.mean_error_mm:.2f} mm",
            clip_on=False,
        )
        for letter, run in zip(ascii_lowercase, chosen, strict=False):
            # Toward the middle of the map: past its edges title and colours stand.
            right, above = (axis.is_past_middle(value) for axis, value in zip(chart.axes, run.at, strict=True))
            axes.annotate(
                letter,
                run.at,
                (-9 if right else 9, -12 if above else 8),
                textcoords="offset points",
                ha="right" if right else "left",
                color="white",
                fontsize=11,
                fontweight="bold",
                path_effects=[withStroke(linewidth=2.5, foreground=INK)],
            )
        for axis, setter, coordinate in zip(
            chart.axes, (axes.set_xscale, axes.set_yscale), (axes.xaxis, axes.yaxis), strict=True
        ):
            if axis.logarithmic:
                setter("log")
                coordinate.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.grid(visible=False)
        label_axes(axes, chart.axes[0].label, chart.axes[1].label, "Mean error against the readings")
        # Above the marks of runs on the upper edge.
        axes.set_title(axes.get_title(loc="left"), pad=12.0)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8.0)
    return figure


def heat(chart: Chart) -> tuple[Floats, Floats, Floats]:
    """Values across and up, (k,) each, and the mean error (k, k) between the runs: SciPy's griddata, linear.

    Over powers of ten where the axes count those; NaN outside the runs' hull.
    """
    from scipy.interpolate import griddata

    places = np.column_stack(
        [axis.spaced(np.array([run.at[index] for run in chart.runs])) for index, axis in enumerate(chart.axes)]
    )
    lines = [np.linspace(each.min(), each.max(), CELLS) for each in places.T]
    error_mm = griddata(places, chart.errors_mm, tuple(np.meshgrid(*lines)), method="linear", rescale=True)
    across, up = (10.0**line if axis.logarithmic else line for axis, line in zip(chart.axes, lines, strict=True))
    return across, up, error_mm
