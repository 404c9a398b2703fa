"""Mean error over a study's two settings: the map of the paper's Fig. 8 and the curves of its Fig. 10."""

from collections.abc import Sequence
from string import ascii_lowercase
from typing import Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from sealtwin.core.drawing.theme import INK, MEASURED, label_axes, print_plain, themed
from sealtwin.core.records import Floats
from validate.study_figures.chart import Chart
from validate.study_figures.figure_sheet import wide_figure
from validate.study_figures.run_errors import Axis, HeldRun

CELLS = 240  # Number of the map's cells along each axis, finer than a page shows
LINE_COLOURS = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.3, 0.88, 256)))
"""Viridis without its ends, of which one is invisible on a dark page and the other on a light one."""
HALO = [withStroke(linewidth=2.5, foreground=INK)]  # Dark edge of white marks on the map


def scale_axis(axes: Axes, name: Literal["x", "y"], setting: Axis) -> None:
    """Scale an axis of a plot as its setting, with plain numbers on a logarithmic one."""
    if setting.logarithmic:
        axes.set(**{f"{name}scale": "log"})
        print_plain(axes.xaxis if name == "x" else axes.yaxis)


@themed()
def draw_influence(chart: Chart, of: int) -> Figure:
    """Draw the mean error over axis ``of``, with a line for each value of the other one, or points off a grid."""
    along, other = chart.axes[of], chart.axes[1 - of]
    figure = wide_figure(4.2)
    axes = figure.add_subplot()
    places, kept = (np.array([run.at[index] for run in chart.runs]) for index in (of, 1 - of))
    norm = (LogNorm if other.logarithmic else Normalize)(other.values[0], other.values[-1])
    if other.is_graded(len(chart.runs)):
        for value in other.values:
            here = np.flatnonzero(kept == value)
            here = here[np.argsort(places[here])]
            colour = LINE_COLOURS(norm(value))
            axes.plot(places[here], chart.errors_mm[here], "o-", color=colour, markersize=3, linewidth=1.2)
    else:
        axes.scatter(places, chart.errors_mm, c=kept, cmap=LINE_COLOURS, norm=norm, s=18)
    if along.is_graded(len(chart.runs)):
        mean_mm = [chart.errors_mm[places == value].mean() for value in along.values]
        axes.plot(along.values, mean_mm, color=INK, linewidth=3.0, label=f"mean over {other.name}")
        axes.legend(loc="best")
    bar = figure.colorbar(ScalarMappable(norm, LINE_COLOURS), ax=axes, pad=0.01)
    bar.set_label(other.label)
    if other.logarithmic:
        print_plain(bar.long_axis)
    scale_axis(axes, "x", along)
    axes.set_ylim(0, None)
    label_axes(axes, along.label, "mean error (mm)", f"Influence of {along.name}")
    return figure


@themed()
def draw_heat(chart: Chart, chosen: Sequence[HeldRun] = ()) -> Figure:
    """Draw the map with the runs as crosses and the letters of the ``chosen`` ones."""
    figure = wide_figure(5.4)
    axes = figure.add_subplot()
    across, up, error_mm = heat(chart)
    drawn = axes.pcolormesh(across, up, error_mm, cmap="viridis", shading="auto", rasterized=True)
    figure.colorbar(drawn, ax=axes, pad=0.01).set_label("mean error (mm)")
    at, near, best = np.array([run.at for run in chart.runs]), np.array(chart.as_near), chart.best
    axes.plot(*at.T, "x", color=MEASURED, markersize=5, markeredgewidth=1.1, label="a run", clip_on=False)
    told = "as near, by readings and scatter of runs"
    ring = {"color": "white", "markerfacecolor": "none", "markersize": 9, "path_effects": HALO}
    axes.plot(*at[near].T, "o", **ring, label=told, clip_on=False)
    told = f"nearest: {chart.said(best)}, {best.mean_error_mm:.2f} mm"
    star = {"color": "white", "markeredgecolor": INK, "markersize": 16, "linestyle": "none"}
    axes.plot(*best.at, "*", **star, label=told, clip_on=False)
    numbers = [run.number for run in chart.runs]
    for letter, run in zip(ascii_lowercase, chosen, strict=False):
        # On the side of the middle: title and colour bar are beyond the edges.
        right, above = chart.places[numbers.index(run.number)] > 0.5
        axes.annotate(
            letter,
            run.at,
            (-9 if right else 9, -12 if above else 8),
            textcoords="offset points",
            ha="right" if right else "left",
            color="white",
            fontsize=11,
            fontweight="bold",
            path_effects=HALO,
        )
    scale_axis(axes, "x", chart.axes[0])
    scale_axis(axes, "y", chart.axes[1])
    axes.grid(visible=False)
    label_axes(axes, chart.axes[0].label, chart.axes[1].label, "Mean error against the readings")
    # Above the marks of runs on the upper edge.
    axes.set_title(axes.get_title(loc="left"), pad=12.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8.0)
    return figure


def heat(chart: Chart) -> tuple[Floats, Floats, Floats]:
    """Return values across and up, (k,) each, and the mean error between the runs, (k, k), by SciPy's linear griddata.

    A logarithmic axis is interpolated in its logarithm; outside the runs' hull the error is NaN.
    """
    from scipy.interpolate import griddata

    values = np.array([run.at for run in chart.runs]).T
    places = [axis.spaced(each) for axis, each in zip(chart.axes, values, strict=True)]
    lines = [np.linspace(each.min(), each.max(), CELLS) for each in places]
    grid = tuple(np.meshgrid(*lines))
    error_mm = griddata(np.column_stack(places), chart.errors_mm, grid, method="linear", rescale=True)
    across, up = (10.0**line if axis.logarithmic else line for axis, line in zip(chart.axes, lines, strict=True))
    return across, up, error_mm
