"""Figures as SVG: a file of its own, and part of a page whose colours it takes on."""

import io
import re

from markupsafe import Markup, escape
from matplotlib import rc_context
from matplotlib.figure import Figure, FigureBase

from validate.drawing.theme import GRID, INK, MEASURED, MUTED, SIMULATED, THIRD, themed

NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
PAGE_COLOURS = {
    INK: "--ink",
    MUTED: "--muted",
    GRID: "--grid",
    "#ffffff": "--card",
    SIMULATED: "--simulated",
    MEASURED: "--measured",
    THIRD: "--third",
}
"""Colours of a figure that follow the page, light or dark."""


def as_svg(figure: FigureBase, name: str, pixels_dpi: int) -> str:
    """A figure of its own; the same one under the same name leaves the same text.

    Names differ between the figures of a page. ``pixels_dpi`` is of what is drawn as pixels inside it.
    """
    assert isinstance(figure, Figure)
    target = io.StringIO()
    # Ids of clip paths must differ between the figures of a page, and not between two runs.
    with themed(), rc_context({"svg.hashsalt": name}):
        figure.savefig(target, format="svg", dpi=pixels_dpi, facecolor="none", metadata=NO_METADATA)
    return target.getvalue()


def in_page(svg: str, caption: str) -> Markup:
    """``svg`` as part of a page. Its texts are escaped by matplotlib's own writer; none is a formula or markup."""
    head, body = svg[svg.index("<svg") :].split(">", 1)
    head = re.sub(r' (width|height)="[^"]*"', "", head)
    for colour, variable in PAGE_COLOURS.items():
        body = body.replace(f": {colour}", f": var({variable})")
    return Markup(f'{head} role="img" aria-label="{escape(caption)}">{body}')
