"""Remarks about a sheet: what its readings count from, and factors."""

import re

from validate.readings.header_words import ALL_WORDS, FACE, LONGEST_NAME, NAME, OF_FACE, OF_FACTOR, ZERO_OF_READINGS
from validate.readings.text_table import WORDS, plain_letters

CHECKED, ON = (frozenset(WORDS["remarks"][key].split()) for key in ("checked", "on"))
PRODUCT = re.compile(
    r"(?<!\w)(?P<maker>[A-Z]\w+) (?:Reference|Origin) (?P<model>[A-Z]{2,}\w*) \d{1,3}\.\d{1,3}\.\d{1,3}(?![\d.,])"
)
"""A word for a zero in the name of a product with its version, such as "Leitz Reference HP 12.10.7"."""


def names_other_zero(text: str) -> bool:
    """Return whether a remark mentions a zero point in other words than those for the sample's face."""
    listed = NAME.findall(plain_letters(PRODUCT.sub(_without_product, text[: 5 * LONGEST_NAME])))
    words = set(listed)
    if not words & ZERO_OF_READINGS or (words & FACE and words <= ZERO_OF_READINGS | FACE | OF_FACE):
        return False
    # "zero checked on face", but not "zero on caliper face".
    on = next((at for at in range(len(listed) - 1, 0, -1) if listed[at] in ON), 0)
    before, behind = set(listed[:on]), set(listed[on + 1 :])
    is_face = bool(behind & FACE) and behind <= FACE | OF_FACE
    return not (is_face and before <= ZERO_OF_READINGS | CHECKED | OF_FACE)


def _without_product(product: re.Match[str]) -> str:
    """Return "" for the name of a product; a match with a word of labs may be a remark."""
    words = {plain_letters(product["maker"]), plain_letters(product["model"])}
    return product[0] if words & (ALL_WORDS | FACE | ZERO_OF_READINGS | CHECKED) else " "


def names_factor(text: str) -> bool:
    """Return whether a remark gives a factor for the readings."""
    words = set(NAME.findall(plain_letters(text[:LONGEST_NAME])))
    return bool(words & OF_FACTOR)
