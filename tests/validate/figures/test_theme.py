"""Figures as part of a page, light or dark."""

import re

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from PIL import Image

from tests.support.evidence import axes_of
from validate.figures.snapshots import Snapshot, draw_fill
from validate.figures.solid_pictures import draw_side_view
from validate.figures.theme import AIR, as_picture, as_svg, in_page, plate, themed


def test_a_figure_in_pixels_is_what_its_png_shows(tmp_path):
    """Its width in pixels, 4.6 x 220, is a whole number but for rounding: one pixel less shears the picture."""
    figure = plate(2.9)
    figure.add_subplot().plot([0, 1], [0, 1])
    with themed():
        figure.savefig(tmp_path / "one.png", dpi=220, facecolor="white")
    with Image.open(tmp_path / "one.png") as opened:
        assert opened.size == (1012, 638)
        assert np.array_equal(np.asarray(opened.convert("RGB")), np.asarray(as_picture(figure, 220)))


def test_the_air_around_sealant_stays_light_on_a_dark_page(scene, frames, evidence):
    """Every panel with particles has a ground of its own, whose colour is none of those that follow the page.

    Broken on purpose with the figure saved as transparent, which takes the grounds of its panels too, there are none.
    """
    side = draw_side_view(evidence.run, evidence.outline, evidence.solid, evidence.profile)
    assert len(re.findall(f'fill: {AIR}"', in_page(as_svg(side, "side", 20), "side"))) == 1
    for figure, panels in ((draw_fill(frames[1:], scene), 2), (Snapshot(scene).draw(frames[-1]), 6)):
        assert sum(to_hex(axes.get_facecolor()) == AIR for axes in axes_of(figure)) == panels


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
