"""Figures as part of a page, light or dark."""

import re

import numpy as np
import pytest
from PIL import Image

from validate.figures.drawing import as_picture, as_svg
from validate.figures.snapshots import Snapshot, draw_fill
from validate.figures.solid_pictures import draw_side_view
from validate.figures.theme import AIR, in_page, plate, themed


def test_a_figure_in_pixels_is_what_its_png_shows(tmp_path):
    """Its width in pixels, 4.6 x 220, is a whole number but for rounding: one pixel less shears the picture."""
    figure = plate(2.9)
    figure.add_subplot().plot([0, 1], [0, 1])
    with themed():
        figure.savefig(tmp_path / "one.png", dpi=220, facecolor="white")
    with Image.open(tmp_path / "one.png") as opened:
        assert opened.size == (1012, 638)
        assert np.array_equal(np.asarray(opened.convert("RGB")), np.asarray(as_picture(figure, 220)))


@pytest.mark.broad
def test_the_air_around_sealant_stays_light_on_a_dark_page(scene, frames, evidence):
    """Every panel with particles has a ground of its own, whose colour is none of those that follow the page.

    Broken on purpose with the figure saved as transparent, which takes the grounds of its panels too, there are none.
    """
    side = draw_side_view(evidence.run, evidence.outline, evidence.solid, evidence.profile)
    figures = {"fill": draw_fill(frames[1:], scene), "snapshot": Snapshot(scene).draw(frames[-1]), "side": side}
    grounds = {
        name: len(re.findall(f'fill: {AIR}"', in_page(as_svg(figure, name, 20), name)))
        for name, figure in figures.items()
    }
    assert grounds["side"] == 1
    # Besides the air of each panel, each nozzle that is drawn is filled with it.
    assert grounds["fill"] >= 2 * len(frames[1:])
    assert grounds["snapshot"] >= 6
