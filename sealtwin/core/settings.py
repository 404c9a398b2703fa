"""Settings files in TOML, which are checked against a model. Every fault is reported in one sentence."""

import difflib
import json
import math
import re
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.plain_files import read_text
from sealtwin.core.settings_text import text_of_table

if TYPE_CHECKING:
    # Type checkers take the keywords and their types from the fields.
    from pydantic._internal._model_construction import ModelMetaclass as KeywordTables
else:

    class KeywordTables(type(BaseModel)):
        """Metaclass of tables whose keywords are checked like a file. Their help comes from the fields.

        None counts as absent.
        """

        def __call__(cls, *unnamed: Any, **values: Any) -> BaseModel:
            if unnamed:
                raise InputError(f"{cls.__name__}: give settings by name, as in {next(iter(cls.model_fields))}=...")
            return checked(cls, Path(cls.__name__), values)

        @property
        def __doc__(cls) -> str:
            return text_of_table(cls)


class _ByDefault:
    """Placeholder for a default in a signature. The docstring has its value."""

    def __repr__(self) -> str:
        return "..."


class Settings(BaseModel, metaclass=KeywordTables):
    """Base of the tables of a trial file. Each field has a docstring below it, and its unit in its name."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        # A quoted "16" is a typo, not a number.
        strict=True,
    )

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """Yield the settings that were given; the others have their defaults."""
        return ((name, getattr(self, name)) for name in type(self).model_fields if name in self.model_fields_set)

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        # help() begins with the signature, which with types and bounds would fill a page.
        names = [Parameter(name, Parameter.KEYWORD_ONLY, default=_ByDefault()) for name in cls.model_fields]
        cls.__signature__ = Signature(names)


Table = TypeVar("Table", bound=Settings)

LARGEST_BYTES = 200_000
"""Largest settings file that is read; usual files have some kilobytes."""
DEEP_KEY = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++\s*+\.\s*+){16}")
"""Dotted key of 17 parts or more. TOML makes a table for each part: thousands would take gigabytes."""
MOST_FAULTS = 8
"""Largest number of faults that are reported at once."""
LONGEST_VALUE = 60
"""Largest number of characters of a faulty value that are shown."""
BRANCH = r"float|int|str|one|several|(literal|tuple)\[.*|constrained-.*"
"""Names of a union's branches: those that pydantic gives, and the tags of settings that take one number or several."""
REASONS = {
    "missing": "should have more values",  # A list, as one of several kinds of a setting
    "too_short": "give at least {min_length} values, not {actual_length}",
    "too_long": "give at most {max_length} values, not {actual_length}",
    "string_too_short": "should not be empty",
    "string_too_long": "should have at most {max_length} letters",
    "string_pattern_mismatch": "must be one line of text, not blank and without control characters",
    "string_type": "should be text",
    "int_type": "should be a whole number",
    "int_from_float": "should be a whole number",
    "float_type": "should be a number",
    "bool_type": "should be true or false",
    "less_than_equal": "should be at most {le:.15g}",
    "greater_than_equal": "should be at least {ge:.15g}",
    "less_than": "should be less than {lt:.15g}",
    "greater_than": "should be greater than {gt:.15g}",
    **dict.fromkeys(("tuple_type", "list_type"), "should be a list"),
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type"), "should be a table"),
}
"""Words for pydantic's types of errors, with the names of their figures. Its other messages are shown as they are."""


def read_settings(kind: type[Table], path: Path, *, name: str, starter: str) -> Table:
    """Read settings from a TOML file.

    ``name``, such as "trial file", and ``starter``, a sentence on how to get one, are for messages. Raises InputError
    if the file is missing, is not TOML, or has a key or a value that is not allowed. A message has the key, the value
    and what is allowed, for every fault.
    """
    return checked(kind, path, read_toml(path, name=name, starter=starter))


