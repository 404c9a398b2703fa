"""Interpret words and numbers of labs: names of columns and samples, decimal marks, and words for a missing reading.

Nothing is guessed: an unknown word leaves the meaning of a name open. The words are in ``words.toml``.
"""

import math
import re
import tomllib
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from importlib.resources import files as resources
from itertools import pairwise
from typing import NamedTuple

from validate.settings import Decimal, Quantity

WORDS = tomllib.loads(resources("validate").joinpath("readings", "words.toml").read_text(encoding="utf-8"))
"""Words of labs in all languages."""
MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "µm": 0.001, "inch": 25.4}
UNITS = {name: unit for unit, names in WORDS["units"].items() for name in names.split()}
MISSING = frozenset(WORDS["missing"]["words"].split())
COLUMNS = {kind: frozenset(words.split()) for kind, words in WORDS["columns"].items()}
STATION, REPEAT, VALUE, COUNTER, SAMPLE = (COLUMNS[k] for k in ("station", "repeat", "value", "counter", "sample"))
DOWNWARD, HEIGHT, CALCULATED, FACE = (COLUMNS[k] for k in ("downward", "height", "calculated", "face"))
UPWARD, BELOW = COLUMNS["level"], DOWNWARD | COLUMNS["below"]
DEPTH, LEVEL = BELOW | COLUMNS["depth"], HEIGHT | UPWARD
OTHER = CALCULATED | COLUMNS["notes"] | COLUMNS["other"]
OF_STATION, OF_READING = (COLUMNS["beside_any"] | COLUMNS[k] for k in ("beside_station", "beside_reading"))
OF_READING |= FACE
RELATIVE, SURFACE = COLUMNS["relative"], COLUMNS["surface"]
AXIS, SEALANT = COLUMNS["axis"], COLUMNS["sealant"]
OF_SAMPLE = SAMPLE | COUNTER | COLUMNS["beside_sample"]
READING = DEPTH | LEVEL | REPEAT | VALUE
KNOWN = READING | STATION | OF_STATION | OF_READING | COUNTER | SEALANT | RELATIVE | AXIS
SHORTEST_END = 5  # Smallest length of a known word at the end of a compound
STOPS = frozenset(WORDS["beside"]["stops"].split())

LONGEST_NAME = 200
PART = re.compile(r"[^\W_]+|[^\w\s.-]")
WORD = re.compile(r"[^\W\d_]+|[0-9]+")
UNIT_WORD = "(?:{})".format("|".join(sorted(map(re.escape, (*UNITS, "in")), key=len, reverse=True)))
INCH = re.compile(r"(?<=[\[(/_])\s*in\s*[\])]?\s*$|\"\s*[\])]?\s*$|\s+in\s*$")
"""The unit "in", in brackets or at the end of a name. Elsewhere "in" is a preposition."""
QUANTITY = re.compile(rf"[0-9]\s*{UNIT_WORD}(?!\w)")
FACTOR = re.compile(rf"[\[(]\s*[0-9][^\])]*{UNIT_WORD}|(?<![\w])10+\s+{UNIT_WORD}")
"""A number that may be a factor of the unit, as in [10 mm] or "depth 10 mm"."""
UNIT_BEHIND_SLASH = re.compile(rf"/\s*(?={UNIT_WORD}\s*[\])]?\s*$)")
CAMEL = re.compile(r"(?<=[^\W\dA-Z_]{2})(?=[A-Z][^\W\dA-Z_])")
HYPHEN = re.compile(r"(?<=[^\W\d_])-(?=[^\W\d_])|(?<=\s)[-\u2013\u2014](?=\s)|[#\u00b0](?=\s*[0-9])|(?<=\bn)\u00b0")
"""A hyphen, a dash between words, or the sign of a number."""
ORDINAL = re.compile(r"(?<!\w)([0-9]{1,2})(?:st|nd|rd|th|e|er|re|ere|eme|ste|de|a|o|\u00b0)(?!\w)")
NUMERALS = [words.split() for words in WORDS["repeats"].values()]
"""Words that count repeats, from 1."""
NEGATIVE = re.compile(rf"negat|minus|\(\s*-\s*\)|-\s*(?:{'|'.join(sorted(BELOW))})(?!\w)")
"""A legend of negative numbers, such as "- below"."""
ELIDED = re.compile(r"(?<![^\W_])(?:[dl]|d?all|dell)['\u2019]")
LEGEND = re.compile(r"(?:0\s*=|\+\s*=?)\s*[^\W\d_][^,;()\[\]=+]*|[^\W\d_]+\s*\+")
"""Part of a legend such as "(0 = sample face, + up)"."""
REST = re.compile(r"[^\w\s.,:;\[\]()]|\[\s*[^\W\d_]{1,4}\.?\s*\]|\[\s*1\s*\]|\bx\s?\d|\d\s?x\b")
"""A special character, a unit in brackets that is unknown or only a 1, or a factor."""
UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue"})
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
AMBIGUOUS = re.compile(r"[+-]?[1-9][0-9]{0,2}([.,])[0-9]{3}")
"""A number such as 1.250, which is either a decimal or 1250 with a thousands separator. 0.125 can only be a decimal."""
MINUS = str.maketrans(dict.fromkeys("\u2212\u2013", "-"))
"""The typographic minus, and the dash that word processors put in place of a hyphen."""
OTHER_MARKS: dict[Decimal | None, str] = {"point": ",", "comma": "."}
"""Mark that cannot occur in a number, by the number's decimal mark."""


