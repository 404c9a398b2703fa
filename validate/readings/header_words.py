"""Meanings of column names and of rows without readings. All words of labs are in ``words.toml``."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Literal

from validate.readings.text_table import WORDS, is_missing, number, plain_letters
from validate.settings import DialUnit, Quantity, Unit

Role = Literal["station", "mass", "reading", "repeat", "sample", "skipped"]
"""Role of a column. "mass": mass of a liquid. "repeat": number of a reading within its station. "sample": name of the
row's sample. "skipped": notes, other quantities, or figures calculated from readings."""

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
GRAMS: dict[ColumnUnit, float] = {"g": 1.0, "kg": 1000.0}
UNITS: dict[str, ColumnUnit] = {name: unit for unit, names in WORDS["units"].items() for name in names.split()}
INCH = re.compile(r"[\[(/_]\s*in\s*[\])]?\s*$")
"""The unit "in", in brackets or at the end; elsewhere "in" is a preposition."""
UNIT_AT_END = re.compile(r"(?:[\[(/_,]|\s)\s*([^\W\d_]+|\")\s*[\])]?\s*$")
IN_BRACKETS = re.compile(r"[\[(]([^\])]*)[\])]")
BRACKETED = re.compile(r"\[\s*([^\W\d_]{1,12})\s*\]|(?:\(|/\s*)\s*([^\W\d_]{1,12})\s*\)?\s*$")
"""Word in square brackets, or in round ones or behind a slash at the end of a name."""
LONGEST_ABBREVIATION = 3  # Letters of a word in round brackets that is more likely a unit than a remark
UNIT = r"(?:(?:{})(?![^\W\d_])|\")".format("|".join(sorted(map(re.escape, (*UNITS, "in")), key=len, reverse=True)))
LENGTH_MM = r"(?:{})(?![^\W\d_])".format("|".join(WORDS["units"]["mm"].split()))
DIAL_UNIT = re.compile(rf"(?<![\w.,/])1\s?/\s?(100?)\s?{LENGTH_MM}|(?<![^\W\d_]){LENGTH_MM}\s?/\s?(100?)(?![\w.,])")
"""Tenths and hundredths of a millimetre, the divisions of dials: 1/10 mm, mm/100."""
TIMES = r"[*x\u00d7\u00b7]"
PART = r"[0-9]+(?:[.,][0-9]+|\s?[/:\u00f7]\s?[0-9]+)"  # A decimal number, or a fraction
FACTOR = re.compile(
    rf"[\[(]\s*(?P<in_brackets>[0-9]+(?:[.,][0-9]+)?)\s?{TIMES}?\s?{UNIT}"  # [10 mm]
    rf"|(?<![\w.,]){PART}\s?(?:{TIMES}\s?)?{UNIT}"  # 0,1 mm
    rf"|(?<![^\W\d_]){UNIT}\s?(?:[/:\u00f7^]|{TIMES})\s?[0-9]+"  # mm x 10
    r"|[0-9]+\s?\^\s?-?[0-9]*|\u00f7\s?[0-9]*"  # 10^-1, ÷10
    rf"|(?:[/:]|(?<!\w){TIMES})\s?10+(?![0-9])|(?<![0-9.,])0[.,][0-9]+"  # /10, x 100, 0.1
    rf"|%\s?(?:of|von|de|di)?\s?{UNIT}"
)
"""A number next to a unit that is, or may be, a factor of the unit: [10 mm], mm x 10. A bare 10 before mm is matched by
``NUMBER_AT_UNIT``."""
NUMBER_AT_UNIT = re.compile(rf"(?<![0-9.,])([0-9]+)[\s_]?{UNIT}")
SCALED = re.compile(rf"[0-9][0-9.,]*\s?{TIMES}?\s?{UNIT}|{UNIT}\s?[/{TIMES[1:]}\s?[0-9]+")
LONGEST_NAME = 200  # Limit on the letters of a name; in longer texts a search for a unit takes long
WORD = re.compile(r"[^\W\d_]+|[0-9]+")
NAME = re.compile(r"[^\W_]+")
COLUMNS = {role: frozenset(words.split()) for role, words in WORDS["columns"].items()}
STATION, REPEAT, VALUE, COUNTER = (COLUMNS[role] for role in ("station", "repeat", "value", "counter"))
AXIS, COORDINATE, ALONG = (COLUMNS[role] for role in ("axis", "coordinate", "along"))
DOWNWARD, HEIGHT, SAMPLE, CALCULATED = (COLUMNS[role] for role in ("downward", "height", "sample", "calculated"))
SKIPPED = CALCULATED | COLUMNS["notes"] | COLUMNS["other"]
DEPTH, LEVEL = DOWNWARD | COLUMNS["depth"], HEIGHT | COLUMNS["level"]
PLACE_NUMBER = COLUMNS["place_number"]
PLACE_WORDS = STATION | PLACE_NUMBER
OF_UNITS, OTHER_UNITS = COLUMNS["unit"], frozenset(plain_letters(WORDS["other_units"]["words"]).split())
MASS, OF_SAMPLE = COLUMNS["mass"], COUNTER | COLUMNS["beside_sample"]
OF_STATION, OF_READING = (COLUMNS["beside_any"] | COLUMNS[key] for key in ("beside_station", "beside_reading"))
ALL_WORDS = frozenset[str]().union(*COLUMNS.values())
TOWARD = re.compile(r"(?<![^\W_])(?:{toward})[\W_]+(?:(?P<up>{up})|{down})(?![^\W_])".format(**WORDS["directions"]))
"""A direction in several words, such as "nach unten"."""
ZERO_OF_READINGS, FACE, OF_FACTOR = (frozenset(WORDS["remarks"][key].split()) for key in ("zero", "face", "factor"))
NUMBERED_SAMPLE = re.compile(rf"\b(?:{'|'.join(SAMPLE)})\W*(?:(?:{'|'.join(COUNTER)})\b\W*)?[^\W\d_]{{0,3}}\W?[0-9]")
CRACK_DEPTH = re.compile(WORDS["crack_depth"]["sure"].replace("\n", ""))
CRACK, SEALANT = (frozenset(WORDS["crack_depth"][key].split()) for key in ("crack", "sealant"))
ORDINAL = re.compile(
    rf"(?<![\w.,])#?([0-9]{{1,2}})(?:{'|'.join(WORDS['columns']['ordinal'].split())}|[.\u00b0](?![0-9]))(?!\w)"
)
NEGATED = re.compile(r"\s*[-\u2212\u2013]\s*[^\W\d_]{3}")  # -depth: its direction is ambiguous
OF_FACE = COLUMNS["beside_any"] | SAMPLE
CODE = re.compile(r"[^\W\d_]\S*\d\S*|\d{1,4}[./-]\d{1,2}[./-](\d{2,4})?")  # S14, or a date
DASH = re.compile(r"^[-\u2013\u2014:]\s+")
PREPOSITIONS = ("in", "um")  # Also units
TITLE_PARTS = re.compile(r"[,;:()|]|\s[-\u2013\u2014]\s(?!=)")
NEGATIVE_IS = re.compile(r"(?:[-\u2212\u2013]|\bminus)\s*(?:=|is\b|ist\b)", re.IGNORECASE)
"""Explanation of the minus sign, which may turn the direction of a name: "level (- = above)"."""
MINUSES = ("-", "\u2212", "\u2013", "minus", "negativ", "negatif", "negative", "negativo")
SIGN_OF_TITLE = re.compile(
    r"(?P<sign>[-+\u2212\u2013]|plus|minus)\s*(?:=|is|ist|means|heisst)\s*(?P<words>.+)", re.IGNORECASE
)
"""Part of a title that explains a sign, such as "+ = proud"."""
COMMENT = re.compile(r"(#(?!(?:[A-Z\u00c0-\u00dd/0\u00a1]+[!?]|N/?[AVD])$)|//|%%)")
"""Beginning of a comment; #DIV/0! is an error of a spreadsheet."""


