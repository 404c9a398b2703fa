"""Arrays of records: their types, their checks as they are read from JSON, and what a notebook shows in their place."""

from collections.abc import Mapping
from html import escape
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, PlainValidator
from pydantic.functional_serializers import PlainSerializer
from pydantic.json_schema import WithJsonSchema

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
Pixels = NDArray[np.uint8]  # Picture, (height, width, 3), RGB


class Shown:
    """Base of records that a notebook shows as one line or a small table, in place of all their arrays.

    It is before other bases, and its dataclasses have ``repr=False``.
    """

    @property
    def main_figures(self) -> Mapping[str, str]:
        """Names and values that tell one record from another, with units."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name} {value}' for name, value in self.main_figures.items())})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        cells = ((escape(name), escape(value)) for name, value in self.main_figures.items())
        rows = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in cells)
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"


def _finite(value: Any) -> Floats:
    """Return a list as an array. Raises ValueError unless it has finite numbers."""
    try:
        numbers = np.array(value, dtype=float)
    except TypeError:
        raise ValueError("should be a list of numbers") from None
    if numbers.ndim == 0 or not np.isfinite(numbers).all():
        raise ValueError("should be a list of finite numbers")
    return numbers


def _points(value: Any) -> Floats:
    points = _finite(value)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError("should be a list of points [x, y]")
    return points


def unit(vectors: Floats) -> Floats:
    """Return vectors, a row each, scaled to unit length. A zero vector remains zero."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(size > 0, size, 1.0)


def require_as_long(record: object, first: str, *others: str) -> None:
    """Raise ValueError unless the arrays ``others`` of a record are as long as the array ``first``. None is skipped."""
    length = len(getattr(record, first))
    for name in others:
        if (values := getattr(record, name)) is not None and len(values) != length:
            raise ValueError(f"{name} has {len(values)} rows, but {first} has {length}")


def counted_up(count: Integers, first: Integers) -> tuple[Integers, Integers]:
    """Return ``count[k]`` copies of each index k, and for the copies the numbers first[k], first[k] + 1, and so on."""
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - first, count)


AS_LIST = PlainSerializer(np.ndarray.tolist, when_used="json")
OF_NUMBERS = WithJsonSchema({"type": "array", "items": {"type": "number"}})
Numbers = Annotated[Floats, PlainValidator(_finite), AS_LIST, OF_NUMBERS]  # Array in a record that is read from JSON
Points = Annotated[Floats, PlainValidator(_points)]  # Points in a record that is read from JSON, (n, 2)
FROM_JSON = ConfigDict(strict=True, allow_inf_nan=False)