class Role(Enum):
    """Role of a column."""

    STATION = "station"
    READING = "reading"
    REPEAT = "repeat"  # Number of a reading within its station
    SAMPLE = "sample"  # Name of the sample of the row
    NEW = "new"  # Only unknown words
    OTHER = "other"  # Notes, figures calculated from readings, and all that is not used


@dataclass(frozen=True)
class Meaning:
    role: Role
    unit: str | None = None
    quantity: Quantity | None = None  # Direction of a reading. None if the name leaves it open.
    number: str | None = None  # Number of a repeat. None if the name has no number.
    is_whole: bool = True  # False if the name has unknown words


class Name(NamedTuple):
    """The parts of a column's name."""

    text: str  # Name in plain letters, without its unit
    unit: str | None
    is_sound: bool  # False if it has several units, or a factor, or is too long

    @property
    def has_rest(self) -> bool:
        """True if the text has more than words, brackets and a number, or is relative, such as "rel. depth"."""
        words = {*WORD.findall(self.text)}
        is_more = not self.is_sound or len(re.findall("[0-9]+", self.text)) > 1 or REST.search(self.text)
        return bool(is_more or (words & RELATIVE and not words & FACE))


@lru_cache(maxsize=4096)
def parsed(name: str) -> Name:
    plain = plain_letters(CAMEL.sub(" ", name[: LONGEST_NAME + 1]))
    is_sound = len(plain) <= LONGEST_NAME and not any(unicodedata.category(letter) == "No" for letter in name)
    plain = ELIDED.sub("", ORDINAL.sub(r"\1 ", HYPHEN.sub(" ", plain)))
    plain = LEGEND.sub(_plain_legend, plain)
    units = set[str]()
    is_sound = is_sound and FACTOR.search(plain) is None
    if INCH.search(plain) is None:
        plain = UNIT_BEHIND_SLASH.sub(" ", plain)
    else:
        units.add("inch")
        plain = INCH.sub(" ", plain).rstrip("/ ")
    units |= {UNITS[word] for word in WORD.findall(plain) if word in UNITS}
    plain = WORD.sub(lambda word: " " if word[0] in UNITS else word[0], plain)
    return Name(plain, next(iter(units)) if len(units) == 1 else None, is_sound and len(units) < 2)


