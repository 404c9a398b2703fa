"""The Python interface. This file contains the errors and the check of arguments that all of its modules use."""

import difflib
import hashlib
import inspect
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import wraps
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.errors import InputError, NumericalError, SealtwinError
from sealtwin.core.facts import Fact
from sealtwin.core.files import sha256
from sealtwin.core.progress import Progress, progress_for_stderr, wanted
from sealtwin.core.settings import Settings, checked
from sealtwin.core.settings_text import entry_of

__all__ = ["InputError", "NumericalError", "SealtwinError"]

FilePath = str | PathLike[str]
Points = Sequence[Sequence[float]] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
"""Points (x, y), or rows of a position along the crack and a value, (n, 2)."""

Table = TypeVar("Table", bound=Settings)
Function = TypeVar("Function", bound=Callable[..., Any])
NUMBERS: dict[Any, type] = {int: Integral, float: Real}

_shown = set[tuple[object, ...]]()


def public(*kinds: type[Settings]) -> Callable[[Function], Function]:
    """Check the arguments of a public function, and document those that are settings.

    The settings are the arguments and the keys of the ``TypedDict`` of ``**keywords`` that are fields of the tables
    ``kinds``. help() shows their docstrings and defaults. Raises InputError with the names of the function and the
    argument if an argument is missing, unknown or of a wrong class. Messages from below name settings as arguments.
    """
    owners = {name: kind for kind in kinds for name in kind.model_fields}

    def decorated(function: Function) -> Function:
        name, signature, text = function.__name__, inspect.signature(function), inspect.cleandoc(function.__doc__ or "")
        head, rest = text.split("\n\nReturns\n")
        written = {name for line in head.splitlines() for name in line.split(", ")}
        parameters = dict(signature.parameters)
        for typed in get_args(parameters.pop("keywords").annotation) if "keywords" in parameters else ():
            parameters |= {key: inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY) for key in typed.__annotations__}
        for key in parameters.keys() & owners:
            if not (field := owners[key].model_fields[key]).is_required():
                parameters[key] = parameters[key].replace(default=field.default)
        settings = [key for key in parameters if key in owners]
        entries = [entry_of(owners[key], key, parameters[key].default) for key in settings if key not in written]
        whole = signature.replace(parameters=[*parameters.values()])
        # A parenthesis that begins with a flag is for the command line, and a quoted command stays as it is.
        names = "|".join(key.replace("_", "[-_]") for key in parameters)
        other = re.compile(rf" \((?:as )?--[^)]*\)|('sealtwin [^']*')|(?:\[?\b[a-z]+\.|--)({names})\b\]?")

        @wraps(function)
        def call(*arguments: Any, **keywords: Any) -> Any:
            if unknown := [key for key in keywords if key not in parameters]:
                near = difflib.get_close_matches(unknown[0], parameters, n=2)
                allowed = f"did you mean {' or '.join(near)}?" if near else f"allowed: {', '.join(sorted(parameters))}."
                raise InputError(f"{name}: there is no keyword {unknown[0]}; {allowed}")
            try:
                values = whole.bind(*arguments, **keywords).arguments
            except TypeError as fault:
                unnamed = [key for key, parameter in parameters.items() if parameter.kind is not parameter.KEYWORD_ONLY]
                allowed = f"the arguments are {', '.join(parameters)}; without a name only {', '.join(unnamed)}."
                raise InputError(f"{name}: {fault}; {allowed}") from None
            for key, value in values.items():
                if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
                    values[key] = value.item()
                if key not in owners:
                    _require_kind(name, key, values[key], parameters[key].annotation)
            try:
                return function(**values)
            except InputError as fault:
                text = other.sub(lambda word: word[1] or (word[2] or "").replace("-", "_"), str(fault))
                fault.args = (text if text.startswith(name) else f"{name}: {text}",)
                raise

        call.__doc__ = "\n".join([head, *entries, "", "Returns", rest])
        vars(call)["__signature__"] = whole
        return call  # pyright: ignore[reportReturnType]

    return decorated


def _require_kind(function: str, name: str, value: object, annotation: Any) -> None:
    """Raise InputError if the classes of an annotation are known, and ``value`` is an instance of none of them."""
    parts = get_args(annotation) if isinstance(annotation, UnionType) else (annotation,)
    kinds: list[Any] = [NUMBERS.get(part, get_origin(part) or part) for part in parts]
    if Any in kinds or not all(isinstance(kind, type) for kind in kinds) or isinstance(value, tuple(kinds)):
        return
    kind = "None" if value is None else f"of the class {type(value).__name__}"
    allowed = dict.fromkeys(part.__name__ for part in parts if part is not type(None))
    raise InputError(f"{function}: {name} is {kind}; give {' or '.join(allowed)}.")


def settings_from(kind: type[Table], function: str, keywords: Mapping[str, Any], **others: Any) -> Table:
    """Return settings of the type ``kind`` from the keywords and ``others`` that it has. None means the default.

    Raises InputError for a value that is not allowed. The message begins with ``function``.
    """
    values = {**keywords, **others}
    return checked(kind, Path(function), {name: values.get(name) for name in kind.model_fields})


def warn(texts: Iterable[Fact | str]) -> None:
    """Issue each text as a RuntimeWarning at the line that called the public function, once for each line."""
    frame = sys._getframe()
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("sealtwin."):
        frame = frame.f_back
    line = frame.f_code.co_filename, frame.f_lineno
    for text in map(str, texts):
        # Python forgets what it has shown if a library changes the filters for a moment, as Matplotlib does.
        warning = frame.f_code, line, text, repr(warnings.filters)
        if warning not in _shown:
            registry = dict[str | tuple[str, type[Warning], int], int]()
            warnings.warn_explicit(text, RuntimeWarning, *line, registry=registry)
            # Beside its version, the registry has an entry if the filters want the warning once for each line.
            if len(registry) > 1:
                _shown.add(warning)


def shown_progress(progress: bool | None) -> Progress:
    """Return the progress display for an argument ``progress``.

    Nothing is shown if ``progress`` is False, or if it is None outside terminals and notebooks.
    """
    return progress_for_stderr() if wanted(progress) else Progress()


def path_or_none(path: FilePath | None) -> Path | None:
    return None if path is None else Path(path)


def file_of(value: FilePath, name: str) -> Path:
    """Return the path in the argument ``name``. Raises InputError with that name if there is no such file."""
    path = Path(value)
    if not path.is_file():
        raise InputError(f"{path}: no such file; {name} must be an existing file.")
    return path


def sha256_of(content: Path | NDArray[Any]) -> str:
    """Return the SHA-256 hash of the bytes of a file or an array."""
    if isinstance(content, Path):
        return sha256(content)
    return hashlib.sha256(np.ascontiguousarray(content).tobytes()).hexdigest()


def content_of(record: Any) -> dict[str, Any]:
    """Return the fields of a dataclass by name, for example to make a record of a subclass. Values are not copied."""
    return {field.name: getattr(record, field.name) for field in fields(record)}
