"""What one setting does to the error while the other stays: the paper's Fig. 10."""

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import FigureBase
from matplotlib.ticker import FuncFormatter

from validate.drawing.theme import INK, canvas, label_axes, themed
from validate.studies.chart import Chart

COLOURS = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.3, 0.88, 256)))
"""Without its ends, of which one vanishes on a dark page and the other on a light one."""


def draw_influence(chart: Chart, of: int, on: FigureBase | None = None) -> FigureBase:
    """Of axis 0 or 1: a line for each value of the other one, or points where that has no steps."""
    along, other = chart.axes[of], chart.axes[1 - of]
    with themed():
        figure = canvas(on, 9.0, 4.2)
        axes = figure.add_subplot()
        places, kept = (np.array([run.at[index] for run in chart.runs]) for index in (of, 1 - of))
        norm = (LogNorm if other.logarithmic else Normalize)(other.values[0], other.values[-1])
        if other.is_graded(len(chart.runs)):
            for value in other.values:
                here = np.flatnonzero(kept == value)
                here = here[np.argsort(places[here])]
                axes.plot(
                    places[here], chart.errors_mm[here], "o-", color=COLOURS(norm(value)), markersize=3, linewidth=1.2
                )
        else:
            axes.scatter(places, chart.errors_mm, c=kept, cmap=COLOURS, norm=norm, s=18)
        if along.is_graded(len(chart.runs)):
            mean_mm = [chart.errors_mm[places == value].mean() for value in along.values]
            axes.plot(along.values, mean_mm, color=INK, linewidth=3.0, label=f"mean over {other.name}")
            axes.legend(loc="best")
        bar = figure.colorbar(ScalarMappable(norm, COLOURS), ax=axes, pad=0.01)
        bar.set_label(other.label)
        if other.logarithmic:
            bar.formatter = FuncFormatter(lambda value, _: f"{value:g}")
            bar.update_ticks()
        if along.logarithmic:
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.set_ylim(0, None)
        label_axes(axes, along.label, "mean error (mm)", f"Influence of {along.name}")
    return figure
