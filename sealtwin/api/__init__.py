"""The Python interface. This file contains the errors, records and checks that all of its modules use."""

import hashlib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.errors import InputError, NumericalError, SealtwinError
from sealtwin.core.facts import Fact
from sealtwin.core.files import sha256
from sealtwin.core.progress import Progress, progress_for_stderr, wanted
from sealtwin.core.records import Origins, Outline, Run, Solid, Trajectory
from sealtwin.core.settings import Settings, checked
from sealtwin.core.settings_text import KEYWORDS

__all__ = ["InputError", "NumericalError", "Run", "SealtwinError", "Solid"]

FilePath = str | PathLike[str]
Points = Sequence[Sequence[float]] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
"""Points (x, y), or rows of a position along the crack and a value, (n, 2)."""

Table = TypeVar("Table", bound=Settings)


def settings_from(kind: type[Table], function: str, keywords: Mapping[str, Any], **replaced: Any) -> Table:
    """Return settings of the type ``kind`` from the arguments of a function.

    ``keywords`` is the function's ``locals()``, and ``replaced`` contains values that replace some of them. None means
    the default. Raises InputError for a value or a keyword that is not allowed. The message begins with ``function``.
    """
    settings = keywords.get("keywords", {})
    if unknown := [name for name in settings if name not in KEYWORDS[function]]:
        allowed = ", ".join(sorted(KEYWORDS[function]))
        raise InputError(f"{function}: there is no keyword {unknown[0]}; allowed: {allowed}.")
    values = {**keywords, **settings, **replaced}
    return checked(kind, Path(function), {name: values.get(name) for name in kind.model_fields})


def warn(texts: Iterable[Fact | str]) -> None:
    """Issue each text as a RuntimeWarning. The warning shows the line that called the public function."""
    for text in texts:
        warnings.warn(str(text), RuntimeWarning, stacklevel=3)


def origins_of(record: object) -> dict[str, str]:
    """Return the origins of ``record``: the crack, the solid and the path from which it was computed.

    A crack, a solid or a path is also its own origin. Each origin is described by its main figure and a digest.
    """
    origins = dict[str, str](getattr(record, "made_of", ()))
    if isinstance(record, Outline):
        kind, content = "crack", [record.centreline_mm, record.left_wall_mm, record.right_wall_mm]
    elif isinstance(record, Solid):
        kind, content = "solid", [record.depth_mm, *vars(record.sections).values()]
    elif isinstance(record, Trajectory):
        kind, content = "path", [record.t_s, record.position_mm, record.flow_mm3_s]
    else:
        return origins
    # Numbers are rounded as in a run folder, to five decimals.
    numbers = np.concatenate([np.ravel(np.round(part, 5)) for part in content if part is not None]) + 0.0
    (first, value), *_ = record.main_figures.items()
    return origins | {kind: f"{first} {value}, digest {sha256_of(numbers)[:8]}"}


def of_one_crack(function: str, *records: object) -> Origins:
    """Return the crack, the solid and the path from which all ``records`` were computed.

    Raises InputError if two records were computed from different cracks, solids or paths. A record that is None, or
    that was not made by this interface, is not checked.
    """
    firsts = dict[str, tuple[str, object]]()
    for record in records:
        for kind, origin in origins_of(record).items():
            first, other = firsts.setdefault(kind, (origin, record))
            if first != origin:
                raise InputError(
                    f"{function}: {record} belongs to the {kind} with {origin}, but {other} belongs to another one, "
                    f"with {first}. Compute both from the same one; in a notebook, run the cells in between again."
                )
    return tuple((kind, origin) for kind, (origin, _) in firsts.items())


def shown_progress(progress: bool | None) -> Progress:
    """Return the progress display for an argument ``progress``.

    Nothing is shown if ``progress`` is False, or if it is None outside terminals and notebooks.
    """
    return progress_for_stderr() if wanted(progress) else Progress()


def require_kinds(function: str, **values: tuple[object, type]) -> None:
    """Raise InputError with the name of the argument if a value is not an instance of its class."""
    for name, (value, kind) in values.items():
        if not isinstance(value, kind):
            raise InputError(f"{function}: {name} is a {type(value).__name__}; give a {kind.__name__}.")


def path_or_none(path: FilePath | None) -> Path | None:
    return None if path is None else Path(path)


def file_of(value: FilePath, name: str) -> Path:
    """Return the path in the argument ``name``. Raises InputError with that name if there is no such file."""
    if not isinstance(value, str | PathLike):
        raise InputError(f"{name}: expected the path of a file or a NumPy array, but got {type(value).__name__}.")
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
