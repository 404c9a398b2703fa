"""The meaning of a column's name by the words of labs: its role, direction, unit and number.

A name with an unknown word has no meaning; none is guessed from the rest of it.
"""

import re
import tomllib
from dataclasses import dataclass
from importlib.resources import files as resources
from typing import Literal

from validate.readings.text_table import plain_letters
from validate.settings import Quantity, Unit

Role = Literal["station", "reading", "repeat", "sample", "skipped"]
"""Role of a column. "repeat" numbers the readings of a station, "sample" names the sample of a row, and "skipped" holds
notes, or figures that were calculated from readings.
"""

WORDS = tomllib.loads(resources("validate").joinpath("readings", "words.toml").read_text(encoding="utf-8"))
"""Words of labs in all languages: of units, columns, names of files, and notes."""
UNITS: dict[str, Unit] = {name: unit for unit, names in WORDS["units"].items() for name in names.split()}
INCH = re.compile(r"[\[(/_]\s*in\s*[\])]?\s*$")
"""The unit "in" in brackets or at the end; elsewhere it is a preposition."""
LONGEST_NAME = 200  # Limit on the letters of a name; a longer one is a text, in which a search for a unit takes long
WORD = re.compile(r"[^\W\d_]+|[0-9]+")
COLUMNS = {role: frozenset(words.split()) for role, words in WORDS["columns"].items()}
STATION, REPEAT, VALUE, COUNTER = (COLUMNS[role] for role in ("station", "repeat", "value", "counter"))
DOWNWARD, HEIGHT, SAMPLE, SKIPPED = (COLUMNS[role] for role in ("downward", "height", "sample", "skipped"))
DEPTH, LEVEL = DOWNWARD | COLUMNS["depth"], HEIGHT | COLUMNS["level"]
OF_SAMPLE = COUNTER | COLUMNS["beside_sample"]
OF_STATION, OF_READING = (COLUMNS["beside_any"] | COLUMNS[key] for key in ("beside_station", "beside_reading"))
TOWARD = re.compile(r"(?<![^\W_])(?:{toward})[\W_]+(?:(?P<up>{up})|{down})(?![^\W_])".format(**WORDS["directions"]))
"""Direction in several words."""


@dataclass(frozen=True)
class ColumnMeaning:
    role: Role
    unit: Unit | None = None
    quantity: Quantity | None = None  # Direction in which a reading counts; None where the name leaves it open
    number: str | None = None  # Number of a repeat; None where the name holds none


def meaning(name: str) -> ColumnMeaning | None:
    """Return the meaning of a column's name; None where any word of it is unknown."""
    if len(name) > LONGEST_NAME:
        return None
    plain = TOWARD.sub(lambda toward: "upward" if toward["up"] else "downward", plain_letters(name))
    found = WORD.findall(plain)
    numbers = [word for word in found if word.isdigit()]
    units: set[Unit] = {UNITS[word] for word in found if word in UNITS}
    words = {word for word in found if not word.isdigit() and word not in UNITS}
    if INCH.search(plain):
        units.add("inch")
    if len(units) > 1:
        return None
    unit = next(iter(units), None)
    if words & SAMPLE and words <= SAMPLE | OF_SAMPLE and not (unit or numbers):
        return ColumnMeaning("sample")
    if words & SKIPPED or (words and words <= COUNTER) or (words & STATION and words & COUNTER):
        return ColumnMeaning("skipped", unit)
    if words & STATION:
        return ColumnMeaning("station", unit) if words <= STATION | OF_STATION and not numbers else None
    if (
        not words & (DEPTH | LEVEL | REPEAT | VALUE)
        or not words <= DEPTH | LEVEL | REPEAT | VALUE | COUNTER | OF_READING
    ):
        return None
    ways = words & (DEPTH | LEVEL)
    # A height that counts downward is a depth; a level below something may count either way.
    if words & DEPTH and words & LEVEL and not ways <= HEIGHT | DOWNWARD:
        return None
    quantity: Quantity | None = "depth" if words & DEPTH else "level" if words & LEVEL else None
    bare = quantity is None and unit is None and not numbers
    counts = bare and (words & COUNTER or not words & VALUE)
    return ColumnMeaning("repeat" if counts else "reading", unit, quantity, "-".join(numbers) or None)


def unit_of(text: str) -> Unit | None:
    """Return the unit of a cell that holds nothing else, such as "[mm]"; else None."""
    word = plain_letters(text).strip("[]() ")
    return "inch" if word == "in" else UNITS.get(word)
