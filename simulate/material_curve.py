"""Sealant whose viscosity and yield stress change as it ages or cools: its tables, and the files that give them.

A rheometer gives viscosity and yield stress over age; the data sheet of a hot pour gives them over temperature, and a
second table the temperature over age. Between rows the logarithm of the viscosity and the yield stress are linear, in
age or in temperature; before the first age and after the last one both stay. Nothing is known beyond the temperatures
of a table: a cooling that leaves them is refused.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self, TypeVar

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from sealtwin.core.errors import InputError, present
from sealtwin.core.number_tables import read_columns
from sealtwin.core.records import Floats
from sealtwin.core.settings import Settings

MOST_ROWS = 1000
BOUNDS = {
    "age_s": (0.0, 1e7),
    "temperature_c": (-273.15, 3000.0),
    # Air has more, and a logarithm needs more than 0.
    "viscosity_pa_s": (1e-6, 1e4),
    "yield_stress_pa": (0.0, 1e4),
}
"""Least and largest value of each column."""
# A fluid is looked at before it is checked, and pydantic then no longer knows that a list was JSON's, and so a tuple.
Column = Annotated[tuple[float, ...], Field(min_length=2, max_length=MOST_ROWS, strict=False)]


class Course(NamedTuple):
    """Viscosity and yield stress over age, whichever tables they came from; all (n,)."""

    age_s: Floats
    viscosity_pa_s: Floats
    yield_stress_pa: Floats

    @property
    def softens(self) -> bool:
        """The yield stress falls at some age."""
        return bool((np.diff(self.yield_stress_pa) < 0).any())

    def at(self, age_s: Floats) -> tuple[Floats, Floats]:
        """Return viscosity and yield stress at each age, (m,) each."""
        viscosity = np.exp(np.interp(age_s, self.age_s, np.log(self.viscosity_pa_s)))
        return viscosity, np.interp(age_s, self.age_s, self.yield_stress_pa)


class _Columns(Settings):
    @model_validator(mode="after")
    def _check(self) -> Self:
        if fault := _first_fault(self.columns):
            row, column, said = fault
            raise ValueError(f"{column}, row {row + 1}: {said}")
        return self

    @property
    def columns(self) -> dict[str, tuple[float, ...]]:
        """The columns that are given, by name."""
        return self.model_dump(exclude_none=True)


Table = TypeVar("Table", bound=_Columns)


class MaterialCurve(_Columns):
    """Columns of a table of the material, each with a number for each row. A CSV file has the same columns."""

    age_s: Column | None = None
    """Time since the sealant left the nozzle, from row to row larger."""
    temperature_c: Column | None = None
    """Temperature in place of age, from row to row larger, or smaller; it needs ``cooling``."""
    viscosity_pa_s: Column
    """Dynamic viscosity; interpolated in its logarithm."""
    yield_stress_pa: Column | None = None
    """Yield stress (Bingham), interpolated linearly; left out, none."""

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.age_s is None) == (self.temperature_c is None):
            raise ValueError("give one column of age_s and temperature_c, and not both")
        return self


class CoolingCurve(_Columns):
    """Columns of a table of the sealant's temperature."""

    age_s: Column
    """Time since the sealant left the nozzle, from row to row larger."""
    temperature_c: Column
    """Temperature then; interpolated linearly."""


ByForm = Discriminator(lambda value: "one" if isinstance(value, str | Path) else "several")
"""Discriminator of a table that is a file's name or columns, so that an error is about the form given."""
if TYPE_CHECKING:
    # A keyword is given as a file's name or a mapping, and read back as these.
    CurveOrFile = CoolingOrFile = Any
else:
    CurveOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[MaterialCurve, Tag("several")], ByForm]
    CoolingOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[CoolingCurve, Tag("several")], ByForm]


