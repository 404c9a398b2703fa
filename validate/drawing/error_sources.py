"""The error at each station beside what it may come from: one figure."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from sealtwin.records import Comparison, Floats
from validate.drawing.level_curves import ALONG
from validate.drawing.theme import (
    INK,
    MEASURED,
    MUTED,
    SIMULATED,
    THIRD,
    canvas,
    label_axes,
    put_legend_under_title,
    themed,
)
from validate.uncertainty.validation import COVERAGE

HEIGHT_IN = 4.6
CAPTION = (
    "Simulated less measured level E at each station, with twice the validation uncertainty u_val (ASME V&V 20). "
    "Filled where |E| is larger. Below, the standard uncertainties that u_val is made of."
)


def draw_uncertainty(comparison: Comparison, on: FigureBase | None = None) -> FigureBase:
    """Of a comparison that was assessed."""
    stations = comparison.metrics["uncertainty"]["stations"]
    s_mm, error_mm, validation_mm = (np.asarray(stations[key]) for key in ("s_mm", "error_mm", "validation_mm"))
    with themed():
        figure = canvas(on, 9.0, HEIGHT_IN)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _draw_errors(upper, s_mm, error_mm, COVERAGE * validation_mm)
        for key, name, colour, style in (
            ("data_mm", "readings", MEASURED, "-"),
            ("numerics_mm", "numerics", SIMULATED, "--"),
            ("inputs_mm", "inputs", THIRD, "-."),
        ):
            if stations[key] is not None:
                lower.plot(s_mm, stations[key], style, color=colour, label=name)
        lower.plot(s_mm, validation_mm, color=INK, linewidth=1.0, label="u_val, all together")
        lower.set_ylim(bottom=0.0)
        label_axes(lower, ALONG, "u (mm)", "Standard uncertainties")
        put_legend_under_title(lower, columns=4)
    return figure


def _draw_errors(axes: Axes, s_mm: Floats, error_mm: Floats, half_mm: Floats) -> None:
    resolved = np.abs(error_mm) > half_mm
    axes.axhline(0.0, color=INK, linewidth=1.0)
    axes.errorbar(s_mm, error_mm, half_mm, fmt="none", ecolor=MUTED, elinewidth=1.0, capsize=2.5, label="± 2 u_val")
    for which, fill, name in ((resolved, SIMULATED, "|E| above 2 u_val"), (~resolved, "#ffffff", "not above it")):
        axes.plot(s_mm[which], error_mm[which], "o", color=SIMULATED, markerfacecolor=fill, markersize=5, label=name)
    label_axes(axes, "", "E (mm)", "Error at the stations: above zero, the simulation stands too high")
    put_legend_under_title(axes, columns=3)
