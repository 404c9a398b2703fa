"""How well a fluid run did as it went: the columns of health.csv over time."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import FigureBase
from matplotlib.ticker import MaxNLocator

from sealtwin.records import Floats
from validate.drawing.theme import MEASURED, SIMULATED, canvas, label_axes, put_legend_under_title, themed

PANELS = (
    ("compression (%)", {"density_error_mean": "mean of what moves", "density_error_p95": "95 % of it stay below"}),
    ("particles", {"particles": "out of the nozzle", "moving": "moving"}),
    ("particles", {"escaped": "through a wall: must stay 0", "spilled": "spilled over the sample's edge"}),
    ("iterations", {"viscosity_iterations": "of the viscosity solve, a substep"}),
    ("time (ms)", {"ms_a_frame": "of computing, a frame"}),
)  # fmt: skip
"""Each with its unit, and its curves by column."""
PERCENT = 100.0
STYLES = ((SIMULATED, "-"), (MEASURED, (0, (4, 2))))
"""Of the first curve and the second: told apart without colour, and where one lies on the other."""


def draw_health(columns: Mapping[str, Floats], on: FigureBase | None = None) -> FigureBase:
    """``columns`` by the names of health.csv, all of one length; NaN where a row had nothing to say."""
    with themed():
        figure = canvas(on, 9.0, 8.5)
        rows = figure.subplots(len(PANELS), 1, sharex=True)
        for axes, (unit, curves) in zip(rows, PANELS, strict=True):
            factor = PERCENT if "%" in unit else 1.0
            for (name, label), (colour, dashes) in zip(curves.items(), STYLES, strict=False):
                values = factor * columns[name]
                axes.plot(columns["t_s"], values, color=colour, linestyle=dashes, linewidth=1.2, label=label)
            highest = max(float(np.nanmax(columns[name], initial=0.0)) for name in curves)
            axes.set_ylim(0.0, 1.08 * factor * highest if highest else 1.0)
            if unit == "particles":
                axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
            label_axes(axes, "", unit, "")
            put_legend_under_title(axes, columns=2)
        rows[-1].set_xlabel("simulated time (s)")
    return figure
