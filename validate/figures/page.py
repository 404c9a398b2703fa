"""The page of a study: facts, plots and tables. Each plot is also written as SVG, and each table as CSV.

A study has one function that returns its ``Page``: a finding, and sections of sentences, plots and tables.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sealtwin.core.files import write_sheet, write_text
from validate.figures.theme import as_svg, in_page
from validate.sentences import template_cache

DPI = 110  # Resolution of the pixels inside a figure. A page of thirty fills then has less than 2 MB.
FIGURES = "figures"
NAME_BREAKS = re.compile(r"(?<=[._/])(?=[^\W\d])")
"""Positions in names and paths at which a line of a table may break. No line breaks inside a number."""
LONGEST_PART = 16  # Largest number of characters between two breaks. A longer part may break anywhere.
NONE = "-"  # Text of a cell without a value
Values = Sequence[Any] | NDArray[Any]


@dataclass(frozen=True)
class Plot:
    """A figure, and the columns of its CSV by name with unit."""

    name: str  # Name of its files
    caption: str
    draw: Callable[[], Figure]
    numbers: Mapping[str, Values] | None = None


@dataclass(frozen=True)
class FigureColumn:
    """A column of a table on the page, of its CSV, or of both. A value is a number, a text or None."""

    head: str  # Heading on the page. Empty if only the CSV has the column.
    values: str | Values  # Values, or the path of the value in each record of the table
    text: Callable[[Any], str] = str  # Text of a value on the page
    name: str | None = None  # Heading in the CSV. None: as on the page. Empty: only the page has the column.


@dataclass(frozen=True)
class FigureTable:
    """A table of a page, and its CSV."""

    title: str
    name: str  # Name of its CSV
    columns: Sequence[FigureColumn]
    records: Sequence[Any] = ()  # Record of each row
    order: Sequence[int] | None = None  # Rows on the page, in order. None for all rows, as in the CSV.

    @property
    def head(self) -> list[str]:
        return [column.head for column in self.columns if column.head]

    @property
    def rows(self) -> list[list[str]]:
        """Texts of the rows on the page."""
        texts = [
            [NONE if value is None else column.text(value) for value in self._values(column)]
            for column in self.columns
            if column.head
        ]
        rows = [list(row) for row in zip(*texts, strict=True)]
        return rows if self.order is None else [rows[row] for row in self.order]

    @property
    def numbers(self) -> dict[str, Values]:
        """Columns of the CSV by name."""
        names = [column.head if column.name is None else column.name for column in self.columns]
        return {name: self._values(column) for name, column in zip(names, self.columns, strict=True) if name}

    def _values(self, column: FigureColumn) -> Values:
        path = column.values
        return [part_of(record, path) for record in self.records] if isinstance(path, str) else path


def part_of(record: Any, path: str) -> Any:
    """Return a field of a record by its path, such as "volumes.volume_balance_error_mm".

    Returns None if a part is None.
    """
    return reduce(lambda value, name: None if value is None else getattr(value, name), path.split("."), record)


class Section(NamedTuple):
    """Section of a page: sentences, figures and tables."""

    title: str
    items: Sequence[str | Plot | FigureTable]


@dataclass(frozen=True)
class Page:
    """Content of a page: facts, figures and tables."""

    title: str
    lead: str
    cautions: Sequence[str]
    finding: str  # Main result, in a sentence or two
    key_figures: Sequence[tuple[str, str]]
    sections: Sequence[Section]


def page_environment(*packages: str) -> jinja2.Environment:
    """Return the environment of the templates of ``packages`` and of this package. It escapes all text."""
    loader = jinja2.ChoiceLoader([jinja2.PackageLoader(package) for package in (*packages, "validate")])
    return jinja2.Environment(
        loader=loader,
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        bytecode_cache=template_cache(),
    )


def write_page(path: Path, page: Page) -> list[str]:
    """Write a page and, next to it, the folder figures/. The page needs no other file and no network.

    Returns the names of all written files, relative to the page's folder.
    """
    written, pictures = [path.name], {}

    def write(name: str, writer: Callable[..., None], *content: Any) -> None:
        written.append(f"{FIGURES}/{name}")
        writer(path.parent / FIGURES / name, *content)

    for item in (item for section in page.sections for item in section.items if not isinstance(item, str)):
        if isinstance(item, Plot):
            svg = as_svg(item.draw(), item.name, DPI)
            write(f"{item.name}.svg", write_text, svg)
            pictures[item.name] = in_page(svg, item.caption)
        if item.numbers is not None:
            rows = zip(*item.numbers.values(), strict=True)
            # NaN is the only number that differs from itself.
            cells = [[None if value != value else value for value in row] for row in rows]
            write(f"{item.name}.csv", write_sheet, list(item.numbers), cells)
    environment = page_environment()
    environment.filters["breaking"] = lambda text: Markup("<wbr>").join(NAME_BREAKS.split(text))
    environment.tests["unbroken"] = lambda text: any(
        len(part) > LONGEST_PART for word in text.split() for part in NAME_BREAKS.split(word)
    )
    write_text(path, environment.get_template("sheet.html.j2").render(vars(page), pictures=pictures))
    return written
