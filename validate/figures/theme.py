"""Style of all figures, and conversion of a figure to SVG or pixels.

There is one font, and a palette that colour-blind readers can distinguish. No global state is set.
"""

import io
import re
from base64 import b64encode
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
from markupsafe import Markup, escape
from matplotlib import font_manager, rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from PIL import Image

from sealtwin.core.records import Floats, Profile

INK = "#1c2833"
MUTED = "#66727d"
GRID = "#d4dadf"
GROUND = "#c9c2b8"
"""Colour of mortar in a section."""
ON_GROUND = "#2b2620"
"""Colour of lines and words on mortar and air. It stays dark on a dark page."""
AIR = "#fcfcfa"
"""Colour around sealant. It stays light on a dark page, on which the darkest sealant would otherwise be invisible."""
ON_SEALANT = [withStroke(linewidth=3.0, foreground=AIR)]  # Light edge of a line that is drawn on particles
CARD = "#ffffff"  # Colour of the page behind a figure
# Colours of Okabe and Ito, distinct with any colour vision and in grey.
SIMULATED = "#0072b2"
MEASURED = "#d55e00"
THIRD = "#009e73"
AGES = "viridis"
HEIGHTS = "cividis"
SPEEDS = "plasma"  # Colour maps of the sealant's age, height and speed
DEVIATIONS = "RdBu_r"  # Colour map of differences: blue below 0, white at 0, red above

ALONG = "s from the end where the nozzle starts (mm)"  # Label of the axis along the crack
LEVEL = "level from the face (mm)"
BAND = "95 % band, all stations together"
LEGEND_ROW_PT = 12.5  # Height of a legend's line of 8 pt, with the space between two lines
STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    # Axes are transparent unless a figure fills them.
    "axes.facecolor": "none",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    # No figure has ticks at its top. Without a fixed position of titles, Matplotlib would measure all labels.
    "axes.titley": 1.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "text.color": INK,
    # A user's text is never a formula, even if a sample is called $\frac$.
    "text.parse_math": False,
    "text.usetex": False,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
}


@contextmanager
def themed() -> Iterator[None]:
    """Apply the style. Draw and write figures inside this context: Matplotlib reads most of a style when drawing."""
    with rc_context(STYLE):
        yield


PLATE_IN = 4.6  # Width of a plate in inches
FOOT_IN, HEAD_IN = 0.46, 0.3
"""Lower and upper margin of a plate, in inches. Margins are fixed, because measuring all labels takes longer than
drawing them."""


def plate(height_in: float) -> Figure:
    """Return an empty figure whose text is legible on a phone and at half the width of an A4 page."""
    figure = Picture(figsize=(PLATE_IN, height_in))
    figure.subplots_adjust(0.125, FOOT_IN / height_in, 0.965, 1 - HEAD_IN / height_in, 0.1)
    return figure


class Picture(Figure):
    """A figure outside pyplot, so pyplot's state in a user's notebook does not change. A notebook shows it once."""

    def _repr_html_(self) -> str:
        file = io.BytesIO()
        with themed():
            self.savefig(file, format="png")
        return f'<img src="data:image/png;base64,{b64encode(file.getvalue()).decode()}">'


def wide_figure(height_in: float) -> Figure:
    """Return an empty figure as wide as a page."""
    return Picture(figsize=(9.0, height_in), layout="constrained")


def wide_axes(height_in: float, *, face: bool = False) -> tuple[Figure, Axes]:
    """Return a figure as wide as a page and its axes. If ``face`` is True, there is a line at 0."""
    figure = wide_figure(height_in)
    axes = figure.add_subplot()
    if face:
        draw_face(axes)
    return figure, axes


