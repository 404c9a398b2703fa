"""Levels and errors of several runs in one plot, each by its number on the page."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from validate.comparison.curves import Difference
from validate.drawing.level_curves import ALONG
from validate.drawing.theme import INK, MEASURED, SIMULATED, THIRD, canvas, label_axes, put_legend_under_title, themed
from validate.studies.side_by_side import Side, first_with_readings

COLOURS = (SIMULATED, MEASURED, THIRD, "#cc79a7", "#e69f00", "#9467bd", INK)
"""Okabe and Ito's, but for their sky blue, which the first one is on a dark page. Of two that are four apart, and so
have the same stroke, none is a shade of the other.
"""
STROKES = ("-", "--", ":", "-.")
MOST = len(COLOURS) * len(STROKES)
"""Runs that can be told apart: every stroke in every colour."""
LEGEND_COLUMNS = 10
"""Numbers of two digits side by side, with their strokes."""


def draw_levels_of_runs(sides: Sequence[Side], on: FigureBase | None = None) -> FigureBase:
    """Lines, and circles where readings are: in the colour of their run, or in ink where several runs share them."""
    with themed():
        figure = canvas(on, 9.0, 4.2)
        axes = figure.add_subplot()
        axes.axhline(0.0, color=INK, linewidth=1.0)
        first_with = first_with_readings(sides)
        for index, side in enumerate(sides):
            if side.readings is not None and first_with[index] == index:
                colour = _colour(index) if first_with.count(index) == 1 else INK
                readings = side.readings
                axes.plot(readings.s_mm, readings.level_mm, "o", color=colour, markersize=4, markerfacecolor="none")
            _draw_line(axes, index, side.profile.s_mm, side.profile.level_mm)
        _finish(axes, sides, "level from the face (mm)", f"Levels{_circles(sides)}")
    return figure


def draw_errors_of_runs(sides: Sequence[Side], on: FigureBase | None = None) -> FigureBase:
    with themed():
        figure = canvas(on, 9.0, 3.2)
        axes = figure.add_subplot()
        axes.axhline(0.0, color=INK, linewidth=1.0)
        for index, side in enumerate(sides):
            if side.readings is not None:
                profile, readings = side.profile, side.readings
                error = Difference(profile.s_mm, profile.level_mm, readings.s_mm, readings.level_mm)
                _draw_line(axes, index, error.x, error.value)
        _finish(axes, sides, "error (mm)", "Signed error: above zero, the run stands too high")
    return figure


def _draw_line(axes: Axes, index: int, s_mm: np.ndarray, value_mm: np.ndarray) -> None:
    # Another stroke than the neighbour's: runs that came out the same lie on each other.
    stroke, colour = STROKES[index % len(STROKES)], _colour(index)
    axes.plot(s_mm, value_mm, stroke, color=colour, label=str(index + 1))


def _finish(axes: Axes, sides: Sequence[Side], y: str, title: str) -> None:
    axes.set_xlim(0, max(side.profile.s_mm[-1] for side in sides))
    label_axes(axes, ALONG, y, title)
    put_legend_under_title(axes, columns=LEGEND_COLUMNS)


def _circles(sides: Sequence[Side]) -> str:
    """What the circles are, for the title: a figure that is shown alone must say what was never measured."""
    kinds = sorted({side.readings.data for side in sides if side.readings is not None})
    if not kinds:
        return ""
    told = " and ".join(kind if kind == "measured" else kind.upper() for kind in kinds)
    return f", and readings ({told}) as circles"


def _colour(index: int) -> str:
    return COLOURS[index % len(COLOURS)]
