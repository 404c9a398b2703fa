"""A figure as SVG, as pixels, or as both."""

import io
from dataclasses import dataclass

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from PIL import Image

from validate.figures.theme import themed

NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
"""Metadata that an SVG omits, so that two equal runs give equal files."""


@dataclass(frozen=True)
class DrawnFigure:
    svg: str
    pixels: Image.Image  # On a white background


def as_svg(figure: Figure, name: str, pixels_dpi: int) -> str:
    """Return a figure as SVG. The same figure and name always give the same text.

    ``name`` must be unique on a page. ``pixels_dpi`` is the resolution of the parts that are drawn as pixels.
    """
    target = io.StringIO()
    figure.set_dpi(pixels_dpi)
    figure.patch.set_facecolor("none")
    # The ids of clip paths differ between the figures of a page, but not between two runs.
    with themed(), rc_context({"svg.hashsalt": name}):
        FigureCanvasSVG(figure).print_svg(target, metadata=NO_METADATA)
    return target.getvalue()


def as_picture(figure: Figure, dpi: int) -> Image.Image:
    """Return a figure as pixels on a white background."""
    figure.set_dpi(dpi)
    figure.patch.set_facecolor("white")
    canvas = FigureCanvasAgg(figure)
    with themed():
        canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def draw_both(figure: Figure, name: str, dpi: int) -> DrawnFigure:
    """Return what ``as_svg`` and ``as_picture`` return. The layout is computed once: it takes half of the time."""
    svg = as_svg(figure, name, dpi)
    figure.set_layout_engine("none")
    return DrawnFigure(svg, as_picture(figure, dpi))
