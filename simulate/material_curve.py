"""Sealant whose viscosity and yield stress change with age: its table, and the file of the table.

Between rows, the yield stress and the logarithm of the viscosity are linear in age. Before the first age and after the
last, both are constant.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, Tag

from sealtwin.core.plain_files import read_columns
from sealtwin.core.records import Floats
from sealtwin.core.settings import ByForm, Settings, checked

MAX_ROWS = 1000
BOUNDS = {
    "age_s": (0.0, 1e7),
    # The limit is above 0, since a logarithm is taken. Air has 2e-5.
    "viscosity_pa_s": (1e-6, 1e4),
    "yield_stress_pa": (0.0, 1e4),
}
"""Smallest and largest allowed value of each column."""
# Not strict: after a validator with mode="before", pydantic no longer accepts a JSON list as a tuple.
Column = Annotated[tuple[float, ...], Field(min_length=2, max_length=MAX_ROWS, strict=False)]


class Course(NamedTuple):
    """Viscosity and yield stress over age. All arrays are (n,)."""

    age_s: Floats
    viscosity_pa_s: Floats
    yield_stress_pa: Floats

    def at_age(self, age_s: Floats) -> tuple[Floats, Floats]:
        """Return viscosity and yield stress at each age, (m,) each."""
        stress_pa, first = np.interp(age_s, self.age_s, self.yield_stress_pa), self.viscosity_pa_s[0]
        if (self.viscosity_pa_s == first).all():
            return np.full_like(stress_pa, first), stress_pa
        return np.exp(np.interp(age_s, self.age_s, np.log(self.viscosity_pa_s))), stress_pa


class MaterialCurve(Settings):
    """Columns of a material's table, all of the same length. A CSV file has the same columns."""

    age_s: Column
    """Time since the sealant left the nozzle, increasing from row to row."""
    viscosity_pa_s: Column
    """Dynamic viscosity. Its logarithm is interpolated linearly."""
    yield_stress_pa: Column | None = None
    """Yield stress (Bingham). It is interpolated linearly. Default: 0."""

    def _check(self) -> None:
        if fault := _first_fault(self.model_dump(exclude_none=True)):
            row, column, problem = fault
            raise ValueError(f"{column}, row {row + 1}: {problem}")

    @property
    def course(self) -> Course:
        stress_pa = self.yield_stress_pa or (0.0,) * len(self.age_s)
        return Course(*(np.array(column) for column in (self.age_s, self.viscosity_pa_s, stress_pa)))


if TYPE_CHECKING:
    # A keyword accepts a file's name or a mapping. The field then has one of the types below.
    CurveOrFile = Any
else:
    CurveOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[MaterialCurve, Tag("several")], ByForm]


def read_curve(path: Path) -> MaterialCurve:
    """Read the CSV table of a material. Raises InputError with file, row, column and value."""
    columns = read_columns(path, BOUNDS, ["age_s", "viscosity_pa_s"], (2, MAX_ROWS), ["age_s"])
    columns.pop("row")
    return checked(MaterialCurve, path, columns)


def _first_fault(columns: Mapping[str, Sequence[float]]) -> tuple[int, str, str] | None:
    """Return row (counted from 0), column and fault of the first invalid value. None if all values are valid."""
    longest = max(len(values) for values in columns.values())
    for name, values in columns.items():
        low, high = BOUNDS[name]
        if len(values) < longest:
            return len(values), name, f"this column has no value here, but another has {longest} values"
        for row, value in enumerate(values):
            if not low <= value <= high:
                return row, name, f"{value:g}; {low:g} to {high:g} is allowed"
    for row, (before, value) in enumerate(pairwise(columns["age_s"]), start=1):
        if not value > before:
            return row, "age_s", f"{value:g} follows {before:g}; values must become larger from row to row"
    return None