def read_toml(path: Path, *, name: str, starter: str) -> dict[str, Any]:
    """Read a TOML file without checking its keys. Arguments and errors are those of ``read_settings``."""
    if path.is_dir():
        raise InputError(f"{path}: a folder; give the {name}.")
    if not path.is_file():
        raise InputError(f"{path}: no such file. {starter}.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES} bytes; not a {name}.")
    try:
        text = read_text(path, LARGEST_BYTES)
        if DEEP_KEY.search(text):
            raise InputError(
                f"{path}: a dotted key has more than 16 parts; tables in a {name} are at most two levels deep."
            )
        return tomllib.loads(text)
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a text in UTF-8; a {name} is TOML. {starter}.") from None
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path}: not valid TOML: {fault}.") from None


class SettingsFaults(InputError):  # noqa: N818  It is all that is wrong with settings, not one error.
    """Settings that are not allowed."""

    def __init__(
        self, sentences: Sequence[str], faults: Sequence[tuple[str, str]] = (), types: Collection[str] = ()
    ) -> None:
        super().__init__("\n".join(sentences))
        self.sentences = sentences
        self.faults = faults  # Dotted key, and the fault as a sentence
        self.types = types  # Of the faults, in pydantic's names and those of a table's own checks


def checked(
    kind: type[Table], path: Path, content: Mapping[str, Any], origin: Callable[[str], str] | None = None
) -> Table:
    """Return ``content`` as settings. Raises InputError for a key or a value that is not allowed.

    Lists, tuples and NumPy arrays are equivalent; None counts as absent. Messages begin with ``path``, or with
    ``origin(dotted_key)`` if ``content`` comes from several files.
    """
    if as_text(path) != str(path):
        raise InputError(f"{as_text(path)}: its name is not UTF-8, so no trial file can name it; rename it.")
    try:
        values = {name: value for name, value in content.items() if value is not None}
        # From JSON, strict types still take a list for a tuple and a string for a path.
        text = json.dumps(values, default=as_json)
    except ValueError:
        # Python reads hexadecimal numbers of any length, but does not write so many digits.
        raise InputError(f"{path}: a whole number has thousands of digits; no setting takes such a number.") from None
    try:
        return kind.model_validate_json(text)
    except ValidationError as fault:
        named = origin or (lambda _: str(path))
        faults, types = _faults(kind, fault.errors()), {error["type"] for error in fault.errors()}
        raise SettingsFaults([f"{named(key)}: {text}" for key, text in faults], faults, types) from None


def as_json(value: Any) -> Any:
    """Return a value in types that JSON has, without importing NumPy."""
    if isinstance(value, Settings):
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, Mapping):
        return dict(value)
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _faults(kind: type[Settings], errors: list[ErrorDetails]) -> list[tuple[str, str]]:
    """Return the key and a sentence for each place in the file.

    Branches of a union report the same value; these are merged.
    """
    places: dict[str, list[ErrorDetails]] = {}
    for error in errors:
        # pydantic adds the branch of a union to the place of an error.
        parts = [part for part in error["loc"] if not re.fullmatch(BRANCH, str(part))]
        if error["type"] == "missing" and isinstance(parts[-1], int):
            parts.pop()
        places.setdefault(".".join(map(str, parts)), []).append(error)
    first = list(places.items())[:MOST_FAULTS]
    sentences = [(where, _fault(kind, where, faults)) for where, faults in first]
    more = len(places) - len(sentences)
    return [*sentences, ("", f"and {more} more faults.")] if more else sentences


def _fault(kind: type[Settings], where: str, errors: list[ErrorDetails]) -> str:
    error, input_value = errors[0], errors[0]["input"]
    if error["type"] == "extra_forbidden":
        # The keys of the table that a misspelt key is in.
        table = table_of(kind, error["loc"])
        keys = sorted(table.model_fields) if table else []
        close = difflib.get_close_matches(str(error["loc"][-1]), keys, n=1)
        allowed = f"did you mean '{close[0]}'?" if close else f"allowed: {', '.join(keys)}."
        return f"{where}: no such key; {allowed}"
    if error["type"] == "missing" and isinstance(error["loc"][-1], int):
        return f"{where}: {len(input_value)} given, {len(input_value) + len(errors)} needed."
    if error["type"] == "missing":
        return f"{where} is missing; it has no default, so give it."
    reason = ", or ".join(dict.fromkeys(map(_reason, errors)))
    if isinstance(input_value, dict | list):
        return f"{where}: {reason}." if where else f"{reason}."
    value = repr(input_value)
    return f"{where} = {value if len(value) <= LONGEST_VALUE else f'{value[:LONGEST_VALUE]}...'}: {reason}."


