"""Axes are placed as Matplotlib's constrained layout places them."""

from typing import Any

import numpy as np
import pytest
from matplotlib.layout_engine import ConstrainedLayoutEngine

from validate.figures.particles import SPEED, add_bar, age_scale
from validate.figures.theme import label_axes, plate, themed, wide_figure

POINT_PX = 1.0  # At 72 dpi


def labelled():
    axes = plate(3.0).add_subplot()
    axes.plot([-1234.5, 0.1], [-12.25, 3], label="curve")
    return label_axes(axes, "along the crack (mm)", "two\nlines", "Title", legend=1)


def opposite():
    figure = labelled()
    (axes,) = figure.axes
    axes.xaxis.tick_top()
    axes.xaxis.set_label_position("top")
    axes.yaxis.tick_right()
    axes.yaxis.set_label_position("right")
    axes.invert_yaxis()
    return figure


def grid():
    figure = wide_figure(4.0)
    for axes, most in zip(
        figure.subplots(2, 3, sharex=True, sharey="row").flat, (1, 10, 100, 1e3, 1e4, 5), strict=True
    ):
        axes.plot([0, most], [0, 1])
        axes.set(xlabel="x", title="one")
    return figure


def bars():
    figure = plate(4.0)
    axes = figure.add_subplot()
    axes.set(xlim=(0, 80), ylim=(-16, 6), aspect="equal", ylabel="z (mm)")
    add_bar(figure, SPEED, [axes], location="bottom", aspect=40, pad=0.02)
    add_bar(figure, age_scale(17.25), [axes])
    return figure


def scaled(**limits: Any):
    def draw():
        figure = plate(3.0)
        figure.add_subplot().set(xlabel="x", ylabel="y", **limits)
        return figure

    return draw


def turned():
    figure = labelled()
    figure.axes[0].tick_params(axis="x", labelrotation=90)
    return figure


FIGURES = {
    "labels": labelled,
    "labels at the top and right": opposite,
    "shared axes": grid,
    "colour bars": bars,
    "factors beside the axes": scaled(xlim=(0, 3e9), ylim=(5e-7, 6e-7)),
    "powers of ten": scaled(xscale="log", yscale="log", xlim=(1, 2e6), ylim=(1, 1e9)),
    "labels between others": scaled(yscale="log", ylim=(2, 3)),
    "turned labels": turned,
}


@pytest.mark.parametrize("name", FIGURES)
def test_axes_are_where_constrained_layout_puts_them(name):
    def axes_after(engine: Any):
        with themed():
            figure = FIGURES[name]()
            figure.set_dpi(72)
            figure.set_layout_engine(engine)
            engine.execute(figure)
        return figure.axes

    quick, usual = (axes_after(engine) for engine in (plate(1.0).get_layout_engine(), ConstrainedLayoutEngine()))
    places_px = [[axes.get_window_extent().extents for axes in group] for group in (quick, usual)]
    assert np.array(places_px[0]) == pytest.approx(np.array(places_px[1]), abs=1.5 * POINT_PX)
    assert all(spine.get_in_layout() for axes in quick for spine in axes.spines.values())