def read_table(path: Path, kind: type[Table]) -> Table:
    """Read a CSV of a material or of a cooling. Raises InputError with file, row, column and value."""
    fields = kind.model_fields
    needed = [name for name, field in fields.items() if field.is_required()]
    columns = read_columns(path, {name: BOUNDS[name] for name in fields}, needed, (2, MOST_ROWS))
    rows = columns.pop("row")
    if fault := _first_fault(columns):
        number, name, said = fault
        raise InputError(f"{path}, row {rows[number]:g}, column {name}: {said}.")
    if kind is MaterialCurve and ("age_s" in columns) == ("temperature_c" in columns):
        raise InputError(f"{path}, row 1: one column of age_s and temperature_c is needed, and not both.")
    return kind.model_validate({name: tuple(values) for name, values in columns.items()})


def fault_of(curve: MaterialCurve, cooling: CoolingCurve | None, file: Path | None = None) -> str | None:
    """Say what keeps two tables from making a course, or None; ``file`` is that of the cooling, if it has one."""
    if curve.temperature_c is None:
        said = "fluid.cooling beside a fluid.curve over age_s: temperature is in neither; leave it out"
        return None if cooling is None else said
    if cooling is None:
        return "fluid.curve is over temperature_c: give fluid.cooling, the table of the temperature over age_s"
    low, high = min(curve.temperature_c), max(curve.temperature_c)
    for row, (age_s, temperature_c) in enumerate(zip(cooling.age_s, cooling.temperature_c, strict=True), start=1):
        if not low <= temperature_c <= high:
            # A file's first row has the names.
            where = f"fluid.cooling, row {row}" if file is None else f"{file}, row {row + 1}"
            return (
                f"{where}, column temperature_c: {temperature_c:g} at {age_s:g} s is outside the curve's {low:g} to "
                f"{high:g}, and nothing is known there; give a curve that reaches as far"
            )
    return None


def course_of_tables(curve: MaterialCurve, cooling: CoolingCurve | None) -> Course:
    """Join both tables, which ``fault_of`` finds sound, into one over age; between its rows it is theirs exactly."""
    stress_pa = curve.yield_stress_pa or (0.0,) * len(curve.viscosity_pa_s)
    if curve.age_s is not None:
        return Course(*(np.array(column) for column in (curve.age_s, curve.viscosity_pa_s, stress_pa)))
    cooling = present(cooling, "cooling")
    order = np.argsort(np.array(curve.temperature_c))
    known_c = np.array(curve.temperature_c)[order]
    over_temperature = Course(known_c, np.array(curve.viscosity_pa_s)[order], np.array(stress_pa)[order])
    ages_s, cooled_c = np.array(cooling.age_s), np.array(cooling.temperature_c)
    knots = [ages_s]
    # The temperature is linear between two ages, and bends in the material lie where it passes a row of the curve.
    for k in range(len(ages_s) - 1):
        begin_c, end_c = cooled_c[k : k + 2]
        passed_c = known_c[(known_c > min(begin_c, end_c)) & (known_c < max(begin_c, end_c))]
        knots.append(ages_s[k] + (passed_c - begin_c) / (end_c - begin_c or 1.0) * (ages_s[k + 1] - ages_s[k]))
    age_s = np.unique(np.concatenate(knots))
    return Course(age_s, *over_temperature.at(np.interp(age_s, ages_s, cooled_c)))


def _first_fault(columns: Mapping[str, Sequence[float]]) -> tuple[int, str, str] | None:
    """Return row from 0, column and words of the first value that cannot be, or None."""
    longest = max(len(values) for values in columns.values())
    for name, values in columns.items():
        low, high = BOUNDS[name]
        if len(values) < longest:
            return len(values), name, f"no value, where other columns have {longest}"
        for row, value in enumerate(values):
            if not low <= value <= high:
                return row, name, f"{value:g}; {low:g} to {high:g} is allowed"
    # Of both tables the first of these is what the rows are ordered by.
    ordered = next((name for name in ("age_s", "temperature_c") if name in columns), None)
    if ordered is not None:
        steps = np.sign(np.diff(columns[ordered]))
        wanted = 1.0 if ordered == "age_s" else steps[0] or 1.0
        if wrong := np.flatnonzero(steps != wanted).tolist():
            row, way = wrong[0] + 1, "larger" if wanted > 0 else "smaller"
            before, value = columns[ordered][row - 1], columns[ordered][row]
            return row, ordered, f"{value:g} after {before:g}; it must grow {way} from row to row"
    return None
