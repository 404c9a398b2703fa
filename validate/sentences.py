"""Sentences and tables of the report: blocks of templates/report_words.j2, filled with facts.

The block of a fact has the fact's key as its name, with underscores instead of dots and hyphens.
"""

from collections.abc import Iterable
from functools import cache
from typing import Any

import jinja2
from matplotlib import get_cachedir

from sealtwin.core.facts import Fact, Kind, Level
from validate.units import LABELS, PageTable, counted, millimetres, percent, setting_name, signed, span

ROW, PART = "␞␟"  # Marks of the template: begin of a table's row, and end of a label, a title or a figure
Value = float | int | str | None


def sentence(key: str, **parts: Any) -> str:
    """Return the text of a block on one line. ``parts`` contains the values that the block uses, by name."""
    template = _template()
    block = template.blocks[key.replace(".", "_").replace("-", "_")]
    return " ".join("".join(block(template.new_context(parts))).split())


def stated(
    key: str, value: Value = None, unit: str = "", kind: Kind = "finding", level: Level = "plain", **parts: Any
) -> Fact:
    """Return a fact with the text of the key's block, which may use ``value`` and ``parts``."""
    return Fact(key, sentence(key, value=value, **parts), value, unit, kind, level)


def doubted(key: str, value: Value = None, unit: str = "", **parts: Any) -> Fact:
    """Return a fact of the kind "doubt": a warning that should be read before the result."""
    return stated(key, value, unit, "doubt", "caution", **parts)


def assumed(key: str, value: Value = None, unit: str = "", **parts: Any) -> Fact:
    """Return an assumption, or something that was left out."""
    return stated(key, value, unit, "assumption", **parts)


def table(key: str, **parts: Any) -> PageTable:
    """Return the table of a block, which has a title, and a label and a text for each row."""
    title, *rows = sentence(key, **parts).split(ROW)
    return PageTable(title.strip(), tuple(_parts(row) for row in rows))


def tile(key: str, **parts: Any) -> tuple[str, str, str]:
    """Return the title, figure and text of a block."""
    return _parts(sentence(key, **parts))


def _parts(text: str) -> Any:
    return tuple(map(str.strip, text.split(PART)))


def template_cache() -> jinja2.BytecodeCache:
    """Return the user's cache of compiled templates, in matplotlib's folder. Compiling them takes 0.3 s."""
    return jinja2.FileSystemBytecodeCache(get_cachedir())


@cache
def _template() -> jinja2.Template:
    # The page escapes the text; a PDF and a terminal print it as it is.
    loader = jinja2.PackageLoader("validate")
    environment = jinja2.Environment(
        loader=loader, undefined=jinja2.StrictUndefined, autoescape=False, bytecode_cache=template_cache(),
        # A text of a user has no rows of its own.
        finalize=lambda value: value.replace(ROW, "").replace(PART, "") if isinstance(value, str) else value,
    )  # fmt: skip
    environment.globals.update(
        counted=counted, each=_each, from_face=_from_face, labels=LABELS, listed=_listed, millimetres=millimetres,
        percent=percent, signed=signed, span=span,
    )  # fmt: skip
    environment.filters["setting_name"] = setting_name
    return environment.get_template("report_words.j2")


def _each(form: str, values: Iterable[float]) -> str:
    return ", ".join(form % value for value in values)


def _from_face(level_mm: float) -> str:
    if round(level_mm, 1) == 0:
        return "at the face"
    return f"{abs(level_mm):.1f} mm {'above' if level_mm > 0 else 'below'} the face"


def _listed(places_mm: list[float]) -> str:
    return _each("%g", places_mm[:5]) + (" ..." if len(places_mm) > 5 else "")