def label_axes(axes: Axes, x: str, y: str, title: str, legend: int = 0) -> Figure:
    """Label axes and return their figure. A legend of ``legend`` columns is placed between title and plot.

    Inside the plot, a curve could run through the legend.
    """
    figure = axes.figure.get_figure(root=True)
    axes.set(xlabel=x, ylabel=y, title=title)
    if legend:
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.0,
            borderpad=0.3,
            ncols=legend,
            columnspacing=1.5,
            fontsize=8.0,
        )
        legend_pt = LEGEND_ROW_PT * -(-len(axes.get_legend_handles_labels()[1]) // legend)
        axes.set_title(title, pad=6.0 + legend_pt)
        if figure.get_layout_engine() is None:
            top = 1 - (HEAD_IN + legend_pt / 72) / figure.get_figheight()
            figure.subplots_adjust(top=min(top, figure.subplotpars.top))
    return figure


def caliper_label(readings: Profile) -> str:
    """Return the name of readings for a legend, with their origin in capitals unless they were measured."""
    return "caliper" if readings.data == "measured" else f"caliper, {readings.data.upper()}"


def draw_face(axes: Axes) -> None:
    """Draw the line at 0: the sample's face, or an error of 0."""
    axes.axhline(0.0, color=INK, linewidth=1.0)


def draw_band(
    axes: Axes,
    x: Floats,
    middle: Floats | float,
    half: Floats | float,
    colour: str,
    alpha: float,
    label: str | None = None,
) -> None:
    axes.fill_between(x, middle - half, middle + half, color=colour, alpha=alpha, linewidth=0, label=label)


def draw_curve(
    axes: Axes,
    s_mm: Floats,
    level_mm: Floats,
    style: str = "-",
    half_mm: Floats | None = None,
    alpha: float = 0.3,
    band: str | None = None,
    **line: Any,
) -> None:
    """Draw a level along the crack over its band, which has the half-width ``half_mm`` and the label ``band``.

    ``line`` contains the line's colour and other properties.
    """
    if half_mm is not None:
        draw_band(axes, s_mm, level_mm, half_mm, line["color"], alpha, band)
    axes.plot(s_mm, level_mm, style, **line)


def draw_ground(axes: Axes, s_mm: Floats, floor_mm: Floats, bottom_mm: float) -> None:
    """Draw the sample's material between the floor and the lower end of the plot."""
    axes.fill_between(s_mm, floor_mm, bottom_mm, color=GROUND, linewidth=0)


def printable(text: str) -> str:
    """Replace control characters, and characters that the figures' font lacks, with question marks."""
    codes = _characters()
    return "".join(letter if letter == "\n" or ord(letter) in codes else "?" for letter in re.sub(r"\r\n?", "\n", text))


@cache
def _characters() -> frozenset[int]:
    font = font_manager.get_font(font_manager.findfont("DejaVu Sans"))
    return frozenset(code for code in font.get_charmap() if code >= ord(" "))


PAGE_COLOURS = {
    INK: "--ink",
    MUTED: "--muted",
    GRID: "--grid",
    CARD: "--card",
    SIMULATED: "--simulated",
    MEASURED: "--measured",
    THIRD: "--third",
}
"""Colours of a figure that follow a light or dark page, with their CSS variables."""


def in_page(svg: str, caption: str) -> Markup:
    """Return ``svg`` for use inside a page. Matplotlib has escaped its texts, so they cannot act as markup."""
    head, body = svg[svg.index("<svg") :].split(">", 1)
    head = re.sub(r' (width|height)="[^"]*"', "", head)
    for colour, variable in PAGE_COLOURS.items():
        body = body.replace(f": {colour}", f": var({variable})")
    return Markup(f'{head} role="img" aria-label="{escape(caption)}">{body}')


DPI = 150  # Resolution of pictures, and of pixels inside figures
NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
"""Metadata that is left out of an SVG, so that equal runs give equal files."""


def as_svg(figure: Figure, name: str, dpi: int = DPI) -> str:
    """Return a figure as SVG. The same figure and name always give the same text.

    ``name`` must be unique on a page. ``dpi`` is the resolution of the parts that are drawn as pixels.
    """
    target = io.StringIO()
    figure.set_dpi(dpi)
    figure.patch.set_facecolor("none")
    # The ids of clip paths differ between the figures of a page, but not between two runs.
    with themed(), rc_context({"svg.hashsalt": name}):
        FigureCanvasSVG(figure).print_svg(target, metadata=NO_METADATA)
    return target.getvalue()


def as_picture(figure: Figure) -> Image.Image:
    """Return a figure as pixels on a white background."""
    figure.set_dpi(DPI)
    figure.patch.set_facecolor("white")
    canvas = FigureCanvasAgg(figure)
    with themed():
        canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
