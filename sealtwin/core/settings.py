"""Read settings from TOML files and check them against a model. Each fault is reported in one sentence."""

import difflib
import json
import math
import re
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Discriminator, ValidationError, model_validator
from pydantic_core import ErrorDetails

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.facts import Fact, Facts, doubt
from sealtwin.core.plain_files import read_text
from sealtwin.core.settings_text import text_of_table

if TYPE_CHECKING:
    # Type checkers take the keywords and their types from the fields.
    from pydantic._internal._model_construction import ModelMetaclass as KeywordTables
else:

    class KeywordTables(type(BaseModel)):
        """Metaclass of settings tables. Keywords are checked like a file, and None counts as absent.

        help() shows the docstrings of the fields.
        """

        def __call__(cls, *unnamed: Any, **values: Any) -> BaseModel:
            if unnamed:
                raise InputError(f"{cls.__name__}: give each setting by name, as in {next(iter(cls.model_fields))}=...")
            return checked(cls, Path(cls.__name__), values)

        @property
        def __doc__(cls) -> str:
            return text_of_table(cls)


class _ByDefault:
    """Placeholder for a default value in a signature. The docstring states the value."""

    def __repr__(self) -> str:
        return "..."


class Settings(BaseModel, metaclass=KeywordTables):
    """Base class of the tables of a trial file. Each field has a docstring below it, and its unit in its name."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        # A quoted number such as "16" is refused as a mistake.
        strict=True,
    )

    def _check(self) -> None:
        """Raise ValueError if the settings contradict each other. Subclasses override this method."""

    @model_validator(mode="after")
    def _checked(self) -> Self:
        self._check()
        return self

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """Yield only the settings that the user gave. The others have their defaults."""
        return ((name, getattr(self, name)) for name in type(self).model_fields if name in self.model_fields_set)

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        # help() begins with the signature. With types and bounds, it would fill a page.
        names = [Parameter(name, Parameter.KEYWORD_ONLY, default=_ByDefault()) for name in cls.model_fields]
        cls.__signature__ = Signature(names)


Table = TypeVar("Table", bound=Settings)

LARGEST_BYTES = 200_000
"""Largest settings file that is read, in bytes. Usual files have some kilobytes."""
DEEP_KEY = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++\s*+\.\s*+){16}")
"""Pattern of a dotted key with 17 parts or more. Each part becomes a table, so very long keys would fill the memory."""
MAX_FAULTS = 8
"""Largest number of faults that are reported together."""
LONGEST_VALUE = 60
"""Largest number of characters that are shown of a faulty value."""
BRANCH = r"float|int|str|one|several|(literal|tuple)\[.*|constrained-.*"
"""Pattern of the name of a union's branch: pydantic's names, and our tags for one or several numbers."""
REASONS = {
    "missing": "should have more values",  # For a setting that may be a list
    "too_short": "has {actual_length} values; give at least {min_length}",
    "too_long": "has {actual_length} values; give at most {max_length}",
    "string_too_short": "should not be empty",
    "string_too_long": "should have at most {max_length} characters",
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
"""Text for each of pydantic's error types, with pydantic's names of the numbers in braces.

For other error types, pydantic's own message is shown."""


def read_settings(kind: type[Table], path: Path, *, name: str, starter: str) -> Table:
    """Read settings from a TOML file.

    Messages use ``name``, such as "trial file", and ``starter``, a sentence that says how to get such a file. Raises
    InputError if the file is missing, is not TOML, or has a key or a value that is not allowed. The message states the
    key, the value and what is allowed, for each fault.
    """
    return checked(kind, path, read_toml(path, name=name, starter=starter))


