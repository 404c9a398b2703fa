"""Numbers on the command line: one reader for all options, with a decimal point or comma."""

import math
import re
from collections.abc import Callable
from typing import Any

import typer

WRITTEN = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)
"""A number as people write it: Python's own reader also takes 1_0, nan and digits of other scripts."""
THOUSANDS = re.compile(r"[+-]?[1-9]\d*,\d{3}", re.ASCII)


def read_number(text: str, *, comma: bool = True) -> float:
    """Return a finite number. Raises ValueError, with what was expected; ``comma`` is False where commas separate."""
    text = text.strip()
    if not WRITTEN.fullmatch(text) or ("," in text and not comma):
        raise ValueError("expected a number, as 0.1" + (" or 0,1" if comma else ""))
    if THOUSANDS.fullmatch(text):
        raise ValueError(f"{text.replace(',', '.')} or {text.replace(',', '')}? Write it without the comma")
    value = float(text.replace(",", "."))
    if not math.isfinite(value):
        raise ValueError("expected a number that is finite")
    return value


def number_option(help: str, low: float | None = None, high: float | None = None, *names: str) -> Any:
    """Describe an option of one number, from ``low`` to ``high`` where given."""
    return typer.Option(*names, help=help, metavar=_metavar("NUMBER", low, high), parser=_reader(float, low, high))


def count_option(help: str, low: int, high: int | None = None) -> Any:
    """Describe an option of a whole number, from ``low`` to ``high`` where given."""
    return typer.Option(help=help, metavar=_metavar("COUNT", low, high), parser=_reader(int, low, high))


def _metavar(word: str, low: float | None, high: float | None) -> str:
    if low is None:
        return word
    return f"{word}, {low} or more" if high is None else f"{word}, {low} to {high}"


def _reader(kind: type[int] | type[float], low: float | None, high: float | None) -> Callable[[Any], float]:
    def read(given: Any) -> float:
        # A default is a number already.
        try:
            value = read_number(given) if isinstance(given, str) else given
        except ValueError as fault:
            raise typer.BadParameter(f"{given}: {fault}") from None
        if kind is int and value != int(value):
            raise typer.BadParameter(f"{given}: expected a whole number")
        if not (-math.inf if low is None else low) <= value <= (math.inf if high is None else high):
            raise typer.BadParameter(f"{given}: expected {_metavar('', low, high).lstrip(', ')}")
        return kind(value)

    return read
