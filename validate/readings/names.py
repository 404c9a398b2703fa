"""Names of samples and of columns: what their words mean. Nothing is guessed: an unknown word leaves a name open."""

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from validate.readings.numbers import WORDS, plain_letters
from validate.settings import DialUnit, Quantity, Unit

Role = Literal["station", "reading", "repeat", "sample", "other"]
"""Role of a column. "repeat": number of a reading within its station. "sample": name of the sample of the row. "other":
notes, other quantities, or figures calculated from readings."""
ColumnUnit = Unit | DialUnit | Literal["g", "kg"]
MM: dict[ColumnUnit, float] = {
    "mm": 1.0,
    "cm": 10.0,
    "m": 1000.0,
    "µm": 0.001,
    "inch": 25.4,
    "1/10 mm": 0.1,
    "1/100 mm": 0.01,
}
FACTORS = MM | {"g": 1.0, "kg": 1000.0}
UNITS: dict[str, ColumnUnit] = {name: unit for unit, names in WORDS["units"].items() for name in names.split()}
COLUMNS = {kind: frozenset(words.split()) for kind, words in WORDS["columns"].items()}
STATION, REPEAT, VALUE, COUNTER, SAMPLE = (COLUMNS[k] for k in ("station", "repeat", "value", "counter", "sample"))
DOWNWARD, HEIGHT, CALCULATED, FACE = (COLUMNS[k] for k in ("downward", "height", "calculated", "face"))
DEPTH, LEVEL = DOWNWARD | COLUMNS["depth"], HEIGHT | COLUMNS["level"]
OTHER = CALCULATED | COLUMNS["notes"] | COLUMNS["other"]
OF_STATION, OF_READING = (COLUMNS["beside_any"] | COLUMNS[k] for k in ("beside_station", "beside_reading"))
RELATIVE = COLUMNS["relative"]
OF_SAMPLE = SAMPLE | COUNTER | COLUMNS["beside_sample"]

LONGEST_NAME = 200
PART = re.compile(r"[^\W_]+|[^\w\s.-]")
WORD = re.compile(r"[^\W\d_]+|[0-9]+")
UNIT_WORD = "(?:{})".format("|".join(sorted(map(re.escape, (*UNITS, "in")), key=len, reverse=True)))
LENGTH_MM = r"(?:{})(?![^\W\d_])".format("|".join(WORDS["units"]["mm"].split()))
DIAL_UNIT = re.compile(rf"(?<![\w.,/])1\s?/\s?(100?)\s?{LENGTH_MM}|(?<![^\W\d_]){LENGTH_MM}\s?/\s?(100?)(?![\w.,])")
"""Tenths and hundredths of a millimetre, the divisions of dials: 1/10 mm, mm/100."""
INCH = re.compile(r"(?<=[\[(/_])\s*in\s*[\])]?\s*$|\"\s*[\])]?\s*$|\s+in\s*$")
"""The unit "in", in brackets or at the end; elsewhere "in" is a preposition."""
FACTOR = re.compile(rf"[\[(]\s*[0-9][^\])]*{UNIT_WORD}|(?<![\w])10+\s+{UNIT_WORD}")
"""A number that may be a factor of the unit: [10 mm], "depth 10 mm"."""
UNIT_BEHIND_SLASH = re.compile(rf"/\s*(?={UNIT_WORD}\s*[\])]?\s*$)")
HYPHEN = re.compile(r"(?<=[^\W\d_])-(?=[^\W\d_])")
ELIDED = re.compile(r"(?<![^\W_])(?:[dl]|d?all|dell)['\u2019]")
ORDINAL = re.compile(
    rf"(?<![\w.,])#?([0-9]{{1,2}})(?:{'|'.join(COLUMNS['ordinal'])}|[.\u00b0](?![0-9]))(?!\w)|#(?=[0-9])|n\u00b0"
)
OTHER_UNIT = re.compile(r"\[\s*[^\W\d_]{1,4}\.?\s*\]")
REST = re.compile(r"[^\w\s.,:;\[\]()]")
NO_LENGTH = re.compile(rf"[%\u2030\u00b0]|[\[(]\s*[-\u2013\u20131]\s*[\])]|/(?!\s*{UNIT_WORD}\s*[\])]?\s*$)")
"""Mark of a quantity that is no length: a share, an angle, a ratio."""


@dataclass(frozen=True)
class Meaning:
    role: Role
    unit: ColumnUnit | None = None
    quantity: Quantity | None = None  # Direction of a reading; None if the name leaves it open
    number: str | None = None  # Number of a repeat; None if the name has none


