"""Columns of the pairing file: how the answers in them are read, and which of them a question asks for."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sealtwin.core.settings import dotted_names
from sealtwin.lab.found_files import Role
from sealtwin.trial.trial_file import Trial
from validate.readings.text_table import number

SPAN = "([A-Z]{1,3}(:[A-Z]{1,3})?|[a-z](:[a-z])?)"
"""B, or B:D; several lower-case letters are more likely a name."""
SPANS = re.compile(rf"{SPAN}([\s,;]+{SPAN})*")
CELL = re.compile("[A-Za-z]{1,3}[0-9]*")  # Or a column; words about a whole sheet are longer
SETTING = re.compile(r"\[?\b([a-z_]+(?:\.[a-z_]+)*)(?:\.|\] )([A-Za-z_]+)\b")  # crack.depth_mm, or [crack] depth_mm
TABLE = "readings.columns"
ELSEWHERE = {"readings.quantity": "sign"}  # Settings whose column has another name
SETTINGS = "settings"
CLAUSE = 60  # Letters before the name of the pairing file that may name its columns


def _column(reference: str) -> str:
    """Return a column's letter as the span "B:B", which cannot be the name of a column."""
    return f"{reference}:{reference}" if re.fullmatch("[A-Z]{1,3}", reference) else reference


def _levels(text: str) -> list[str]:
    return [*map(_column, re.split(r"[\s,;]+" if SPANS.fullmatch(text) else r"\s*;\s*", text))]


def _places(text: str) -> str | list[float]:
    numbers = [number(part, None) for part in re.split(r"[\s;]+", text.strip())]
    return text.lower() if None in numbers else [one for one in numbers if one is not None]


def _skip(text: str) -> list[int | str]:
    return [int(part) if part.isdecimal() else part for part in re.split(r"\s*[;,]\s*", text)]


def _as_written(text: str) -> list[str]:
    cells = re.split(r'[\s,;"]+', text.strip('" ,;'))
    return [cell.upper() if CELL.fullmatch(cell) else cell.lower() for cell in cells]


OF_COLUMNS: Mapping[str, Callable[[str], Any]] = {
    "sheet": str,
    "s": _column,
    "places": _places,
    "levels": _levels,
    "repeat": _column,
    "unit": str.lower,
    "sign": str.lower,
    "s_from": str.lower,
    "range": str.upper,
    "header_rows": lambda text: int(text) if text.isdecimal() else text,
    "skip": _skip,
    "missing": lambda text: re.split(r"\s*;\s*", text),
    "as_written": _as_written,
}
"""Columns of the pairing file that describe a sheet, each with the function that reads its text."""
ANSWERS = (*OF_COLUMNS, "crack", "mass", "settings")
"""Columns of the pairing file for the user's replies: about a sheet, the number of the crack in a photo, the masses of
a fill, and other settings."""
OPTIONAL = ("part", *ANSWERS)
"""Columns that the pairing file has only if they are needed; a user may add any of them."""
COLUMNS = ("file", "role", "sample", *OPTIONAL, "question")
"""All columns of the pairing file. The part is blank unless several samples share the file."""


def possible_answers(role: Role) -> list[str]:
    """Return the columns in which a question about a file with this role can be answered."""
    return [name for name in ANSWERS if role == {"crack": "photo", "mass": "fill"}.get(name, role)]


def as_columns(answers: Mapping[str, str]) -> dict[str, Any]:
    """Return a row's replies about a sheet as the trial's table of columns, including ``as_written`` if it is given."""
    return {key: read(answers[key]) for key, read in OF_COLUMNS.items() if key in answers}


def columns_asked(question: str, names: Sequence[str], pairing: str) -> list[str]:
    """Return the columns among ``names`` in which a question can be answered, in their order.

    A question that names neither a column nor a role can be answered in the column of settings.
    """
    either = "|".join(map(re.escape, names))
    columns = {
        *re.findall(rf"\b(?:columns? |into )'?({either})\b", question),
        *re.findall(rf"\b({either}) = ", question),
    }
    for place in re.finditer(re.escape(pairing), question):
        columns.update(re.findall(rf"\b(?<!')({either})\b", question[max(0, place.start() - CLAUSE) : place.start()]))
    for table, key in SETTING.findall(question):
        column = ELSEWHERE.get(f"{table}.{key}", key)
        if table in ("readings", TABLE) and column in names:
            columns.add(column)
        elif f"{table}.{key}" in _SETTINGS:
            columns.add(SETTINGS)
    if question and not columns and "role" not in question:
        columns.add(SETTINGS)
    return [name for name in names if name in columns]


_SETTINGS = frozenset(dotted_names(Trial))