@dataclass(frozen=True)
class ColumnMeaning:
    role: Role
    unit: ColumnUnit | None = None
    quantity: Quantity | None = None  # Direction of a reading; None if the name leaves it open
    number: str | None = None  # Number of a repeat; None if the name has none
    factor: str | None = None  # Possible factor of the unit, as "0,1 mm"; None without one


@lru_cache(maxsize=4096)
def meaning(name: str) -> ColumnMeaning | None:
    """Return the meaning of a column's name, or None if any of its words is unknown: nothing is guessed."""
    if len(name) > LONGEST_NAME:
        return None
    if NEGATED.match(name) or NEGATIVE_IS.search(name):
        return None
    plain = TOWARD.sub(lambda toward: "upward" if toward["up"] else "downward", _plain(name))
    plain = ORDINAL.sub(r"\1 ", plain)
    dial = _dial_unit(plain)
    plain = DIAL_UNIT.sub(" ", plain)
    parts = WORD.findall(plain)
    numbers = [word for word in parts if word.isdigit()]
    units: set[ColumnUnit] = {UNITS[word] for word in parts if word in UNITS}
    if dial is not None:
        units.add(dial)
    words = {word for word in parts if not word.isdigit() and word not in UNITS}
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
    factor = factor_in(name)
    if words & MASS:
        return ColumnMeaning("mass", unit, factor=factor or _number_at_unit(plain))
    if not numbers and unit is not None and words & PLACE_NUMBER and words <= PLACE_NUMBER | OF_STATION:
        words = words - PLACE_NUMBER | {"s"}
    if _names_axis(words, unit):
        words = words - AXIS - COORDINATE | {"s"}
    if words & STATION:
        is_station = words <= STATION | OF_STATION and (not numbers or factor or _number_at_unit(plain))
        return ColumnMeaning("station", unit, factor=factor or _number_at_unit(plain)) if is_station else None
    if words & FACE:
        # A height over the face is that of the sealant's surface; without a face it may be its thickness.
        words -= SEALANT
    if (
        not words & (DEPTH | LEVEL | REPEAT | VALUE)
        or not words <= DEPTH | LEVEL | REPEAT | VALUE | COUNTER | OF_READING
    ):
        return None
    ways = words & (DEPTH | LEVEL)
    # A height that counts downward is a depth; a level below something is ambiguous.
    if words & DEPTH and words & LEVEL and not ways <= HEIGHT | DOWNWARD:
        return None
    quantity: Quantity | None = "depth" if words & DEPTH else "level" if words & LEVEL else None
    bare = quantity is None and unit is None and not numbers
    counts = bare and (words & COUNTER or not words & VALUE)
    return ColumnMeaning("repeat" if counts else "reading", unit, quantity, "-".join(numbers) or None, factor)


