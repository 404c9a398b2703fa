"""A file of settings: read, checked, and each fault of it said in one sentence."""

import difflib
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from sealtwin.errors import InputError, as_text, naming
from sealtwin.settings import Settings

Table = TypeVar("Table", bound=Settings)

LARGEST_BYTES = 200_000
"""A file of settings is some kilobytes; anything like this is another file given by mistake."""
DEEP_KEY = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++\s*+\.\s*+){16}")
"""A dotted key of thousands of parts makes a table for each: gigabytes from kilobytes."""
MOST_FAULTS = 8
"""Told at once; whoever has more gives another file by mistake, or a list of the wrong kind."""
LONGEST_VALUE = 60
"""Letters of a value that is shown; more of it helps nobody to find it."""
BRANCHES = {"float", "int", "str", "one", "several"}
"""Names of a union's branches: pydantic's own, and the tags of settings that are one number or several."""


def read_settings(kind: type[Table], path: Path, *, name: str, starter: str) -> Table:
    """Settings from a TOML file.

    Args:
        kind: What the file's whole content is.
        path: The file.
        name: What such a file is called, for example "trial file".
        starter: How to get one to start from, for example "'sealtwin init DIR' writes one".

    Raises:
        InputError: the file is missing, no TOML, or holds a key or a value that cannot be; every fault is named with
            its key, the value found and what is allowed.
    """
    return checked(kind, path, read_toml(path, name=name, starter=starter))


def read_toml(path: Path, *, name: str, starter: str) -> dict[str, Any]:
    """The content of a TOML file, its keys not yet checked. Arguments and errors as ``read_settings``."""
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; give the {name}.")
    if not path.is_file():
        raise InputError(f"{path}: no such file. {starter}.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES} bytes; this is no {name}.")
    try:
        # Windows' Notepad opens a file with a byte-order mark.
        with naming(path):
            text = path.read_text(encoding="utf-8-sig")
        if DEEP_KEY.search(text):
            raise InputError(f"{path}: a key of more than 16 parts; a {name} has tables of a level or two.")
        return tomllib.loads(text)
    except UnicodeDecodeError:
        raise InputError(f"{path}: no UTF-8 text; a {name} is TOML. {starter}.") from None
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path}: no valid TOML: {fault}.") from None


def checked(
    kind: type[Table], path: Path, content: dict[str, Any], origin: Callable[[str], str] | None = None
) -> Table:
    """``content`` as settings. Raises InputError as ``read_settings``.

    Faults name ``path``; or, where ``content`` comes from several files, what ``origin`` says of a dotted key.
    """
    if as_text(path) != str(path):
        raise InputError(f"{as_text(path)}: a name that is not UTF-8, which no trial can hold; rename it.")
    try:
        # JSON is the form in which strict types still take a list for a tuple and a string for a path.
        text = json.dumps(content, default=str)
    except ValueError:
        # Python reads a hexadecimal number of any length, and writes none of so many digits.
        raise InputError(f"{path}: a whole number of thousands of digits; no setting takes one.") from None
    try:
        return kind.model_validate_json(text)
    except ValidationError as fault:
        named = origin or (lambda _: str(path))
        raise InputError("\n".join(_sentences(kind, named, fault.errors()))) from None


def _sentences(kind: type[Settings], named: Callable[[str], str], errors: list[ErrorDetails]) -> list[str]:
    """One for each place in the file: the branches of a union find fault with the same value."""
    places: dict[tuple[int | str, ...], list[ErrorDetails]] = {}
    for error in errors:
        where = tuple(part for part in error["loc"] if not _is_type_name(part))
        if error["type"] == "missing" and isinstance(where[-1], int):
            where = where[:-1]
        places.setdefault(where, []).append(error)
    told = []
    for parts, found in list(places.items())[:MOST_FAULTS]:
        where = ".".join(str(part) for part in parts)
        told.append(_sentence(kind, named(where), where, found))
    more = len(places) - len(told)
    return [*told, f"{named('')}: and {more} more faults of this kind or another."] if more else told


def _sentence(kind: type[Settings], path: str, where: str, errors: list[ErrorDetails]) -> str:
    error = errors[0]
    found = error["input"]
    if error["type"] == "extra_forbidden":
        beside = _keys_beside(kind, error["loc"])
        close = difflib.get_close_matches(str(error["loc"][-1]), beside, n=1)
        allowed = f"did you mean '{close[0]}'?" if close else f"allowed: {', '.join(beside)}."
        return f"{path}: {where}: no such key; {allowed}"
    if error["type"] == "missing" and isinstance(error["loc"][-1], int):
        return f"{path}: {where}: {len(found)} given, {len(found) + len(errors)} needed."
    if error["type"] == "missing":
        return f"{path}: {where} is missing; it has no default, so it must be given."
    if error["type"] == "string_pattern_mismatch":
        return f"{path}: {where} = {_shown(found)}: must be one line of text, not blank and without control characters."
    reason = ", or ".join(dict.fromkeys(_reason(error) for error in errors))
    if isinstance(found, dict | list):
        return f"{path}: {where}: {reason}." if where else f"{path}: {reason}."
    return f"{path}: {where} = {_shown(found)}: {reason}."


def _reason(error: ErrorDetails) -> str:
    limits = error.get("ctx", {})
    if error["type"] == "too_long":
        return f"{limits['actual_length']} given, at most {limits['max_length']} allowed"
    if error["type"] == "too_short":
        return f"{limits['actual_length']} given, at least {limits['min_length']} needed"
    return error["msg"].removeprefix("Value error, ").removeprefix("Input ")


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."


def _is_type_name(part: int | str) -> bool:
    """Branches of a union, which pydantic adds to the place of an error and no user wrote."""
    return isinstance(part, str) and (part in BRANCHES or part.startswith(("literal[", "constrained-")))


def _keys_beside(kind: type[Settings], location: tuple[int | str, ...]) -> list[str]:
    """Keys that the table of a misspelt key knows."""
    table: Any = kind
    for part in location[:-1]:
        if isinstance(part, str) and part in table.model_fields:
            inner = _settings_in(table.model_fields[part].annotation)
            if inner is None:
                return []
            table = inner
    return sorted(table.model_fields)


def _settings_in(annotation: Any) -> Any:
    """The settings class inside X, X | None or tuple[X, ...]."""
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        if (found := _settings_in(inner)) is not None:
            return found
    return None
