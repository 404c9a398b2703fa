"""Words of labs, all of which stand in ``words.toml``: meanings of columns' names, and of rows without readings."""

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from validate.readings.text_table import WORDS, is_missing, number, plain_letters
from validate.settings import Quantity, Unit

Role = Literal["station", "mass", "reading", "repeat", "sample", "skipped"]
"""Role of a column. "mass" is of a liquid, "repeat" numbers the readings of a station, "sample" names the sample of a
row, and "skipped" holds notes, other quantities, or figures that were calculated from readings.
"""

ColumnUnit = Unit | Literal["g", "kg"]
MM: dict[ColumnUnit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
GRAMS: dict[ColumnUnit, float] = {"g": 1.0, "kg": 1000.0}
UNITS: dict[str, ColumnUnit] = {name: unit for unit, names in WORDS["units"].items() for name in names.split()}
INCH = re.compile(r"[\[(/_]\s*in\s*[\])]?\s*$")
"""The unit "in" in brackets or at the end; elsewhere it is a preposition."""
UNIT_AT_END = re.compile(r"(?:[\[(/_,]|\s)\s*([^\W\d_]+|\")\s*[\])]?\s*$")
IN_BRACKETS = re.compile(r"[\[(]([^\])]*)[\])]")
LONGEST_NAME = 200  # Limit on the letters of a name; a longer one is a text, in which a search for a unit takes long
WORD = re.compile(r"[^\W\d_]+|[0-9]+")
NAME = re.compile(r"[^\W_]+")
COLUMNS = {role: frozenset(words.split()) for role, words in WORDS["columns"].items()}
STATION, REPEAT, VALUE, COUNTER = (COLUMNS[role] for role in ("station", "repeat", "value", "counter"))
DOWNWARD, HEIGHT, SAMPLE, CALCULATED = (COLUMNS[role] for role in ("downward", "height", "sample", "calculated"))
SKIPPED = CALCULATED | COLUMNS["notes"] | COLUMNS["other"]
DEPTH, LEVEL = DOWNWARD | COLUMNS["depth"], HEIGHT | COLUMNS["level"]
MASS, OF_SAMPLE = COLUMNS["mass"], COUNTER | COLUMNS["beside_sample"]
OF_STATION, OF_READING = (COLUMNS["beside_any"] | COLUMNS[key] for key in ("beside_station", "beside_reading"))
TOWARD = re.compile(r"(?<![^\W_])(?:{toward})[\W_]+(?:(?P<up>{up})|{down})(?![^\W_])".format(**WORDS["directions"]))
"""Direction in several words."""
ZERO_OF_READINGS, FACE = (frozenset(WORDS["remarks"][key].split()) for key in ("zero", "face"))
OF_FACE = COLUMNS["beside_any"] | SAMPLE
COMMENT = re.compile(r"(#(?![A-Z/0]+[!?]$)|//|%%)")
"""Beginning of a comment; #DIV/0! is a spreadsheet's error."""


@dataclass(frozen=True)
class ColumnMeaning:
    role: Role
    unit: ColumnUnit | None = None
    quantity: Quantity | None = None  # Direction in which a reading counts; None where the name leaves it open
    number: str | None = None  # Number of a repeat; None where the name holds none


@lru_cache(maxsize=4096)
def meaning(name: str) -> ColumnMeaning | None:
    """Return the meaning of a column's name; None, and nothing guessed, where any word of it is unknown."""
    if len(name) > LONGEST_NAME:
        return None
    plain = TOWARD.sub(lambda toward: "upward" if toward["up"] else "downward", plain_letters(name))
    found = WORD.findall(plain)
    numbers = [word for word in found if word.isdigit()]
    units: set[ColumnUnit] = {UNITS[word] for word in found if word in UNITS}
    words = {word for word in found if not word.isdigit() and word not in UNITS}
    if INCH.search(plain):
        units.add("inch")
        words.discard("in")
    if len(units) > 1:
        return None
    unit = next(iter(units), None)
    if words & SAMPLE and words <= SAMPLE | OF_SAMPLE and not (unit or numbers):
        return ColumnMeaning("sample")
    if words & SKIPPED or (words and words <= COUNTER) or (words & STATION and words & COUNTER):
        return ColumnMeaning("skipped", unit)
    if words & MASS:
        return ColumnMeaning("mass", unit)
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


def unit_of(text: str) -> ColumnUnit | None:
    """Return the unit of a cell that holds nothing else, such as "[mm]"; else None."""
    word = plain_letters(text).strip("[](){}/. ").removeprefix("in ")
    return "inch" if word in ("in", '"') else UNITS.get(word)


def unit_in(name: str) -> ColumnUnit | None:
    """Return the unit in brackets or at the end of a name, whose other words may be unknown; None if there is none."""
    found = [*IN_BRACKETS.findall(name[-LONGEST_NAME:]), *UNIT_AT_END.findall(name[-LONGEST_NAME:])]
    return next((unit for text in found if (unit := unit_of(text)) is not None), None)


def quantity_in(name: str) -> Quantity | None:
    """Return the direction that words of a name state, whose other words may be unknown; None where they differ."""
    words = set(WORD.findall(plain_letters(name[:LONGEST_NAME])))
    ways = bool(words & DEPTH), bool(words & LEVEL)
    return "depth" if ways == (True, False) else "level" if ways == (False, True) else None


def is_comment(text: str) -> bool:
    return COMMENT.match(text) is not None


def is_calculated(text: str) -> bool:
    """Return whether the first cell of a row says that the row is calculated from others: a mean, a sum."""
    words = {word for word in WORD.findall(plain_letters(text[:LONGEST_NAME])) if not word.isdigit()}
    return bool(words & CALCULATED) and words <= CALCULATED | OF_READING | VALUE | REPEAT | COUNTER | DEPTH | LEVEL


def is_number(text: str) -> bool:
    return number(text, None) is not None


def holds_no_number(text: str) -> bool:
    """Return whether a text is words, or stands for a missing number."""
    return is_missing(text) or not any(letter.isdigit() for letter in text)


def names_other_zero(text: str) -> bool:
    """Return whether a remark says what readings count from, in other words than those for the sample's face."""
    words = set(NAME.findall(plain_letters(text[: 5 * LONGEST_NAME])))
    return bool(words & ZERO_OF_READINGS) and not (words & FACE and words <= ZERO_OF_READINGS | FACE | OF_FACE)


def sample_key(sample: str) -> str:
    """Return a key that is equal for spellings that differ in case, spaces, points, hyphens and underscores only.

    A gap between two digits counts: 1-11 is not 11-1.
    """
    key = ""
    for word in NAME.findall(unicodedata.normalize("NFKC", sample).casefold()):
        key += f"-{word}" if key[-1:].isdigit() and word[0].isdigit() else word
    return key
