"""Settings files: TOML, checked against a model; every fault is reported in one sentence."""

import difflib
import json
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.plain_files import read_text
from sealtwin.core.settings_text import described, text_of_table

if TYPE_CHECKING:
    # Checkers read the keywords and their types off the fields.
    from pydantic._internal._model_construction import ModelMetaclass as KeywordTables
else:

    class KeywordTables(type(BaseModel)):
        """Construction by keywords, which are checked as a file's and documented by the fields; None is left out."""

        def __call__(cls, *unnamed: Any, **values: Any) -> BaseModel:
            if unnamed:
                raise InputError(f"{cls.__name__}: give settings by name, as {next(iter(cls.model_fields))}=...")
            return checked(cls, Path(cls.__name__), values)

        @property
        def __doc__(cls) -> str:
            return text_of_table(cls)


class _ByDefault:
    """A default in a signature, whose value is in the docstring."""

    def __repr__(self) -> str:
        return "..."


class Settings(BaseModel, metaclass=KeywordTables):
    """Base of the tables of a trial file. Subclasses document each field beside it; units are part of the names."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        # A quoted "16" is a typo in a file of numbers, not a number.
        strict=True,
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        # help() begins with the signature, and a notebook completes by it; with types and bounds it fills a page.
        names = [Parameter(name, Parameter.KEYWORD_ONLY, default=_ByDefault()) for name in cls.model_fields]
        cls.__signature__ = Signature(names)


__all__ = ["Settings", "as_json", "checked", "described", "dotted_names", "read_settings", "read_toml"]
Table = TypeVar("Table", bound=Settings)

LARGEST_BYTES = 200_000
"""Limit of a settings file, which has some kilobytes."""
DEEP_KEY = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++\s*+\.\s*+){16}")
"""Dotted key of 16 parts or more; one of thousands would make a table for each part, gigabytes in all."""
MOST_FAULTS = 8
"""Number of faults that are reported at once."""
LONGEST_VALUE = 60
"""Letters of a faulty value that are shown."""
BRANCH = r"float|int|str|one|several|literal\[.*|constrained-.*"
"""Names of a union's branches: pydantic's own, and the tags of settings that are one number or several."""


def read_settings(kind: type[Table], path: Path, *, name: str, starter: str) -> Table:
    """Read settings from a TOML file.

    Errors call it by ``name``, such as "trial file", and ``starter`` is the sentence on how to get one. Raises
    InputError if the file is missing, no TOML, or holds a key or a value that is not allowed; every fault is named with
    its key, the value found and what is allowed.
    """
    return checked(kind, path, read_toml(path, name=name, starter=starter))


def read_toml(path: Path, *, name: str, starter: str) -> dict[str, Any]:
    """Read a TOML file without checking its keys. Arguments and errors as ``read_settings``."""
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; give the {name}.")
    if not path.is_file():
        raise InputError(f"{path}: no such file. {starter}.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES} bytes; this is no {name}.")
    try:
        text = read_text(path, LARGEST_BYTES)
        if DEEP_KEY.search(text):
            raise InputError(f"{path}: a key of more than 16 parts; a {name} has tables of a level or two.")
        return tomllib.loads(text)
    except UnicodeDecodeError:
        raise InputError(f"{path}: no UTF-8 text; a {name} is TOML. {starter}.") from None
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path}: no valid TOML: {fault}.") from None


def checked(
    kind: type[Table], path: Path, content: Mapping[str, Any], origin: Callable[[str], str] | None = None
) -> Table:
    """Return ``content`` as settings. Raises InputError as ``read_settings``.

    Lists, tuples and NumPy's arrays are alike; a value of None counts as left out. Faults name ``path``, or ``origin``
    of the dotted key if ``content`` comes from several files.
    """
    if as_text(path) != str(path):
        raise InputError(f"{as_text(path)}: a name that is not UTF-8, which no trial can hold; rename it.")
    try:
        given = {name: value for name, value in content.items() if value is not None}
        # JSON is the form in which strict types still take a list for a tuple and a string for a path.
        text = json.dumps(given, default=as_json)
    except ValueError:
        # Python reads a hexadecimal number of any length, and writes none of so many digits.
        raise InputError(f"{path}: a whole number of thousands of digits; no setting takes one.") from None
    try:
        return kind.model_validate_json(text)
    except ValidationError as fault:
        named = origin or (lambda _: str(path))
        raise InputError("\n".join(_sentences(kind, named, fault.errors()))) from None


def as_json(value: Any) -> Any:
    """Return a value that JSON has no type for in types that it has; NumPy is not imported for it."""
    if isinstance(value, Settings):
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, Mapping):
        return dict(value)
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _sentences(kind: type[Settings], named: Callable[[str], str], errors: list[ErrorDetails]) -> list[str]:
    """Return one sentence for each place in the file: the branches of a union report the same value."""
    places: dict[str, list[ErrorDetails]] = {}
    for error in errors:
        # pydantic adds the branch of a union to the place of an error.
        parts = [part for part in error["loc"] if not re.fullmatch(BRANCH, str(part))]
        if error["type"] == "missing" and isinstance(parts[-1], int):
            parts.pop()
        places.setdefault(".".join(map(str, parts)), []).append(error)
    first = list(places.items())[:MOST_FAULTS]
    sentences = [f"{named(where)}: {_fault(kind, where, found)}" for where, found in first]
    more = len(places) - len(sentences)
    return [*sentences, f"{named('')}: and {more} more faults."] if more else sentences


def _fault(kind: type[Settings], where: str, errors: list[ErrorDetails]) -> str:
    error, found = errors[0], errors[0]["input"]
    if error["type"] == "extra_forbidden":
        beside = _keys_beside(kind, error["loc"])
        close = difflib.get_close_matches(str(error["loc"][-1]), beside, n=1)
        allowed = f"did you mean '{close[0]}'?" if close else f"allowed: {', '.join(beside)}."
        return f"{where}: no such key; {allowed}"
    if error["type"] == "missing" and isinstance(error["loc"][-1], int):
        return f"{where}: {len(found)} given, {len(found) + len(errors)} needed."
    if error["type"] == "missing":
        return f"{where} is missing; it has no default, so it must be given."
    reason = ", or ".join(dict.fromkeys(map(_reason, errors)))
    if isinstance(found, dict | list):
        return f"{where}: {reason}." if where else f"{reason}."
    value = repr(found)
    return f"{where} = {value if len(value) <= LONGEST_VALUE else f'{value[:LONGEST_VALUE]}...'}: {reason}."


def _reason(error: ErrorDetails) -> str:
    if error["type"] == "string_pattern_mismatch":
        return "must be one line of text, not blank and without control characters"
    return error["msg"].removeprefix("Value error, ").removeprefix("Input ").replace(" after validation", "")


def _keys_beside(kind: type[Settings], location: tuple[int | str, ...]) -> list[str]:
    """Return the keys that are allowed in the table of a misspelt key."""
    table = table_of(kind, location)
    return [] if table is None else sorted(table.model_fields)


def table_of(kind: type[Settings], location: Sequence[int | str]) -> type[Settings] | None:
    """Return the table of a key, whose place in a file is given by its parts; parts that no table has are skipped."""
    table: type[Settings] | None = kind
    for part in location[:-1]:
        if table is not None and part in table.model_fields:
            table = _settings_in(table.model_fields[str(part)].annotation)
    return table


def names_file(kind: type[Settings], name: str) -> bool:
    """Return True if the setting of that dotted name is, or may be, the name of a file."""
    annotation = _annotation_of(kind, name)
    # A table of a file alone may be given by that file's name.
    inner = _settings_in(annotation)
    return _has(annotation, Path) or (inner is not None and "file" in inner.model_fields)


def takes_list(kind: type[Settings], name: str) -> bool:
    """Return True if the setting of that dotted name is, or may be, a list."""
    return _has(_annotation_of(kind, name), tuple)


def _annotation_of(kind: type[Settings], name: str) -> Any:
    """Return the annotation of the setting of that dotted name; None if there is none."""
    *_, key = parts = name.split(".")
    table = table_of(kind, parts)
    return None if table is None or key not in table.model_fields else table.model_fields[key].annotation


def _has(annotation: Any, kind: type) -> bool:
    """Return True if the annotation is of that kind, or may be."""
    return kind in (annotation, get_origin(annotation)) or any(
        _has(part, kind) for part in getattr(annotation, "__args__", ())
    )


def dotted_names(kind: type[Settings]) -> list[str]:
    """Return the names of all settings of a file, table.key for those in a table."""
    names: list[str] = []
    for name, field in kind.model_fields.items():
        table = _settings_in(field.annotation)
        names += [name] if table is None else [f"{name}.{key}" for key in table.model_fields]
    return names


def _settings_in(annotation: Any) -> type[Settings] | None:
    """Return the settings class inside X, X | None or tuple[X, ...]."""
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return annotation
    return next(filter(None, map(_settings_in, getattr(annotation, "__args__", ()))), None)