def _reason(error: ErrorDetails) -> str:
    if (words := REASONS.get(error["type"])) is not None:
        return words.format(**error.get("ctx", {}))
    return error["msg"].removeprefix("Value error, ").removeprefix("Input ")


def table_of(kind: type[Settings], location: Sequence[int | str]) -> type[Settings] | None:
    """Return the table of the key at a location in a file. Parts of the location that no table has are skipped."""
    table: type[Settings] | None = kind
    for part in location[:-1]:
        if table is not None and part in table.model_fields:
            table = _settings_in(table.model_fields[str(part)].annotation)
    return table


def names_file(kind: type[Settings], name: str) -> bool:
    """Return True if the setting of this dotted name may be the name of a file."""
    annotation = _annotation_of(kind, name)
    # A table may be given by the name of its file.
    inner = _settings_in(annotation)
    return _has(annotation, Path) or (inner is not None and "file" in inner.model_fields)


def takes(kind: type[Settings], name: str, *parts: type) -> bool:
    """Return True if the setting of this dotted name may be, or contain, a value of these types; a list is a tuple."""
    return any(_has(_annotation_of(kind, name), part) for part in parts)


def choices(kind: type[Settings], name: str) -> list[str]:
    """Return the texts that the setting of this dotted name allows; none if it is not a choice."""
    parts = [part for part in get_args(_annotation_of(kind, name)) if part is not type(None)]
    texts = parts if not parts or isinstance(parts[0], str) else get_args(parts[0])
    return [text for text in texts if isinstance(text, str)]


def _annotation_of(kind: type[Settings], name: str) -> Any:
    """Return the annotation of the setting of this dotted name; None for an unknown name."""
    *_, key = parts = name.split(".")
    table = table_of(kind, parts)
    return None if table is None or key not in table.model_fields else table.model_fields[key].annotation


def _has(annotation: Any, kind: type) -> bool:
    """Return True if the annotation, or a part of it, is of this kind."""
    return kind in (annotation, get_origin(annotation)) or any(
        _has(part, kind) for part in getattr(annotation, "__args__", ())
    )


def dotted_names(kind: type[Settings]) -> list[str]:
    """Return the dotted names of all settings of a file: ``table.key`` for a setting in a table."""
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


class Likely(NamedTuple):
    """Range of a setting outside which a value is allowed, but doubted: it may be in another unit."""

    low: float
    high: float
    unit: str
    slip: str  # Likelier reading of a value outside the range
    of_width: bool = False  # True if the range is in mean widths of the crack

    def doubts(self, name: str, value: Any, width_mm: float | None) -> list[Fact]:
        """Return a question if the value, or the largest of a table along the crack, is outside the range."""
        times = width_mm if self.of_width else 1.0
        if value is None or times is None:
            return []
        value = max(row[-1] for row in value) if isinstance(value, tuple) else value
        low, high = times * self.low, times * self.high
        if low <= value <= high:
            return []
        usual = f"at most {high:.4g}" if low == 0 else f"{low:.3g} to {high:.4g}"
        usual = f"at least {low:.3g}" if high == math.inf else usual
        text = f"{name} is {value:g}, but usually {usual} {self.unit}: is it {self.slip}?"
        return [doubt(f"setting.{name}", text, value, self.unit)]


def doubts_of(*tables: Settings | None, width_mm: float | None = None) -> tuple[Fact, ...]:
    """Return a question for each setting outside its likely range.

    Without the crack's mean width, no setting is doubted whose range depends on it.
    """
    fields = ((table, *field) for table in tables if table for field in type(table).model_fields.items())
    return tuple(
        question
        for table, name, field in fields
        for likely in field.metadata
        if isinstance(likely, Likely)
        for question in likely.doubts(name, getattr(table, name), width_mm)
    )
