"""Curves of several runs in one plot: room for all, each told from the others."""

from dataclasses import replace
from itertools import pairwise

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from tests.evidence import axes_of
from tests.sides import side
from validate.figures.compare_sheet import MOST, draw_errors_of_runs, draw_levels_of_runs
from validate.figures.theme import INK


def sides_of(count):
    """Each with readings of its own, under names as long as people like."""
    return [side("W" * 60 + str(number), 0.1, lowered_mm=0.1 * number, data="reconstructed") for number in range(count)]


@pytest.mark.parametrize("count", [2, 4, 8, MOST])
@pytest.mark.parametrize("draw", [draw_levels_of_runs, draw_errors_of_runs])
def test_any_number_of_runs_leaves_the_plot_its_width(draw, count):
    """Its axes take four fifths of the figure, and the legend ends with it.

    Broken on purpose with names and sheets in the legend, four runs leave a plot half as wide.
    """
    figure = draw(sides_of(count))
    assert isinstance(figure, Figure)
    FigureCanvasAgg(figure).draw()
    (axes,) = axes_of(figure)
    assert axes.get_position().width > 0.8
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [str(number + 1) for number in range(count)]
    box = legend.get_window_extent()
    assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
    assert axes.bbox.y1 <= box.y0 < box.y1 <= figure.bbox.y1


def test_no_two_runs_look_alike():
    """By colour and stroke; neighbours, which may lie on each other, by both."""
    (axes,) = axes_of(draw_errors_of_runs(sides_of(MOST)))
    looks = [(to_rgb(line.get_color()), line.get_linestyle()) for line in axes.lines if line.get_label() != "_child0"]
    assert len(set(looks)) == len(looks) == MOST
    for (colour, stroke), (next_colour, next_stroke) in pairwise(looks):
        assert (colour != next_colour, stroke != next_stroke) == (True, True)


def test_readings_that_runs_share_belong_to_none_of_them():
    """And the figure says, also when it stands alone, that nobody measured them."""
    same = [replace(each, readings=sides_of(1)[0].readings) for each in sides_of(2)]
    (axes,) = axes_of(draw_levels_of_runs([*same, *sides_of(3)[2:]]))
    circles = [line for line in axes.lines if line.get_marker() == "o"]
    runs = {str(line.get_label()): line.get_color() for line in axes.lines if line.get_marker() != "o"}
    assert [line.get_color() for line in circles] == [INK, runs["3"]]
    assert axes.get_title(loc="left") == "Levels, and readings (RECONSTRUCTED) as circles"