def _names_axis(words: set[str], unit: ColumnUnit | None) -> bool:
    """Return whether words name places otherwise than by a word for them: x / mm, X_Value, along the crack."""
    if words & AXIS:
        return words <= AXIS | COORDINATE | OF_STATION and (bool(words & COORDINATE) or unit in MM)
    return bool(words & ALONG and words & CRACK) and words <= OF_STATION


def repeat_number(text: str) -> int | None:
    """Return the number of a repeat in a cell of a header, such as "2", "2." or "2nd"; None for other texts."""
    bare = ORDINAL.sub(r"\1 ", _plain(text)).strip(" #")
    return int(bare) if bare.isdecimal() and len(bare) <= LONGEST_ABBREVIATION else None


def names_sample(name: str) -> bool:
    """Return whether a column's name has a word for a sample and its number, such as "Probe 1 Tiefe"."""
    return NUMBERED_SAMPLE.search(plain_letters(name[:LONGEST_NAME])) is not None


def crack_depth(name: str) -> Literal["sure", "doubtful"] | None:
    """Return whether the words of a name mean the depth of the crack itself; None if they do not."""
    parts = [word for word in WORD.findall(_plain(name[:LONGEST_NAME])) if word not in UNITS and word != "in"]
    words = [word for word in parts if not word.isdigit()]
    if SEALANT & set(words):
        return None
    if CRACK_DEPTH.fullmatch(" ".join(parts)):
        return "sure"
    is_named = CRACK_DEPTH.search(" ".join(words)) is not None
    return "doubtful" if is_named or (DEPTH & set(words) and CRACK & set(words)) else None


def _plain(name: str) -> str:
    """Return a name in plain letters, with Unicode fractions written out as 1/10."""
    return plain_letters(name).replace("\u2044", "/")


def _dial_unit(plain: str) -> ColumnUnit | None:
    """Return tenths or hundredths of a millimetre if plain letters name them, else None."""
    match = DIAL_UNIT.search(plain)
    return None if match is None else "1/10 mm" if "10" in match.groups() else "1/100 mm"


def factor_in(name: str) -> str | None:
    """Return the part of a column name that may be a factor of its unit, such as "0,1 mm" or "x10"; else None.

    Dial units such as 1/10 mm do not count.
    """
    match = FACTOR.search(DIAL_UNIT.sub(" ", _plain(name[:LONGEST_NAME])))
    return None if match is None else match[0].strip("[( ")


def _number_at_unit(plain: str) -> str | None:
    """Return the number before a unit, or None. Names of stations and masses may contain no other number."""
    match = NUMBER_AT_UNIT.search(plain)
    return None if match is None else match[0]