@lru_cache(maxsize=4096)
def meaning(name: str) -> Meaning | None:
    """Return the meaning of a column's name, or None if a word or a mark of it is unknown."""
    plain, unit, is_sound = without_unit(name)
    parts = WORD.findall(plain)
    numbers, words = [part for part in parts if part.isdigit()], {part for part in parts if not part.isdigit()}
    if words & SAMPLE and words <= OF_SAMPLE and not (unit or numbers):
        return Meaning("sample") if is_sound else None
    if words & OTHER or (words and words <= COUNTER) or (words & STATION and words & COUNTER):
        return Meaning("other", unit)
    if has_rest(name):
        return None
    if words & FACE:
        words -= RELATIVE
    if words & COLUMNS["axis"] and unit in MM:
        words = words - COLUMNS["axis"] | {"s"}
    if words & SAMPLE and numbers:
        return None
    if words & STATION:
        return Meaning("station", unit) if words <= STATION | OF_STATION and not numbers else None
    if words & FACE:
        # A height over the face is that of the sealant's surface; without a face it may be its thickness.
        words -= COLUMNS["sealant"]
    if (
        not words & (DEPTH | LEVEL | REPEAT | VALUE)
        or not words <= DEPTH | LEVEL | REPEAT | VALUE | COUNTER | OF_READING
    ):
        return None
    # A height that counts downward is a depth; a level below something is ambiguous.
    if words & DEPTH and words & LEVEL and not words & (DEPTH | LEVEL) <= HEIGHT | DOWNWARD:
        return None
    quantity: Quantity | None = "depth" if words & DEPTH else "level" if words & LEVEL else None
    bare = quantity is None and unit is None and not numbers
    counts = bare and (words & COUNTER or not words & VALUE)
    return Meaning("repeat" if counts else "reading", unit, quantity, next(iter(numbers), None))


def without_unit(name: str) -> tuple[str, ColumnUnit | None, bool]:
    """Return a name in plain letters without its unit, the unit, and whether only one unit and no factor is in it."""
    plain = plain_letters(name[: LONGEST_NAME + 1])
    is_sound = len(plain) <= LONGEST_NAME and not any(unicodedata.category(letter) == "No" for letter in name)
    plain = HYPHEN.sub(" ", plain).replace("n\u00b0", "n ")
    plain = ORDINAL.sub(r"\1 ", ELIDED.sub("", plain))
    units = set[ColumnUnit]()
    if (dial := DIAL_UNIT.search(plain)) is not None:
        units.add("1/10 mm" if "10" in dial.groups() else "1/100 mm")
        plain = DIAL_UNIT.sub(" ", plain)
    is_sound = is_sound and FACTOR.search(plain) is None
    plain = UNIT_BEHIND_SLASH.sub(" ", plain) if INCH.search(plain) is None else INCH.sub(" ", plain).rstrip("/ ")
    units |= {"inch"} if plain_letters(name) != plain and INCH.search(plain_letters(name)) else set()
    units |= {UNITS[word] for word in WORD.findall(plain) if word in UNITS}
    plain = WORD.sub(lambda word: " " if word[0] in UNITS else word[0], plain)
    return plain, next(iter(units), None) if len(units) < 2 else None, is_sound and len(units) < 2


def unit_of(text: str) -> ColumnUnit | None:
    """Return the unit of a text that contains only a unit, such as "[mm]"; else None."""
    plain, unit, is_sound = without_unit(f"[{text.strip().strip('[](){}/. ')}]")
    return unit if is_sound and not WORD.search(plain) else None


def is_no_length(name: str) -> bool:
    """Return whether a name says that its numbers are no lengths: [-], %, a degree, a ratio."""
    plain = plain_letters(name[:LONGEST_NAME])
    words, ratio = {*WORD.findall(plain)}, NO_LENGTH.search(DIAL_UNIT.sub(" ", ORDINAL.sub(" ", plain)))
    return ratio is not None or bool(words & RELATIVE and not words & FACE)


def has_rest(name: str) -> bool:
    """Return whether more than letters, brackets and one number remains of a name without its unit."""
    plain, _, is_sound = without_unit(name)
    return (
        not is_sound or len(re.findall("[0-9]+", plain)) > 1 or any(mark.search(plain) for mark in (REST, OTHER_UNIT))
    )


def is_note(name: str) -> bool:
    """Return whether a column has remarks: a number in it may be a reading."""
    return bool({*WORD.findall(plain_letters(name))} & COLUMNS["notes"])


def is_calculated(text: str) -> bool:
    """Return whether the text of a row's first cell marks the row as calculated from others, such as a mean."""
    words = {word for word in WORD.findall(plain_letters(text[:LONGEST_NAME])) if not word.isdigit()}
    return bool(words & CALCULATED) and words <= CALCULATED | OF_READING | VALUE | REPEAT | COUNTER | DEPTH | LEVEL


def sample_key(sample: str) -> str:
    """Return a key that is the same for spellings that differ only in case, spaces, points, hyphens and underscores.

    A gap between two digits counts: 1-11 is not 11-1. Other marks count: P01' is not P01.
    """
    key = ""
    for part in PART.findall(unicodedata.normalize("NFKC", sample).casefold()):
        key += f"-{part}" if key[-1:].isdigit() and part[0].isdigit() else part
    return key
