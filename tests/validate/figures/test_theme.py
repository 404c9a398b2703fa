"""Figures as part of a page, light or dark."""

import re

from matplotlib.colors import to_hex

from tests.support.evidence import axes_of
from validate.figures.snapshots import Snapshot, draw_fill
from validate.figures.solid_pictures import draw_side_view
from validate.figures.theme import AIR, as_svg, in_page


def test_the_background_of_sealant_is_light_even_on_a_dark_page(scene, frames, evidence):
    """Every panel with particles has a background whose colour does not follow the page.

    Broken on purpose with the figure saved as transparent, the panels lose their backgrounds too.
    """
    side = draw_side_view(evidence.run, evidence.outline, evidence.solid, evidence.profile)
    assert len(re.findall(f'fill: {AIR}"', in_page(as_svg(side, "side"), "side"))) == 1
    for figure, panels in ((draw_fill(frames[1:], scene), 2), (Snapshot(scene).draw(frames[-1]), 6)):
        assert sum(to_hex(axes.get_facecolor()) == AIR for axes in axes_of(figure)) == panels