def ten_at_unit(name: str) -> int | None:
    """Return the number of two to four digits before a unit in a name, or None.

    It may be a factor or count a repeat.
    """
    match = NUMBER_AT_UNIT.search(DIAL_UNIT.sub(" ", _plain(name[:LONGEST_NAME])))
    return int(match[1]) if match is not None and len(match[1]) in (2, 3, 4) else None


def unit_of(text: str) -> ColumnUnit | None:
    """Return the unit of a cell that contains only a unit, such as "[mm]"; else None."""
    if len(text) > LONGEST_NAME:
        return None
    word = _plain(text).strip("[](){}/. ").removeprefix("in ")
    if DIAL_UNIT.fullmatch(word):
        return _dial_unit(word)
    return "inch" if word in ("in", '"') else UNITS.get(word)


def is_scaled_unit(text: str) -> bool:
    """Return whether a cell contains a unit with an unsupported factor, such as "0,1 mm"."""
    return len(text) <= LONGEST_NAME and SCALED.fullmatch(_plain(text).strip("[](){}/. ")) is not None


def names_unit(name: str) -> bool:
    """Return whether a name announces a unit below it or in the next column."""
    return bool(OF_UNITS & set(WORD.findall(plain_letters(name[:LONGEST_NAME]))))


def unknown_unit(name: str) -> str | None:
    """Return the word in brackets, or behind a slash, that must be a unit but is none that is read; else None."""
    texts = [(one or other, bool(one)) for one, other in BRACKETED.findall(name[-LONGEST_NAME:])]
    for text, is_square in texts:
        word = plain_letters(text).strip()
        if word in OTHER_UNITS or ((is_square or len(word) <= LONGEST_ABBREVIATION) and word not in ALL_WORDS):
            return None if unit_of(text) is not None else text.strip()
    return None


def names_other_unit(name: str) -> bool:
    """Return whether a name has a unit of length that is not read, such as [mil], which no answer turns into mm."""
    return plain_letters(unknown_unit(name) or "") in OTHER_UNITS


def units_named(text: str) -> set[ColumnUnit | None]:
    """Return the units that a remark names, such as "Einheit: Zoll" or "all values in cm".

    An unsupported unit is None.
    """
    plain = _plain(text[:LONGEST_NAME])
    words = set(WORD.findall(plain))
    if not words & (OF_UNITS | VALUE):
        return set()
    if (dial := _dial_unit(plain)) is not None:
        return {dial}
    if words & OF_UNITS and factor_in(text) is not None:
        return {None}
    parts = [part for part in re.split(r"[\s:;=,()\[\]]+", plain) if part]
    # Without a word for "unit" before them, M and G are initials, and "in" and "um" are prepositions.
    last = parts[-1:] if words & OF_UNITS else []
    candidates = [part for part in parts if len(part.strip(".")) > 1 and part not in PREPOSITIONS] + last
    if not words & OF_UNITS:
        # A unit after a number belongs to the number.
        candidates = [
            part for before, part in pairwise(["", *parts]) if part in candidates and not before[-1:].isdigit()
        ]
    return {unit for part in candidates if (unit := unit_of(part)) is not None}


def unit_in(name: str) -> ColumnUnit | None:
    """Return the unit in brackets or at the end of a name, or None. Other words of the name may be unknown."""
    if (dial := _dial_unit(_plain(name[-LONGEST_NAME:]))) is not None:
        return dial
    texts = [*IN_BRACKETS.findall(name[-LONGEST_NAME:]), *UNIT_AT_END.findall(name[-LONGEST_NAME:])]
    return next((unit for text in texts if (unit := unit_of(text)) is not None), None)


def quantity_in(name: str) -> Quantity | None:
    """Return the direction that a name states, even if its other words are unknown; None if its words contradict."""
    words = set(WORD.findall(plain_letters(name[:LONGEST_NAME])))
    ways = bool(words & DEPTH), bool(words & LEVEL)
    return "depth" if ways == (True, False) else "level" if ways == (False, True) else None


def is_comment(text: str) -> bool:
    return COMMENT.match(text) is not None


def is_calculated(text: str) -> bool:
    """Return whether the text of a row's first cell marks the row as calculated from others, such as a mean."""
    words = {word for word in WORD.findall(plain_letters(text[:LONGEST_NAME])) if not word.isdigit()}
    return bool(words & CALCULATED) and words <= CALCULATED | OF_READING | VALUE | REPEAT | COUNTER | DEPTH | LEVEL


