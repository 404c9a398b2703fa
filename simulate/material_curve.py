"""Sealant whose viscosity and yield stress change with age or temperature: tables, and files of tables.

A rheometer measures viscosity and yield stress over age. The data sheet of a hot-poured sealant gives them over
temperature, and a second table gives the temperature over age. Between rows, the yield stress and the logarithm of the
viscosity are linear in age or temperature. Before the first age and after the last, both are constant. Temperatures are
not extrapolated: a cooling table that leaves the curve's temperatures is refused.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self, TypeVar

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from sealtwin.core.errors import InputError, present
from sealtwin.core.plain_files import read_columns
from sealtwin.core.records import Floats
from sealtwin.core.settings import Settings, checked

MAX_ROWS = 1000
BOUNDS = {
    "age_s": (0.0, 1e7),
    "temperature_c": (-273.15, 3000.0),
    # Above 0 for the logarithm; air has 2e-5.
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

    def at(self, age_s: Floats) -> tuple[Floats, Floats]:
        """Return viscosity and yield stress at each age, (m,) each."""
        stress_pa, first = np.interp(age_s, self.age_s, self.yield_stress_pa), self.viscosity_pa_s[0]
        if (self.viscosity_pa_s == first).all():
            return np.full_like(stress_pa, first), stress_pa
        return np.exp(np.interp(age_s, self.age_s, np.log(self.viscosity_pa_s))), stress_pa


class _Columns(Settings):
    @model_validator(mode="after")
    def _check(self) -> Self:
        if fault := _first_fault(self.columns):
            row, column, problem = fault
            raise ValueError(f"{column}, row {row + 1}: {problem}")
        return self

    @property
    def columns(self) -> dict[str, tuple[float, ...]]:
        """Columns of this table by name."""
        return self.model_dump(exclude_none=True)


Table = TypeVar("Table", bound=_Columns)


class MaterialCurve(_Columns):
    """Columns of a material's table, all of the same length. A CSV file has the same columns."""

    age_s: Column | None = None
    """Time since the sealant left the nozzle, increasing from row to row."""
    temperature_c: Column | None = None
    """Temperature instead of age, increasing or decreasing from row to row. It needs ``cooling``."""
    viscosity_pa_s: Column
    """Dynamic viscosity. Its logarithm is interpolated linearly."""
    yield_stress_pa: Column | None = None
    """Yield stress (Bingham). It is interpolated linearly. Default: 0."""

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.age_s is None) == (self.temperature_c is None):
            raise ValueError("give either the column age_s or the column temperature_c, not both")
        return self


class CoolingCurve(_Columns):
    """Columns of a table that gives the sealant's temperature by age."""

    age_s: Column
    """Time since the sealant left the nozzle, increasing from row to row."""
    temperature_c: Column
    """Temperature at each age. It is interpolated linearly."""


ByForm = Discriminator(lambda value: "one" if isinstance(value, str | Path) else "several")
"""Discriminator of a table that is given by a file's name or by its columns. A validation error refers to the form that
the user gave."""
if TYPE_CHECKING:
    # A keyword takes a file's name or a mapping, and the field then has one of these types.
    CurveOrFile = CoolingOrFile = Any
else:
    CurveOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[MaterialCurve, Tag("several")], ByForm]
    CoolingOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[CoolingCurve, Tag("several")], ByForm]


def read_table(path: Path, kind: type[Table]) -> Table:
    """Read a CSV table of a material or of a cooling. Raises InputError with file, row, column and value."""
    fields = kind.model_fields
    needed = [name for name, field in fields.items() if field.is_required()]
    columns = read_columns(path, {name: BOUNDS[name] for name in fields}, needed, (2, MAX_ROWS))
    rows = columns.pop("row")
    if fault := _first_fault(columns):
        number, name, problem = fault
        raise InputError(f"{path}, row {rows[number]:g}, column {name}: {problem}.")
    return checked(kind, path, columns)


def fault_of(curve: MaterialCurve | None, cooling: CoolingCurve | None, file: Path | None = None) -> str | None:
    """Return why two tables do not fit each other. Returns None if they do.

    ``file`` is the file of the cooling table, if it was read from one.
    """
    if curve is None:
        problem = "cooling is given without curve: add curve, a table of viscosity_pa_s over temperature_c"
        return None if cooling is None else problem
    if curve.temperature_c is None:
        problem = "fluid.cooling cannot be combined with a fluid.curve over age_s: leave fluid.cooling out"
        return None if cooling is None else problem
    if cooling is None:
        return "fluid.curve is over temperature_c: give fluid.cooling, the table of the temperature over age_s"
    low, high = min(curve.temperature_c), max(curve.temperature_c)
    for row, (age_s, temperature_c) in enumerate(zip(cooling.age_s, cooling.temperature_c, strict=True), start=1):
        if not low <= temperature_c <= high:
            # The first row of a file is its header.
            where = f"fluid.cooling, row {row}" if file is None else f"{file}, row {row + 1}"
            return (
                f"{where}, column temperature_c: {temperature_c:g} at {age_s:g} s is outside the curve's {low:g} to "
                f"{high:g}; give a curve that includes it"
            )
    return None


def course_of_tables(curve: MaterialCurve, cooling: CoolingCurve | None) -> Course:
    """Join two tables that fit each other into one table over age. It is also exact between its rows."""
    stress_pa = curve.yield_stress_pa or (0.0,) * len(curve.viscosity_pa_s)
    if curve.age_s is not None:
        return Course(*(np.array(column) for column in (curve.age_s, curve.viscosity_pa_s, stress_pa)))
    cooling = present(cooling, "cooling")
    order = np.argsort(np.array(curve.temperature_c))
    known_c = np.array(curve.temperature_c)[order]
    over_temperature = Course(known_c, np.array(curve.viscosity_pa_s)[order], np.array(stress_pa)[order])
    ages_s, cooled_c = np.array(cooling.age_s), np.array(cooling.temperature_c)
    knots = [ages_s]
    # The temperature is linear between two ages; a row of the curve that it passes needs a row of the result.
    for k in range(len(ages_s) - 1):
        begin_c, end_c = cooled_c[k : k + 2]
        passed_c = known_c[(known_c > min(begin_c, end_c)) & (known_c < max(begin_c, end_c))]
        knots.append(ages_s[k] + (passed_c - begin_c) / (end_c - begin_c or 1.0) * (ages_s[k + 1] - ages_s[k]))
    age_s = np.unique(np.concatenate(knots))
    return Course(age_s, *over_temperature.at(np.interp(age_s, ages_s, cooled_c)))


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
    # Rows are ordered by age, or by temperature in a table without age.
    ordered = next((name for name in ("age_s", "temperature_c") if name in columns), None)
    if ordered is not None:
        steps = np.sign(np.diff(columns[ordered]))
        wanted = 1.0 if ordered == "age_s" else steps[0] or 1.0
        if wrong := np.flatnonzero(steps != wanted).tolist():
            row, way = wrong[0] + 1, "larger" if wanted > 0 else "smaller"
            before, value = columns[ordered][row - 1], columns[ordered][row]
            return row, ordered, f"{value:g} follows {before:g}; values must become {way} from row to row"
    return None
