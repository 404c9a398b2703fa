"""Read the words and values of notes as settings. A word is one of the word list, or a key of a trial."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from difflib import get_close_matches
from functools import cache
from typing import Any

from sealtwin.core.settings import dotted_names
from sealtwin.trial.trial_file import Trial
from validate.readings.text_table import WORDS, is_ambiguous, number, plain_letters
from validate.settings import OF_THE_SHEET, SIGNS, Columns

NAME = "name"
DATA, DATE, OPERATOR = "data", "date", "operator"
OWN = frozenset({DATA, DATE, OPERATOR})
"""Keys that only notes have: data is the origin of photo and readings; date and operator go into the catalogue."""
IGNORED = "ignore"  # Value in lab.toml of a word that is no setting
OF_READINGS = ("readings.", "gate.")  # Prefixes of keys that only samples with readings need
COLUMNS = "readings.columns"  # Table inside another table
MESH = "mesh"  # Samples of a lab are photos; 'sealtwin import-mesh' reads a mesh
SCALE, DEPTH = "photo.mm_per_px", "crack.depth_mm"
ALIKE = 0.8  # Similarity from which a word may be another word, misspelt
ALTERNATIVES = (
    (
        {SCALE, "photo.scale_is"},
        {"photo.ruler_px", "photo.ruler_mm"},
        {"photo.markers", "photo.face_mm", "photo.face_corners_px"},
    ),
    ({"fluid.U", "fluid.D_cm"}, {"fluid.viscosity_pa_s"}),
)
"""Sets of settings that replace each other. If a sample gives a setting of one set, the folder's defaults for the other
sets are dropped."""

CALLED: dict[str, Any] = WORDS["notes"]
UNITS: dict[str, dict[str, float]] = CALLED["units"]
"""Factors that convert a number to the unit at the end of a setting's name. Keys: this unit, then the number's unit."""
OF_SETTINGS = ("mm_per_px", "mm_s", "pa_s", "kg_m3", "pa")  # Units that only settings have
PER = frozenset(CALLED["per"].split())
NEUTRAL = frozenset(CALLED["sentences"]["neutral"].split())  # Words that do not change a number, as "ca."
ABOUT = "~≈"
NOTHING_BUT_WORDS = re.compile(r"[^\w/]+|_")
NUMBER = re.compile(r"([-+\u2212]?\d[\d.,' ]*(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)
WHOLE = re.compile(r"[-+]?\d+")
TIMES = re.compile(r"\s*[x\u00d7*]\s*", re.IGNORECASE)
LIST_MARKS = re.compile(r"[\[\]\"',;]")
PIXELS = re.compile(r"-?\d+(?:\.\d+)?")
GERMAN_DATE = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")


def normal(text: str) -> str:
    """Return a text without case, accents, hyphens and double blanks, so that spellings can be compared."""
    return " ".join(NOTHING_BUT_WORDS.sub(" ", plain_letters(text)).split())


def _split(words: str) -> list[str]:
    return [word.strip() for word in words.split(",")]


@dataclass(frozen=True)
class WordMeaning:
    """Setting that a word in a lab's note means."""

    key: str  # A setting of the trial, dotted, or one of a note's own
    own: bool = False  # True if the word is a key of a trial, with a value in TOML or a spreadsheet's form

    @property
    def choices(self) -> dict[str, list[str]]:
        """A lab's words for each value of a setting that is a choice of words; empty for any other setting."""
        return {value: _split(words) for value, words in CALLED["choices"].get(self.key, {}).items()}

    @property
    def unit(self) -> str:
        """Unit at the end of the setting's name, a key of ``UNITS``; "" if the name has no unit."""
        return max((unit for unit in UNITS if re.search(f"[._]{unit}$", self.key)), key=len, default="")


BY_WORD = {normal(word): WordMeaning(key) for key, each in CALLED["settings"].items() for word in _split(each)}
SETTINGS = {meaning.key: meaning for meaning in BY_WORD.values()}
HEADS, NOT_STATED = (set(_split(CALLED[name])) for name in ("heads", "not_stated"))
"""Headers of a sheet's column of words, and words for a missing value."""


