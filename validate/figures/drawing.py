"""A figure as SVG, as pixels, or as both at once: Matplotlib's preparations take longer than either output."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.backends.backend_mixed import MixedModeRenderer
from matplotlib.backends.backend_svg import FigureCanvasSVG, RendererSVG
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.transforms import Affine2D, Bbox, Transform, TransformedPath
from PIL import Image

from validate.figures.theme import themed

SVG_DPI = 72  # Units of an SVG in an inch
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
    return _draw(figure, name, pixels_dpi, lambda vector: vector)


def as_picture(figure: Figure, dpi: int) -> Image.Image:
    """Return a figure as pixels on a white background."""
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    with themed():
        canvas.draw()
    return _opaque(canvas.get_renderer())


def draw_both(figure: Figure, name: str, dpi: int) -> DrawnFigure:
    """Return what ``as_svg`` and ``as_picture`` return, in little more than the time of one."""
    figure.set_dpi(dpi)
    pixels = FigureCanvasAgg(figure).get_renderer()
    svg = _draw(figure, name, dpi, lambda vector: _BothRenderer(vector, pixels))
    return DrawnFigure(svg, _opaque(pixels))


def _draw(figure: Figure, name: str, dpi: int, renderer_of: Callable[[RendererSVG], Any]) -> str:
    target = io.StringIO()
    width_in, height_in = figure.get_size_inches()
    figure.set_dpi(SVG_DPI)
    # A layout measures texts as the figure's canvas does.
    FigureCanvasSVG(figure)
    figure.patch.set_facecolor("none")
    # The ids of clip paths differ between the figures of a page, but not between two runs.
    with themed(), rc_context({"svg.hashsalt": name}):
        vector = RendererSVG(width_in * SVG_DPI, height_in * SVG_DPI, target, image_dpi=dpi, metadata=NO_METADATA)
        mixed: Any = MixedModeRenderer(figure, width_in, height_in, dpi, renderer_of(vector))
        figure.draw(mixed)
        vector.finalize()
    return target.getvalue()


def _opaque(pixels: RendererAgg) -> Image.Image:
    return Image.fromarray(np.asarray(pixels.buffer_rgba())).convert("RGB")


class _BothRenderer:
    """Draws as SVG and as pixels. Widths of lines are in points, so only positions differ by a factor."""

    def __init__(self, vector: RendererSVG, pixels: RendererAgg) -> None:
        self._vector, self._pixels = vector, pixels
        self._factor = pixels.dpi / SVG_DPI
        self._larger = Affine2D().scale(self._factor)
        paper, whole = pixels.new_gc(), Affine2D().scale(pixels.width, pixels.height)
        paper.set_linewidth(0.0)
        pixels.draw_path(paper, Path.unit_rectangle(), whole, (1.0, 1.0, 1.0))

    def __getattr__(self, name: str) -> Any:
        """Return what draws in both, or what does not draw, for example the size of a text."""
        draw = getattr(self._vector, name)
        if not name.startswith("draw_"):
            return draw

        numbers = 2 if name in ("draw_image", "draw_text") else 0  # Their first two values are a position

        def larger(index: int, value: Any) -> Any:
            if isinstance(value, Transform):
                return (value + self._larger).frozen()
            return value * self._factor if index < numbers else value

        def draw_in_both(gc: Any, *values: Any, **more: Any) -> None:
            draw(gc, *values, **more)
            getattr(self._pixels, name)(self._clipped(gc), *(larger(*each) for each in enumerate(values)), **more)

        return draw_in_both

    def _clipped(self, gc: Any) -> GraphicsContextBase:
        larger = self._pixels.new_gc()
        larger.copy_properties(gc)
        if (box := gc.get_clip_rectangle()) is not None:
            larger.set_clip_rectangle(Bbox(box.get_points() * self._factor))
        path, transform = gc.get_clip_path()
        if path is not None:
            larger.set_clip_path(TransformedPath(path, transform + self._larger))
        return larger
