"""Numbers and words in cells: decimal marks, missing readings, and letters without accents."""

import math
import re
import tomllib
import unicodedata
from collections.abc import Iterable
from functools import lru_cache
from importlib.resources import files as resources

from validate.settings import Decimal

WORDS = tomllib.loads(resources("validate").joinpath("readings", "words.toml").read_text(encoding="utf-8"))
"""Words of labs in all languages."""
MISSING = frozenset(WORDS["missing"]["words"].split())
UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue"})
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
AMBIGUOUS = re.compile(r"[+-]?[1-9][0-9]{0,2}([.,])[0-9]{3}")
"""Number such as 1.250: a decimal, or 1250 with a thousands separator. 0.125 can only be a decimal."""
DECIMALS = re.compile(r"[.,]([0-9]+)$")
MINUS = str.maketrans(dict.fromkeys("\u2212\u2013", "-"))
"""The typographic minus, and the dash that word processors substitute for a hyphen."""
OTHER_MARKS: dict[Decimal | None, str] = {"point": ",", "comma": "."}
"""Mark that numbers with a decimal mark do not contain."""


@lru_cache(maxsize=50_000)
def plain_letters(text: str) -> str:
    """Return the text in lower case, umlauts spelt out (ä is ae) and other accents removed (é is e, ñ is n)."""
    folded = unicodedata.normalize("NFKC", text).casefold().translate(UMLAUTS)
    return "".join(letter for letter in unicodedata.normalize("NFD", folded) if unicodedata.category(letter) != "Mn")


def is_missing(text: str) -> bool:
    """Return whether a cell is blank or contains a word for a missing reading."""
    return not text or "".join(plain_letters(text).split()) in MISSING


def is_ambiguous(text: str) -> bool:
    """Return True if the comma or point in a number may be either a decimal mark or a thousands separator."""
    return AMBIGUOUS.fullmatch(text.translate(MINUS)) is not None


def common_mark(texts: Iterable[str], separator: str | None) -> Decimal | None:
    """Return the decimal mark of a file's numbers, or None if they do not decide it.

    A comma as the field separator excludes decimal commas.
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
    """Return a finite number with the decimal ``mark``, or with either mark if it is None. Other texts give None."""
    text = text.translate(MINUS)
    if not NUMBER.fullmatch(text) or OTHER_MARKS.get(mark, " ") in text:
        return None
    value = float(text.replace(",", "."))
    return value if math.isfinite(value) else None


def decimals_of(text: str) -> int:
    """Return the number of decimals of a number, without trailing zeros."""
    match = DECIMALS.search(text)
    return len(match[1].rstrip("0")) if match else 0