@cache
def known_keys() -> frozenset[str]:
    """Return the dotted names of all settings that a note may give."""
    named = [key for key in dotted_names(Trial) if not key.startswith(f"{MESH}.")]
    return OWN.union(named, (f"{COLUMNS}.{key}" for key in Columns.model_fields))


def tables() -> frozenset[str]:
    return frozenset(key.partition(".")[0] for key in known_keys() if "." in key)


def of_columns(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings in a table of columns by dotted key. Those of a whole sheet become settings of [readings]."""
    of_readings = (*OF_THE_SHEET, "as_written")
    settings = {f"readings.{key}": table[key] for key in of_readings if key in table}
    if "sign" in table:
        settings["readings.quantity"] = SIGNS.get(str(table["sign"]), table["sign"])
    rest = {f"{COLUMNS}.{key}": value for key, value in table.items() if key not in (*of_readings, "sign")}
    return settings | rest


def meaning_of(word: str, name: str, own: Mapping[str, str]) -> WordMeaning | None:
    """Return the setting that a word, or ``name``, the word without its unit, means; None if it is unknown.

    ``own`` maps the lab's own words to keys.
    """
    if word in known_keys():
        return WordMeaning(word, own=True)
    for text in (word, name):
        if (key := own.get(normal(text))) is not None:
            return SETTINGS.get(key, WordMeaning(key, own=True))
        if (meaning := BY_WORD.get(normal(text))) is not None:
            return meaning
    # "mm/px" is both a unit and a word for the scale.
    return SETTINGS[SCALE] if unit_spelt(word) in UNITS["mm_per_px"] else None


def key_of_unit(value: str, unit: str) -> str | None:
    """Return the setting with the unit of an unknown word or of its value; None unless only settings have this unit."""
    units = _units_of(value, unit)
    return next(
        (one.key for one in SETTINGS.values() if one.unit in OF_SETTINGS and units & UNITS[one.unit].keys()), None
    )


def key_like(word: str, value: str, unit: str) -> str | None:
    """Return the setting that an unknown word with a number may mean; None if there is none.

    It is a setting with a similar name, or the depth if the number is a length.
    """
    if not re.search(r"\d", value):
        return None
    # If two settings have one name, as crack.depth_mm and uncertainty.depth_mm, take the one in SETTINGS.
    keys = [*sorted(known_keys()), *SETTINGS]
    names = {normal(key.rpartition(".")[2]): key for key in keys} | {w: one.key for w, one in BY_WORD.items()}
    if close := get_close_matches(normal(word), names, n=1, cutoff=ALIKE):
        return names[close[0]]
    return DEPTH if _units_of(value, unit) & UNITS["mm"].keys() else None


def _units_of(value: str, unit: str) -> set[str]:
    quantity = _number_and_unit(value)
    return {unit_spelt(unit), unit_spelt(quantity[2])} if quantity else set()


def read_value(meaning: WordMeaning, text: str, unit: str, *, exact: bool = False, behind: str = "") -> Any:
    """Return ``text`` as a value of the setting that ``meaning`` names.

    ``unit`` is the word's unit, such as mm in "depth [mm]", or empty. ``exact`` is True for a number that a workbook
    stores, and ``behind`` is the unit in the cell's number format. Raises ValueError if the value is ambiguous or
    invalid; the message completes a sentence that begins with the place of the value.
    """
    if meaning.own:
        return _read_setting(text, exact=exact)
    if meaning.choices:
        for choice, words in meaning.choices.items():
            if normal(text) in map(normal, words):
                return choice
        raise ValueError(f"is not allowed; write one of {', '.join(meaning.choices)}.")
    match meaning.key:
        case "photo.face_mm":
            width, times, height = TIMES.sub("x", text).partition("x")
            if not times:
                raise ValueError("is not a size; write width x height, for example 160 x 40.")
            # In "160 x 40 mm" the unit is that of both numbers.
            second = _number_and_unit(height)
            return [_quantity(meaning, width, unit, second[2] if second else ""), _quantity(meaning, height, unit)]
        case "photo.ends_px":
            numbers = [*map(float, PIXELS.findall(text))]
            if len(numbers) != 4:
                raise ValueError(
                    "must be x and y of two places in pixels, with decimal points; write for example 12.5 340 905 377."
                )
            return [numbers[:2], numbers[2:]]
        case "readings.as_written":
            return LIST_MARKS.sub(" ", text).split()
        case "date":
            return read_date(text)
        case _ if not meaning.unit:
            return text
        case _:
            return _scaled(meaning, float(text), unit, behind) if exact else _quantity(meaning, text, unit)


def _read_setting(text: str, *, exact: bool) -> Any:
    """Return ``text`` of a sheet as the value of a trial's key: a number, a word, or a list in TOML."""
    if exact:
        return int(text) if WHOLE.fullmatch(text) else float(text)
    if text[0] in "[{\"'" or text in {"true", "false"}:
        try:
            return tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError as fault:
            example = "[[12.0, 340.0], [905.0, 377.0]]"
            raise ValueError(f"is not valid TOML ({fault}); write for example {example}.") from None
    return text if number(text, None) is None else _plain_number(text)


def read_date(value: object) -> str:
    """Return a date in ISO 8601. ``value`` has this form or one such as 31.12.2026; otherwise raises ValueError."""
    text = value.isoformat() if isinstance(value, date) else str(value).strip()
    if german := GERMAN_DATE.fullmatch(text):
        day, month, year = german.groups()
        text = f"{year}-{month:0>2}-{day:0>2}"
    try:
        return date.fromisoformat(text[:10] if re.match(r"\d{4}-\d\d-\d\d[T ]", text) else text).isoformat()
    except ValueError:
        raise ValueError("is not an unambiguous date; write 2026-12-31 or 31.12.2026.") from None


def is_unit(text: str) -> bool:
    return any(unit_spelt(text) in units for units in UNITS.values())


def _quantity(meaning: WordMeaning, text: str, unit: str, otherwise: str = "") -> float:
    """Return a number converted to its setting's unit; ``otherwise`` is the unit of a ``text`` without a unit."""
    quantity = _number_and_unit(text)
    if quantity is None:
        raise ValueError("is not a number; write for example 16,0 or 16.0.")
    return _scaled(meaning, _plain_number(quantity[1].strip()), unit, quantity[2].strip() or otherwise.strip())


def has_words_beside(value: str) -> bool:
    """Return True if a number has neutral words around it, such as "ca." in "ca. 9 mm"."""
    return NUMBER.fullmatch(value) is None and _number_and_unit(value) is not None


def _number_and_unit(text: str) -> re.Match[str] | None:
    """Match a number and the text after it, without neutral words around them."""
    words = text.lstrip(f"{ABOUT} ").split(" ")
    while words and normal(words[0]) in NEUTRAL:
        del words[0]
    # "in" may be inches.
    while words and normal(words[-1]) in NEUTRAL and not is_unit(words[-1]):
        del words[-1]
    return NUMBER.fullmatch(" ".join(words))


def _plain_number(text: str) -> float:
    if is_ambiguous(text):
        whole, fraction = re.split("[.,]", text)
        raise ValueError(f"is ambiguous; write {whole}{fraction} or {whole}.{fraction}0.")
    value = number(text, None)
    if value is None:
        raise ValueError("is not a number; write for example 16,0 or 16.0, without thousands separators.")
    return int(value) if WHOLE.fullmatch(text) else value


def _scaled(meaning: WordMeaning, number: float, in_word: str, in_value: str) -> float:
    units = UNITS[meaning.unit]
    allowed = ", ".join(units)
    given = [unit for unit in (unit_spelt(in_word), unit_spelt(in_value)) if unit]
    if not given:
        raise ValueError(f"has no unit; write one of these after the word or after the number: {allowed}.")
    for unit in given:
        if unit not in units:
            raise ValueError(f"is in {unit!r}, which is not a unit of this setting; write one of {allowed}.")
    if len({units[unit] for unit in given}) > 1:
        raise ValueError(f"has two units, {given[0]} after the word and {given[1]} after the value; write only one.")
    # Twelve digits, so that 1.6 cm is 16 mm and not 16.000000000000004.
    return float(f"{number * units[given[0]]:.12g}")


def unit_spelt(text: str) -> str:
    """Return a unit in one spelling, without spaces and marks between letters; "mm per pixel" becomes mm/pixel."""
    words = ("/" if word in PER else word for word in text.replace("μ", "µ").casefold().replace("μ", "µ").split())
    return re.sub(r"[\s·*]+|(?<=[a-z])\.$", "", "".join(words))
