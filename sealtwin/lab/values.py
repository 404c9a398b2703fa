"""A value as a lab writes it, turned into what its setting takes: units and decimal signs are read, never guessed."""

import re
import tomllib
from collections.abc import Callable
from datetime import date
from typing import Any

from sealtwin.lab.words import UNITS, Meaning, normal

NUMBER = re.compile(r"([-+\u2212]?\d[\d.,' ]*(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)
PLAIN = re.compile(r"[-+]?\d+([.,]\d+)?([eE][-+]?\d+)?")
WHOLE = re.compile(r"[-+]?\d+")
AMBIGUOUS = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}")
"""1,234 is a thousand to one reader, and one and a bit to another."""
TIMES = re.compile(r"\s*[x\u00d7*]\s*", re.IGNORECASE)
PIXELS = re.compile(r"-?\d+(?:\.\d+)?")
GERMAN_DATE = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")


def read_value(meaning: Meaning, text: str, unit: str, *, exact: bool = False) -> Any:
    """``text`` as the setting that ``meaning`` names takes it.

    Args:
        meaning: What the word beside it says.
        text: As it was written, not blank.
        unit: As the word gave it, for example mm of "depth [mm]"; empty where it gave none.
        exact: A workbook's own number, whose decimal point is one.

    Raises:
        ValueError: it cannot be read, or not without guessing; its text ends a sentence that names the place.
    """
    if exact and meaning.kind == "number":
        return _scaled(meaning, float(text), unit, "")
    readers: dict[str, Callable[[Meaning, str, str], Any]] = {
        "text": lambda _, text, __: text,
        "date": lambda _, text, __: read_date(text),
        "choice": _choice,
        "number": _number,
        "size": _size,
        "points": _points,
    }
    return readers[meaning.kind](meaning, text, unit)


def read_setting(text: str, *, exact: bool = False) -> Any:
    """The value of a trial's own key in a sheet of words: a number, a word, or a list as TOML writes it.

    ``exact`` and what is raised as ``read_value``.
    """
    if exact:
        return int(text) if WHOLE.fullmatch(text) else float(text)
    if text[0] in "[{\"'" or text in {"true", "false"}:
        try:
            return tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError as fault:
            example = "[[12.0, 340.0], [905.0, 377.0]]"
            raise ValueError(f"is no value as TOML writes it ({fault}); for example {example}.") from None
    return _plain_number(text) if PLAIN.fullmatch(text) else text


def read_date(value: object) -> str:
    """ISO 8601, from that or from 31.12.2026. Raises ValueError."""
    text = value.isoformat() if isinstance(value, date) else str(value).strip()
    if german := GERMAN_DATE.fullmatch(text):
        day, month, year = german.groups()
        text = f"{year}-{month:0>2}-{day:0>2}"
    try:
        return date.fromisoformat(text[:10] if re.match(r"\d{4}-\d\d-\d\d[T ]", text) else text).isoformat()
    except ValueError:
        raise ValueError("is no date that can be read one way only; write 2026-12-31 or 31.12.2026.") from None


def _choice(meaning: Meaning, text: str, unit: str) -> str:
    words = {normal(word): choice for word, choice in meaning.choices.items()}
    if normal(text) not in words:
        raise ValueError(f"is none of {', '.join(dict.fromkeys(meaning.choices.values()))}.")
    return words[normal(text)]


def _number(meaning: Meaning, text: str, unit: str) -> float:
    found = NUMBER.fullmatch(text)
    if found is None:
        raise ValueError("is no number; write for example 16,0 or 16.0.")
    return _scaled(meaning, _plain_number(found[1].strip()), unit, found[2].strip())


def _size(meaning: Meaning, text: str, unit: str) -> list[float]:
    sides = TIMES.split(text)
    if len(sides) != 2:
        raise ValueError("is no size; write width x height, for example 160 x 40.")
    parts = [NUMBER.fullmatch(side) for side in sides]
    if parts[0] is None or parts[1] is None:
        raise ValueError("is no size; write width x height, for example 160 x 40.")
    # "160 x 40 mm" gives the unit once, for both.
    beside = parts[1][2].strip()
    return [_scaled(meaning, _plain_number(part[1].strip()), unit, part[2].strip() or beside) for part in parts if part]


def _points(meaning: Meaning, text: str, unit: str) -> list[list[float]]:
    numbers = [float(number) for number in PIXELS.findall(text)]
    if len(numbers) != 4:
        raise ValueError("must be two places in pixels, decimals with a point: 12.5 340 905 377.")
    return [numbers[:2], numbers[2:]]


def _plain_number(text: str) -> float:
    text = text.replace("\u2212", "-")
    if not PLAIN.fullmatch(text):
        raise ValueError("is no number; write for example 16,0 or 16.0, without a sign between thousands.")
    if AMBIGUOUS.fullmatch(text):
        whole, fraction = re.split("[.,]", text)
        raise ValueError(f"may be {whole}{fraction} or {whole}.{fraction}0; write one of these.")
    number = float(text.replace(",", "."))
    return int(number) if WHOLE.fullmatch(text) else number


def _scaled(meaning: Meaning, number: float, in_word: str, in_value: str) -> float:
    units = UNITS[meaning.measure]
    known = ", ".join(units)
    given = [unit for unit in (_unit(in_word), _unit(in_value)) if unit]
    if not given:
        raise ValueError(f"has no unit; write it beside the word or the number, one of {known}.")
    for unit in given:
        if unit not in units:
            raise ValueError(f"is in {unit!r}, which is not known here; write one of {known}.")
    if len({units[unit] for unit in given}) > 1:
        raise ValueError(f"is in {given[0]} by its word and in {given[1]} by its value; write one of both.")
    # Twelve digits: 1.6 cm is 16 mm, and not 16.000000000000004.
    return float(f"{number * units[given[0]]:.12g}")


def _unit(text: str) -> str:
    """Without what people put between its letters."""
    return re.sub(r"[\s·*]+|(?<=[a-z])\.$", "", text.replace("μ", "µ").casefold().replace("μ", "µ"))
