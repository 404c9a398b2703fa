"""How every figure looks: one palette that colour-blind readers can tell apart, one font, no global state."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
from matplotlib import font_manager, rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

from sealtwin.records import Floats

INK = "#1c2833"
MUTED = "#66727d"
GRID = "#d4dadf"
GROUND = "#c9c2b8"
"""Mortar, cut."""
ON_GROUND = "#2b2620"
"""Lines and words on mortar and in the air, dark on a dark page too."""
AIR = "#fcfcfa"
"""Around sealant: light on a dark page too, where its darkest colours would be lost."""
# Okabe and Ito: told apart with any colour vision, and in grey.
SIMULATED = "#0072b2"
MEASURED = "#d55e00"
THIRD = "#009e73"
AGES = "viridis"
HEIGHTS = "cividis"
SPEEDS = "plasma"

LEGEND_ROW_PT = 12.5
"""A line of 8 pt with the space between two."""

STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    # What has a ground of its own says so; all else stands on the page.
    "axes.facecolor": "none",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "text.color": INK,
    # A sample may be called $\frac$: what users wrote is never a formula.
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
    """All drawing and writing of figures happens inside: matplotlib reads most of a style late."""
    with rc_context(STYLE):
        yield


def canvas(on: FigureBase | None, width_in: float, height_in: float) -> FigureBase:
    """The part of a page that was given, or a new figure of its own."""
    return Figure(figsize=(width_in, height_in), layout="constrained") if on is None else on


def label_axes(axes: Axes, x: str, y: str, title: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title)


def draw_ground(axes: Axes, s_mm: Floats, floor_mm: Floats, bottom_mm: float) -> None:
    """Sample below a floor, down to the end of the plot."""
    outline_mm = np.concatenate([floor_mm, [bottom_mm, bottom_mm]])
    axes.fill(np.concatenate([s_mm, s_mm[[-1, 0]]]), outline_mm, color=GROUND, linewidth=0)


def put_legend_under_title(axes: Axes, columns: int) -> None:
    """Between title and plot: inside it, some curve of some user would run through."""
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles,
        labels,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        borderaxespad=0.0,
        borderpad=0.3,
        columnspacing=1.5,
        fontsize=8.0,
    )
    rows = -(-len(labels) // columns)
    axes.set_title(axes.get_title(loc="left"), pad=6.0 + LEGEND_ROW_PT * rows)


def printable(text: str) -> str:
    """Text with every character that the figures' font lacks, control characters too, as a question mark."""
    known = _characters()
    return "".join(letter if letter == "\n" or ord(letter) in known else "?" for letter in re.sub(r"\r\n?", "\n", text))


@cache
def _characters() -> frozenset[int]:
    font = font_manager.get_font(font_manager.findfont("DejaVu Sans"))
    return frozenset(code for code in font.get_charmap() if code >= ord(" "))