def _plain_legend(part: re.Match[str]) -> str:
    """Return the words of a legend without its zero or sign if they are the face or upward, or else the legend."""
    words = {*WORD.findall(part[0])} - {"0"}
    is_known = words & (FACE if "0" in part[0] else UPWARD) and words <= FACE | UPWARD | OF_READING | SAMPLE
    return f" {' '.join(words - SAMPLE)} " if is_known else part[0]


def unnumbered(name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the words of a column's name without its unit, and the numbers of repeats in it."""
    parts = WORD.findall(parsed(name).text)
    numbers, words = [part for part in parts if part.isdigit()], [part for part in parts if not part.isdigit()]
    # A letter counts repeats only at the end of a name, and not in "from end A".
    counting = [
        word for word in words if not numbers and STATION.isdisjoint(words) and (len(word) > 2 or word == words[-1])
    ]
    numerals = {word: f"{count}" for count, alike in enumerate(NUMERALS, start=1) for word in counting if word in alike}
    return tuple(word for word in words if word not in numerals), (*numbers, *numerals.values())


@lru_cache(maxsize=4096)
def meaning(name: str) -> Meaning | None:
    """Return the meaning of a column's name. Returns None if the name is ambiguous, or has a mark."""
    text, unit, is_sound = in_parts = parsed(name)
    in_order, numbers = unnumbered(name)
    words, understood, number = {*in_order}, {*map(_known, in_order)}, next(iter(numbers), None)
    if words & SAMPLE and words <= OF_SAMPLE and not (unit or numbers):
        return Meaning(Role.SAMPLE) if is_sound else None
    if words & OTHER or (words and words <= COUNTER) or (words & STATION and words & COUNTER):
        return Meaning(Role.OTHER, unit)
    # A number behind the sample's name belongs to it, as in "depth of sample 1".
    is_numbered = any(name in SAMPLE and behind.isdigit() for name, behind in pairwise(WORD.findall(text)))
    is_of_crack = understood & DEPTH and understood & COLUMNS["crack"] and not understood & (FACE | SEALANT)
    if in_parts.has_rest or is_numbered or is_of_crack or not words:
        return None
    if not understood & (READING | STATION | SAMPLE | AXIS):
        return Meaning(Role.NEW, unit, None, number, False)
    # A distance below the face is a reading.
    if not understood & (DEPTH | LEVEL):
        if understood & STATION or (understood & AXIS and (unit in MM or understood & OF_STATION)):
            return None if numbers else Meaning(Role.STATION, unit, is_whole=words <= STATION | OF_STATION | AXIS)
        if not understood & READING:
            return None
    # A height that counts downward is a depth; a level below something is ambiguous.
    if understood & DEPTH and understood & LEVEL and not understood & (DEPTH | LEVEL) <= HEIGHT | DOWNWARD:
        return None
    quantity = "depth" if understood & DEPTH else "level" if understood & LEVEL else None
    counts = not (quantity or unit or numbers) and (understood & COUNTER or not understood & VALUE)
    # A height over the face is that of the sealant's surface; without a face it may be its thickness.
    beside = OF_READING | (RELATIVE | SEALANT if words & (FACE | SURFACE) else set())
    return Meaning(Role.REPEAT if counts else Role.READING, unit, quantity, number, words <= READING | COUNTER | beside)


def may_change(name: str) -> bool:
    """Return whether a column's name has a mark, or an unknown word, that may change readings."""
    return parsed(name).has_rest or any(word[:5] in STOPS and not _known(word) for word in unnumbered(name)[0])


def _known(word: str) -> str:
    """Return a known word, or the known word at the end of a compound such as "Einsinktiefe". Returns "" for others."""
    if word in KNOWN:
        return word
    return max((end for end in KNOWN if len(end) >= SHORTEST_END and word.endswith(end)), key=len, default="")


def stated(text: str) -> tuple[set[str], set[Quantity]]:
    """Return the units and the direction of readings that a text above or below a table states.

    An instrument has a name, not a direction, and a length such as "crack depth 15 mm" is no statement.
    """
    plain = plain_letters(text)
    lengths, without = QUANTITY.search(plain), QUANTITY.sub(" ", plain)
    words = {*WORD.findall(parsed(without).text)}
    if words & COLUMNS["instrument"]:
        return set(), set()
    units = {UNITS[word] for word in WORD.findall(without) if word in UNITS and word not in "um"}
    is_negative, down, up = NEGATIVE.search(plain), words & DEPTH, words & LEVEL
    # What a legend says of negative numbers tells the direction of the others.
    if is_negative:
        down, up = down - BELOW, up | (down & BELOW)
    is_depth = bool(down & COLUMNS["depth"] or (down and not up))
    if lengths or not (down or up) or (is_depth and (is_negative or up & HEIGHT)) or (down and up & HEIGHT):
        return units, set()
    return units, {"depth" if is_depth else "level"}


def unit_of(text: str) -> str | None:
    """Return the unit of a text that contains only a unit, such as "[mm]". Returns None for any other text."""
    plain, unit, is_sound = parsed(f"[{text.strip().strip('[](){}/. ')}]")
    return unit if is_sound and not WORD.search(plain) else None


def is_note(name: str) -> bool:
    """Return whether a column has remarks, in which a number may be a reading."""
    return bool({*WORD.findall(plain_letters(name))} & COLUMNS["notes"])


def is_calculated(text: str) -> bool:
    """Return whether the text in a row's first cell marks the row as calculated from others, for example as a mean."""
    words = {word for word in WORD.findall(plain_letters(text[:LONGEST_NAME])) if not word.isdigit()}
    return bool(words & CALCULATED) and words <= CALCULATED | OF_READING | READING | COUNTER


def sample_key(sample: str) -> str:
    """Return a key that ignores case, spaces, points, hyphens and underscores in the name of a sample.

    A gap between two digits counts: 1-11 is not 11-1. Other marks count too: P01' is not P01.
    """
    key = ""
    for part in PART.findall(unicodedata.normalize("NFKC", sample).casefold()):
        key += f"-{part}" if key[-1:].isdigit() and part[0].isdigit() else part
    return key


@lru_cache(maxsize=50_000)
def plain_letters(text: str) -> str:
    """Return the text in lower case, with umlauts spelt out (ä is ae) and other accents removed (é is e, ñ is n)."""
    folded = unicodedata.normalize("NFKC", text).casefold().translate(UMLAUTS)
    return "".join(letter for letter in unicodedata.normalize("NFD", folded) if unicodedata.category(letter) != "Mn")


def is_missing(text: str) -> bool:
    """Return whether a cell is blank or has a word for a missing reading."""
    return not text or "".join(plain_letters(text).split()) in MISSING


def is_ambiguous(text: str) -> bool:
    """Return True if the comma or point in a number may be either a decimal mark or a thousands separator."""
    return AMBIGUOUS.fullmatch(text.translate(MINUS)) is not None


def common_mark(texts: Iterable[str], separator: str | None) -> Decimal | None:
    """Return the decimal mark of a file's numbers. Returns None if the numbers do not decide it.

    If commas separate fields, the decimal mark cannot be a comma.
    """
    texts = list(texts)
    numbers = [text for text in texts if NUMBER.fullmatch(text.translate(MINUS)) and not is_ambiguous(text)]
    points, commas = (sum(mark in text for text in numbers) for mark in ".,")
    if points or commas:
        return "comma" if commas > points else "point"
    if separator == "," and not any("," in text for text in texts):
        return "point"
    return None


def number(text: str, mark: Decimal | None = None) -> float | None:
    """Return a finite number with the decimal ``mark``, or with either mark if it is None.

    Returns None for other texts.
    """
    text = text.translate(MINUS)
    if not NUMBER.fullmatch(text) or OTHER_MARKS.get(mark, " ") in text:
        return None
    value = float(text.replace(",", "."))
    return value if math.isfinite(value) else None
