"""A figure as pixels, after it was drawn as SVG."""

import numpy as np
import pytest
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from validate.figures.theme import as_picture, as_svg, plate, themed

DPI = 150


def dashed(axes):
    axes.plot([0, 1], [0, 1], color="k", linestyle="--", linewidth=3, path_effects=[withStroke(linewidth=8)])


def band(axes):
    axes.fill_between([0, 1], [0.2, 0.3], [0.7, 0.9], color="k", alpha=0.5, linewidth=6)


def clipped(axes):
    cut = Circle((0.5, 0.5), 0.3, transform=axes.transData)
    axes.plot([0, 2], [0, 2], color="k", linewidth=60)[0].set_clip_path(cut)


def photo(axes):
    axes.imshow(np.arange(12).reshape(3, 4), extent=(0.2, 0.7, 0.1, 0.8), aspect="auto")


def particles(axes):
    axes.scatter([0.3, 0.7], [0.3, 0.6], s=4000, c=["k", "r"], rasterized=True)


@pytest.mark.parametrize("artist", [dashed, band, clipped, photo, particles])
def test_pixels_show_what_the_svg_does(artist):

    def figure():
        figure = plate(2.0)
        axes = figure.add_subplot()
        axes.set(xlim=(0, 1), ylim=(0, 1), title="words", xticks=[0, 1], yticks=[0, 1])
        artist(axes)
        return figure

    with themed():
        drawn = figure()
        as_svg(drawn, "drawn", DPI)
        pixels, alone = as_picture(drawn, DPI), as_picture(figure(), DPI)
    assert pixels.size == alone.size
    # Rounding of places changes edges slightly.
    assert np.abs(np.asarray(pixels, float) - np.asarray(alone, float)).max() < 40