def read_toml(path: Path, *, name: str, starter: str) -> dict[str, Any]:
    """Read a TOML file without checking its keys. Has the same arguments and errors as ``read_settings``."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder; give the {name}.")
    if not path.is_file():
        raise InputError(f"{path}: no such file. {starter}.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: is larger than {LARGEST_BYTES} bytes, so it is not a {name}.")
    try:
        text = read_text(path, LARGEST_BYTES)
        if DEEP_KEY.search(text):
            raise InputError(
                f"{path}: a dotted key has more than 16 parts; tables in a {name} are at most two levels deep."
            )
        return tomllib.loads(text)
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text; a {name} is a TOML file. {starter}.") from None
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path}: not valid TOML: {fault}.") from None


class SettingsFaults(InputError):  # noqa: N818  The class contains all faults of the settings, not one error.
    """Settings that are not allowed, with all their faults."""

    def __init__(
        self, sentences: Sequence[str], faults: Sequence[tuple[str, str]] = (), types: Collection[str] = ()
    ) -> None:
        super().__init__("\n".join(sentences))
        self.sentences = sentences
        self.faults = faults  # Pairs of a dotted key and a sentence that describes the fault
        self.types = types  # Types of the faults: pydantic's names, and the names in a table's own checks


def checked(
    kind: type[Table], path: Path, content: Mapping[str, Any], origin: Callable[[str], str] | None = None
) -> Table:
    """Return ``content`` as settings. Raises InputError for a key or a value that is not allowed.

    Lists, tuples and NumPy arrays are equivalent. None counts as absent. Messages begin with ``path``. If ``content``
    comes from several files, they begin with ``origin(dotted_key)``.
    """
    if as_text(path) != str(path):
        raise InputError(
            f"{as_text(path)}: the name is not UTF-8, so a trial file cannot refer to it. Rename the file."
        )
    try:
        values = without_none(content)
        # When they read JSON, strict types accept a list as a tuple and a string as a path.
        text = json.dumps(values, default=as_json)
    except ValueError:
        # Python reads hexadecimal numbers of any length, but refuses to write thousands of digits.
        raise InputError(f"{path}: a whole number has thousands of digits; no setting accepts it.") from None
    try:
        return kind.model_validate_json(text)
    except ValidationError as fault:
        named = origin or (lambda _: str(path))
        faults, types = _faults(kind, fault.errors()), {error["type"] for error in fault.errors()}
        raise SettingsFaults([f"{named(key)}: {text}" for key, text in faults], faults, types) from None


def without_none(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def as_json(value: Any) -> Any:
    """Return a value converted to types that JSON has, without importing NumPy."""
    if isinstance(value, Settings):
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, Mapping):
        return dict(value)
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _faults(kind: type[Settings], errors: list[ErrorDetails]) -> list[tuple[str, str]]:
    """Return the dotted key and a sentence for each faulty value in the file.

    pydantic reports one error for each branch of a union. The errors for one value are merged into one sentence.
    """
    places: dict[str, list[ErrorDetails]] = {}
    for error in errors:
        # pydantic adds the name of a union's branch to the location of an error.
        parts = [part for part in error["loc"] if not re.fullmatch(BRANCH, str(part))]
        if error["type"] == "missing" and isinstance(parts[-1], int):
            parts.pop()
        places.setdefault(".".join(map(str, parts)), []).append(error)
    first = list(places.items())[:MAX_FAULTS]
    sentences = [(where, _fault(kind, where, faults)) for where, faults in first]
    more = len(places) - len(sentences)
    return [*sentences, ("", f"there are {more} more faults.")] if more else sentences


def _fault(kind: type[Settings], where: str, errors: list[ErrorDetails]) -> str:
    error, input_value = errors[0], errors[0]["input"]
    if error["type"] == "extra_forbidden":
        # These are the keys of the table that contains the misspelt key.
        table = table_of(kind, error["loc"])
        keys = sorted(table.model_fields) if table else []
        close = difflib.get_close_matches(str(error["loc"][-1]), keys, n=1)
        allowed = f"did you mean '{close[0]}'?" if close else f"allowed: {', '.join(keys)}."
        return f"{where}: no such key; {allowed}"
    if error["type"] == "missing" and isinstance(error["loc"][-1], int):
        return f"{where}: has {len(input_value)} values; {len(input_value) + len(errors)} are required."
    if error["type"] == "missing":
        return f"{where} is missing; it has no default, so you must give it."
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
    """Return the table that contains the key at ``location``, or None.

    Parts of the location that are not keys, such as list indices, are skipped.
    """
    table: type[Settings] | None = kind
    for part in location[:-1]:
        if table is not None and part in table.model_fields:
            table = _settings_in(table.model_fields[str(part)].annotation)
    return table


def names_file(kind: type[Settings], name: str) -> bool:
    """Return True if the setting with this dotted name accepts the name of a file."""
    annotation = _annotation_of(kind, name)
    # A table may be given as the name of the file that contains it.
    inner = _settings_in(annotation)
    return _has(annotation, Path) or (inner is not None and "file" in inner.model_fields)


def takes(kind: type[Settings], name: str, *parts: type) -> bool:
    """Return True if the setting with this dotted name accepts, or contains, a value of one of these types.

    A list counts as a tuple.
    """
    return any(_has(_annotation_of(kind, name), part) for part in parts)


def choices(kind: type[Settings], name: str) -> list[str]:
    """Return the texts that the setting with this dotted name allows. Empty if it is not a choice between texts."""
    parts = [part for part in get_args(_annotation_of(kind, name)) if part is not type(None)]
    texts = parts if not parts or isinstance(parts[0], str) else get_args(parts[0])
    return [text for text in texts if isinstance(text, str)]


def _annotation_of(kind: type[Settings], name: str) -> Any:
    """Return the type annotation of the setting with this dotted name, or None for an unknown name."""
    *_, key = parts = name.split(".")
    table = table_of(kind, parts)
    return None if table is None or key not in table.model_fields else table.model_fields[key].annotation


def _has(annotation: Any, kind: type) -> bool:
    """Return True if the annotation, or a part of it, is the type ``kind``."""
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
    """Return the settings class X if the annotation is X, X | None or tuple[X, ...], and otherwise None."""
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return annotation
    return next(filter(None, map(_settings_in, getattr(annotation, "__args__", ()))), None)


ByForm = Discriminator(lambda value: "one" if isinstance(value, str | Path) else "several")
"""Discriminator of a table that is given by a file's name or by its columns. A validation error refers to the form that
the user gave."""


class Likely(NamedTuple):
    """Usual range of a setting. A value outside the range is allowed, but leads to a warning: its unit may be wrong."""

    low: float
    high: float
    unit: str
    slip: str  # Probable meaning of a value outside the range
    of_width: bool = False  # True if the range is a multiple of the crack's mean width

    def doubts(self, name: str, value: Any, width_mm: float | None) -> list[Fact]:
        """Return a warning if the value is outside the range. In a table along the crack, the largest value is checked.

        The list is empty if the value is within the range, or is a word such as "auto".
        """
        times = width_mm if self.of_width else 1.0
        if value is None or times is None or isinstance(value, str):
            return []
        value = max(row[-1] for row in value) if isinstance(value, tuple) else value
        low, high = times * self.low, times * self.high
        if low <= value <= high:
            return []
        usual = f"at most {high:.4g}" if low == 0 else f"{low:.3g} to {high:.4g}"
        usual = f"at least {low:.3g}" if high == math.inf else usual
        text = f"{name} is {value:g}, but is usually {usual} {self.unit}: is it {self.slip}?"
        return [doubt(f"setting.{name}", text, value, self.unit)]


def doubts_of(*tables: Settings | None, width_mm: float | None = None) -> Facts:
    """Return a warning for each setting outside its usual range.

    Without ``width_mm``, the crack's mean width, settings whose range depends on it are not checked.
    """
    fields = ((table, *field) for table in tables if table for field in type(table).model_fields.items())
    return tuple(
        question
        for table, name, field in fields
        for likely in field.metadata
        if isinstance(likely, Likely)
        for question in likely.doubts(name, getattr(table, name), width_mm)
    )
