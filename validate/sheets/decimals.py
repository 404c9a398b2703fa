"""Numbers as people write them: a decimal point or a comma, and no guess where a mark may be either."""

import math
import re
from collections.abc import Iterable

from validate.settings import Decimal

NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:[.,' \u2019\u00a0\u202f][0-9]{3})+(?:[.,][0-9]*)?")
"""With thousands set apart, or so it may be."""
EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2}([.,])[0-9]{3}")
"""One and a quarter, or one thousand and two hundred and fifty. Nobody sets apart the thousands of 0.125."""
MINUS = str.maketrans(dict.fromkeys("\u2212\u2013", "-"))
"""A real minus, and the dash that word processors make of one."""
MISSING = {"", "-", "\u2013", "\u2014", "n/a", "na", "n.a.", "k.a.", "k. a."}
MARKS: dict[Decimal, str] = {"point": ".", "comma": ","}


def is_missing(text: str) -> bool:
    return text.casefold() in MISSING


def mark_of(text: str) -> Decimal | None:
    """Which decimal mark a number has beyond doubt."""
    text = text.translate(MINUS)
    if not NUMBER.fullmatch(text) or EITHER.fullmatch(text):
        return None
    return "comma" if "," in text else "point" if "." in text else None


def is_either(text: str) -> bool:
    """Whether its mark may be a decimal one, or set thousands apart."""
    return EITHER.fullmatch(text.translate(MINUS)) is not None


def common_mark(texts: Iterable[str], separator: str | None) -> Decimal | None:
    """The decimal mark that a file's numbers have; None where they do not tell.

    Commas between the fields tell too: whoever writes decimals with them separates by something else.
    """
    texts = list(texts)
    marks = [mark_of(text) for text in texts]
    points, commas = marks.count("point"), marks.count("comma")
    if points or commas:
        return "comma" if commas > points else "point"
    if separator == "," and not any("," in text for text in texts):
        return "point"
    return None


def number(text: str, mark: Decimal | None) -> float | None:
    """None where it is no finite number with that ``mark``, or with either where that is None."""
    text = text.translate(MINUS)
    if not NUMBER.fullmatch(text):
        return None
    if mark is not None and MARKS["point" if mark == "comma" else "comma"] in text:
        return None
    value = float(text.replace(",", "."))
    return value if math.isfinite(value) else None


def is_grouped(text: str) -> bool:
    """Whether thousands are set apart in it, or may be."""
    return GROUPED.fullmatch(text.translate(MINUS)) is not None
