"""Find which columns of the pairing file a question asks for, by the settings and columns that it names."""

import re
from collections.abc import Sequence

from sealtwin.core.settings import dotted_names
from sealtwin.trial.trial_file import Trial

SETTING = re.compile(r"\[?\b([a-z_]+(?:\.[a-z_]+)*)(?:\.|\] )([A-Za-z_]+)\b")  # crack.depth_mm, or [crack] depth_mm
TABLE = "readings.columns"
ELSEWHERE = {"readings.quantity": "sign"}  # Settings whose column has another name
SETTINGS = "settings"
CLAUSE = 60  # Letters before the name of the pairing file that may name its columns


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
