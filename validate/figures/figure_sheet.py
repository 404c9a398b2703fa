"""Page of figures and tables, each also written as a file: SVG for papers, CSV for the numbers."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sealtwin.core.files import write_sheet, write_text
from validate.figures.drawing import as_svg
from validate.figures.theme import draw_face, in_page, wide_figure

DPI = 110  # Resolution of the pixels inside a figure; a page of thirty fills then has less than 2 MB
FIGURES = "figures"
NAME_BREAKS = re.compile(r"(?<=[._/])(?=[^\W\d])")
"""Places in names and paths where a line of a table may break; never inside a number."""
LONGEST_PART = 16  # Most characters between two such places; a cell with more may break anywhere
NONE = "-"  # Text of a cell without a value

Cell = str | float | None


@dataclass(frozen=True)
class Numbers:
    """Content of a CSV; a text in it is never a formula."""

    columns: Sequence[str]  # Names with units
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Plot:
    """A figure and its numbers."""

    name: str  # Name of its files
    caption: str
    draw: Callable[[], Figure]
    numbers: Numbers | None = None


@dataclass(frozen=True)
class FigureTable:
    """A table of a page, and its CSV."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    name: str  # Name of its CSV
    numbers: Numbers | None = None  # Content of the CSV; None if it is that of the page


@dataclass(frozen=True)
class SheetSection:
    """A part of a page: sentences, then figures and tables."""

    title: str
    words: Sequence[str]
    items: Sequence[Plot | FigureTable]


@dataclass(frozen=True)
class FigureSheet:
    """Content of a page of figures and tables."""

    title: str
    lead: str
    cautions: Sequence[str]
    finding: str  # Main result, in a sentence or two
    key_figures: Sequence[tuple[str, str]]
    parts: Sequence[SheetSection]


def wide_axes(height_in: float, *, face: bool = False) -> tuple[Figure, Axes]:
    """Return a figure of the page's width and its axes, with a line at 0 if ``face`` is True."""
    figure = wide_figure(height_in)
    axes = figure.add_subplot()
    if face:
        draw_face(axes)
    return figure, axes


def page_environment() -> jinja2.Environment:
    """Return the environment of the package's templates, which escapes all text."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("validate"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )


def write_sheet_of_figures(folder: Path, name: str, sheet: FigureSheet) -> list[str]:
    """Write the page ``name`` and, next to it, the folder figures/. The page needs no other file and no network.

    Returns the names of all files in ``folder``.
    """
    written, pictures = [name], {}
    for item in (item for part in sheet.parts for item in part.items):
        if isinstance(item, Plot):
            svg = as_svg(item.draw(), item.name, DPI)
            write_text(folder / FIGURES / f"{item.name}.svg", svg)
            written.append(f"{FIGURES}/{item.name}.svg")
            pictures[item.name] = in_page(svg, item.caption)
            numbers = item.numbers
        else:
            numbers = item.numbers or Numbers(item.head, item.rows)
        if numbers is not None:
            write_sheet(folder / FIGURES / f"{item.name}.csv", numbers.columns, numbers.rows)
            written.append(f"{FIGURES}/{item.name}.csv")
    environment = page_environment()
    environment.filters["breaking"] = lambda text: Markup("<wbr>").join(NAME_BREAKS.split(text))
    environment.tests["unbroken"] = lambda text: any(
        len(part) > LONGEST_PART for word in text.split() for part in NAME_BREAKS.split(word)
    )
    write_text(folder / name, environment.get_template("sheet.html.j2").render(vars(sheet), pictures=pictures))
    return written
