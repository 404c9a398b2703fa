"""A page of figures and tables, each also a file of its own: SVG for papers, CSV for whoever wants the numbers."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
from markupsafe import Markup
from matplotlib.figure import FigureBase

from sealtwin.store.files import write_text
from sealtwin.store.tables import write_sheet
from validate.drawing.svg import as_svg, in_page

DPI = 110
"""Of what is drawn as pixels inside a figure: a page of thirty fills stays below 2 MB."""
FIGURES = "figures"
NAME_BREAKS = re.compile(r"(?<=[._/])(?=[^\W\d])")
"""Where a line of a table may end within a name or a path; a number has no such place."""
LONGEST_PART = 16
"""Characters between two such places, from which on a cell breaks anywhere: a table is not as wide as some names."""

Cell = str | float | None


@dataclass(frozen=True)
class Numbers:
    """What a CSV holds. Text in it can be no formula, whoever wrote it."""

    columns: Sequence[str]
    """With their units."""
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Plot:
    """A figure, and the numbers that it was drawn from."""

    name: str
    """Of its files."""
    caption: str
    draw: Callable[[FigureBase | None], FigureBase]
    numbers: Numbers | None = None


@dataclass(frozen=True)
class Grid:
    """A table, as it is read."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    name: str = ""
    """Of its CSV; none where empty."""
    numbers: Numbers | None = None


@dataclass(frozen=True)
class Part:
    title: str
    words: Sequence[str]
    items: Sequence[Plot | Grid]


@dataclass(frozen=True)
class Sheet:
    """A page."""

    title: str
    lead: str
    cautions: Sequence[str]
    finding: str
    """What it comes to, in a sentence or two."""
    key_figures: Sequence[tuple[str, str]]
    parts: Sequence[Part]


def write_sheet_of_figures(folder: Path, name: str, sheet: Sheet) -> list[str]:
    """Write ``name``, a page that needs no other file and no network, and figures/ beside it.

    Returns the names of all files in ``folder``.
    """
    written, parts = [name], []
    for part in sheet.parts:
        items = []
        for item in part.items:
            if isinstance(item, Plot):
                svg = as_svg(item.draw(None), item.name, DPI)
                write_text(folder / FIGURES / f"{item.name}.svg", svg)
                written.append(f"{FIGURES}/{item.name}.svg")
                items.append({"kind": "plot", "caption": item.caption, "svg": in_page(svg, item.caption)})
            else:
                items.append({"kind": "grid", "title": item.title, "head": item.head, "rows": item.rows})
            if item.numbers is not None:
                write_sheet(folder / FIGURES / f"{item.name}.csv", item.numbers.columns, item.numbers.rows)
                written.append(f"{FIGURES}/{item.name}.csv")
        parts.append({"title": part.title, "words": part.words, "list": items})
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("validate"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    environment.filters["breaking"], environment.tests["unbroken"] = _breaking, _is_unbroken
    content = vars(sheet) | {"parts": parts}
    write_text(folder / name, environment.get_template("sheet.html.j2").render(content))
    return written


def _breaking(text: str) -> Markup:
    return Markup("<wbr>").join(NAME_BREAKS.split(text))


def _is_unbroken(text: str) -> bool:
    return any(len(part) > LONGEST_PART for word in text.split() for part in NAME_BREAKS.split(word))
