"""Types of arrays, arithmetic of arrays, checks of arrays that are read from JSON, and records shown in notebooks."""

from collections.abc import Mapping
from html import escape
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, PlainValidator
from pydantic.functional_serializers import PlainSerializer
from pydantic.json_schema import WithJsonSchema

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
Pixels = NDArray[np.uint8]  # RGB picture, (height, width, 3)


class HasSummary:
    """Base class of records that a notebook shows as one line or a small table, without their arrays.

    List it before other base classes, and give the dataclass ``repr=False``.
    """

    @property
    def main_figures(self) -> Mapping[str, str]:
        """Main figures of the record: name to value with unit."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name} {value}' for name, value in self.main_figures.items())})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        cells = ((escape(name), escape(value)) for name, value in self.main_figures.items())
        rows = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in cells)
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"


class ReadOnly:
    """Base class of frozen dataclasses whose arrays cannot be changed. A copy of a record is the record itself."""

    def __post_init__(self) -> None:
        vars(self).update({name: _read_only(value) for name, value in vars(self).items()})

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        # An array that was pickled can be changed again.
        vars(self).update({name: _read_only(value) for name, value in state.items()})

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self


def _read_only(value: Any) -> Any:
    """Return an array, or a tuple of arrays, that cannot be changed. The array's owner may still change it."""
    if isinstance(value, tuple) and type(value) is tuple:
        return tuple(map(_read_only, value))
    if isinstance(value, np.ndarray):
        value = value.view()
        value.setflags(write=False)
    return value


def _finite(value: Any) -> Floats:
    """Return a list as an array. Raises ValueError if it is not a list of finite numbers."""
    try:
        numbers = np.array(value, float)
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


def cross(first: NDArray[np.floating], second: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the vertical component of cross products, (...).

    It is positive if the second vector is to the left of the first in plan view.
    """
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def normals(corners: Floats) -> Floats:
    """Return the normal of each triangle, (f, 3). Its length is twice the triangle's area. ``corners`` is (f, 3, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def lengths(vectors: NDArray[np.number]) -> Floats:
    """Return the length of each row, (n,)."""
    return np.linalg.norm(vectors, axis=1)


def unit(vectors: Floats) -> Floats:
    """Return the rows of ``vectors``, (n, d), scaled to unit length. A zero vector remains zero."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(size > 0, size, 1.0)


def runs(where: Booleans) -> Integers:
    """Return the first index of each run of True values, and the index after its last, (runs, 2)."""
    return np.flatnonzero(np.diff(np.concatenate([[0], where.astype(int), [0]]))).reshape(-1, 2)


def require_as_long(record: object, first: str, *others: str) -> None:
    """Raise ValueError if an array in ``others`` differs in length from the array ``first``. An array may be None."""
    length = len(getattr(record, first))
    for name in others:
        if (values := getattr(record, name)) is not None and len(values) != length:
            raise ValueError(f"{name} has {len(values)} rows, but {first} has {length}")


def counted_up(count: Integers, first: Integers) -> tuple[Integers, Integers]:
    """Return each index k ``count[k]`` times, and for these copies the numbers first[k], first[k] + 1, and so on.

    A negative count is 0.
    """
    count = np.maximum(count, 0)
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - first, count)


def rms(values: Floats) -> float:
    """Return the root mean square of all values."""
    return float(np.sqrt(np.mean(values**2)))


def midpoints(values: Floats) -> Floats:
    """Return the means of successive values or rows, (n - 1, ...)."""
    return (values[1:] + values[:-1]) / 2


AS_LIST = PlainSerializer(np.ndarray.tolist, when_used="json")
OF_NUMBERS = WithJsonSchema({"type": "array", "items": {"type": "number"}})
Numbers = Annotated[Floats, PlainValidator(_finite), AS_LIST, OF_NUMBERS]  # Array that is checked when read from JSON
Points = Annotated[Floats, PlainValidator(_points)]  # Points, (n, 2), that are checked when read from JSON
FROM_JSON = ConfigDict(strict=True, allow_inf_nan=False)