def is_particular(text: str) -> bool:
    """Return whether a text is a particular of the sheet, not a name: "Probe S11", "Prüfer: A. Meier"."""
    first, *rest = NAME.findall(plain_letters(text[:LONGEST_NAME])) or [""]
    others = {word for word in rest if not word.isdigit() and word not in UNITS}
    return first in SAMPLE | COLUMNS["notes"] and bool(others - ALL_WORDS)


def name_in_titles(titles: Iterable[str]) -> str | None:
    """Return the name of readings that one of a note's titles is, such as "Tiefe mm" of "S14 Tiefe mm"; else None.

    Words for the sample, which have a digit, and dates are left out. A number alone may be the depth of the crack. If
    no title is a name, but the titles give one unit of readings, the name has only this unit.
    """
    every = list(titles)
    units = {unit for title in every for unit in _units_of_readings(title)}
    titles = [title for title in every if factor_in(title) is None]
    words = (" ".join(word for word in title.split() if not CODE.fullmatch(word)) for title in titles)
    # A dash behind the sample's code is no minus.
    bare = {
        _unmistakable(DASH.sub("", each) if CODE.match(title) else each)
        for each, title in zip(words, titles, strict=True)
    }
    meanings = {name: what for name in bare if (what := meaning(name)) is not None}
    names = [name for name, what in meanings.items() if what == ColumnMeaning("reading", what.unit, what.quantity)]
    if len(names) == 1:
        return names[0]
    return f"reading [{unit}]" if len(units) == 1 and (unit := next(iter(units))) is not None else None


def _units_of_readings(title: str) -> set[ColumnUnit | None]:
    """Return the units that a title gives for readings, such as mm of "depth in mm, 3 times".

    None is a unit with a number, which may be a factor or the depth of the crack.
    """
    units = set[ColumnUnit | None]()
    has_factor = factor_in(title) is not None
    title = " ".join(word for word in title[:LONGEST_NAME].split() if not CODE.fullmatch(word.rstrip(":,")))
    for part in re.split(r"[,;:|]|\s[-\u2013\u2014]\s", title):
        words = set(WORD.findall(plain_letters(part)))
        of_readings = words & (DEPTH | LEVEL | VALUE | REPEAT) and not words & STATION
        if (of_readings or unit_of(part.strip()) is not None) and crack_depth(part) is None:
            unit, has_number = unit_in(part), _number_at_unit(_plain(part)) is not None
            units |= set() if unit is None else {None if has_number or has_factor else unit}
    return units


def _unmistakable(title: str) -> str:
    """Return a title without a part that is beside the point, such as "mobile" in "Tiefe ab Oberkante in mm, mobile".

    A part of unknown words may be left out only if the rest names a direction and the face from which it counts. A part
    such as "+ = proud" must agree with that direction.
    """
    title = title.strip("#*_:,. ")
    parts = [part.strip(" .") for part in TITLE_PARTS.split(title[:LONGEST_NAME]) if part.strip(" .")]
    signs = [(part, match) for part in parts if (match := SIGN_OF_TITLE.fullmatch(part)) is not None]
    rest = [part for part in parts if part not in {sign for sign, _ in signs} and not _is_beside_the_point(part)]
    name = ", ".join(rest)
    what = meaning(name)
    if len(rest) == len(parts) or what is None or what.quantity is None or what.number or what.factor:
        return title
    if len(rest) + len(signs) < len(parts) and not set(WORD.findall(plain_letters(name))) & FACE:
        return title
    for _, match in signs:
        way = quantity_in(match["words"])
        is_plus = match["sign"] not in MINUSES
        if way is None or (way == what.quantity) != is_plus:
            return ""
    return name


def _is_beside_the_point(part: str) -> bool:
    """Return whether a part of a title has only unknown words."""
    words = set(WORD.findall(plain_letters(part)))
    others = ALL_WORDS | UNITS.keys() | OTHER_UNITS | ZERO_OF_READINGS | FACE | OF_FACTOR | {"in"}
    return all(word.isalpha() for word in words) and not words & others


def is_number(text: str) -> bool:
    return number(text, None) is not None


def holds_no_number(text: str) -> bool:
    """Return whether a text contains no digit, or marks a missing number."""
    return is_missing(text) or not any(letter.isdigit() for letter in text)


def sample_key(sample: str) -> str:
    """Return a key that is the same for spellings that differ only in case, spaces, points, hyphens and underscores.

    A gap between two digits counts: 1-11 is not 11-1.
    """
    key = ""
    for word in NAME.findall(unicodedata.normalize("NFKC", sample).casefold()):
        key += f"-{word}" if key[-1:].isdigit() and word[0].isdigit() else word
    return key
