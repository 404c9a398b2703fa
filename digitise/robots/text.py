"""Text in a robot's program: numbers of a fixed form, and words that can never become code."""

import re
from collections.abc import Iterable

NOT_PLAIN = re.compile(r"[^A-Za-z0-9 .,:_+=/-]")
"""GRBL obeys ?, ! and ~ wherever they stand, comments included; %, * and $ mean something to other controllers; line
ends close a comment, and brackets and quotes open things in one language or another."""
LONGEST = 120


def comment(text: str) -> str:
    """``text`` as one line of letters, digits and the few signs that mean nothing in a comment of any controller."""
    return NOT_PLAIN.sub("_", text)[:LONGEST]


def comments(mark: str, lines: Iterable[str]) -> list[str]:
    """Each line after the sign with which a language's comments begin."""
    return [f"{mark} {comment(line)}".rstrip() for line in lines]


def decimal(value: float, decimals: int) -> str:
    """Never in powers of ten, which some controllers do not read, and never -0."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"
