"""A liquid weighed into a crack: its properties, and its mass and level after each step, also from a CSV."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from sealtwin.core.errors import InputError
from sealtwin.core.number_tables import read_columns
from sealtwin.core.records import Floats
from sealtwin.core.settings import Settings

BOUNDS = {"mass_g": (1e-3, 1e5), "level_mm": (-500.0, 0.0)}
HINTS = {"level_mm": ", since levels below the face are negative"}
MOST_ROWS = 1000
# Not strict: after the validator of ``FillOrFile``, pydantic no longer accepts a JSON list as a tuple.
Column = Annotated[tuple[float, ...], Field(min_length=1, max_length=MOST_ROWS, strict=False)]


class WeighedFill(Settings):
    """The table [crack.fill]: the crack's volume, from a weighed liquid. Level the sample, and tape its open ends."""

    file: Path | None = None
    """CSV with the columns mass_g and level_mm and one row for each step. In a run's folder, the columns replace it."""
    mass_g: Column | None = None
    """Mass of all liquid in the crack after each step. Zero the scale with the empty sample on it."""
    level_mm: Column | None = None
    """Height of the liquid above the face after each step, measured at the lowest line of the meniscus. It is negative
    below the face, and 0 if the liquid is flush with the face."""
    density_kg_m3: float = Field(default=998.0, ge=500, le=3000)
    """Density of the liquid. The default is that of water at 20 C, within 0.2 %."""
    surface_tension_n_m: float = Field(default=0.030, ge=0, le=0.1)
    """Surface tension of the liquid, which lifts its surface at the walls above its lowest line. Default: water with a
    drop of detergent. Pure water, with 0.073, wets poorly. 0 if the levels are means across the crack."""
    mass_sd_g: float = Field(default=0.05, gt=0, le=100)
    """Standard deviation of one weighing. The default is half of the last digit of a kitchen scale."""
    level_sd_mm: float = Field(default=0.2, gt=0, le=10)
    """Standard deviation of one reading of the level."""
    flush_sd_mm: float = Field(default=0.1, gt=0, le=10)
    """Standard deviation of a level of 0, which the reflection on the liquid's surface shows."""

    @model_validator(mode="after")
    def _file_or_columns(self) -> Self:
        given = [name for name in ("mass_g", "level_mm") if getattr(self, name) is not None]
        if self.file is None and len(given) < 2:
            raise ValueError(
                "give either file, a CSV with the columns mass_g and level_mm, or both mass_g and level_mm"
            )
        if self.file is not None and given:
            raise ValueError(f"{given[0]} and file are both given, and file has that column: give one")
        if given and (fault := _fault(self.mass_g or (), self.level_mm or ())):
            row, column, reason = fault
            raise ValueError(f"{column}, row {row + 1}: {reason}")
        return self

    def loaded(self, folder: Path) -> Self:
        """Return the fill with the columns in place of their file in ``folder``.

        Raises InputError with file, row, column and value.
        """
        if self.file is None:
            return self
        path = folder / self.file
        # Bounds are checked below, with a message that states what to do.
        columns = read_columns(path, dict.fromkeys(BOUNDS, (-np.inf, np.inf)), list(BOUNDS), (1, MOST_ROWS))
        if fault := _fault(columns["mass_g"], columns["level_mm"]):
            row, column, reason = fault
            raise InputError(f"{path}, row {columns['row'][row]:g}, column {column}: {reason}.")
        return self.model_copy(update={"file": None, **{name: tuple(columns[name]) for name in BOUNDS}})

    @property
    def volume_mm3(self) -> Floats:
        """Volume in the crack after each step, (k,). Raises ValueError unless the file is loaded."""
        return 1e6 * self._column(self.mass_g) / self.density_kg_m3

    @property
    def levels_mm(self) -> Floats:
        """Level read after each step, (k,). Raises ValueError unless the file is loaded."""
        return self._column(self.level_mm)

    def _column(self, values: tuple[float, ...] | None) -> Floats:
        if values is None:
            raise ValueError("the fill is a file that is not read yet; call loaded first")
        return np.array(values)


def _fault(masses_g: Sequence[float], levels_mm: Sequence[float]) -> tuple[int, str, str] | None:
    """Return row from 0, column and reason of the first invalid value, or None."""
    if len(masses_g) != len(levels_mm):
        return (
            min(len(masses_g), len(levels_mm)),
            "mass_g, level_mm",
            "one column has more rows than the other; give both values in every row",
        )
    for name, values in (("mass_g", masses_g), ("level_mm", levels_mm)):
        low, high = BOUNDS[name]
        for row, value in enumerate(values):
            if not low <= value <= high:
                return row, name, f"{value:g}; {low:g} to {high:g} is allowed{HINTS.get(name, '')}"
            if row and value <= values[row - 1]:
                before = f"{value:g} after {values[row - 1]:g}"
                return row, name, f"{before}; each step includes all that was poured before, so it must be higher"
    return None


FillOrFile = Annotated[WeighedFill, BeforeValidator(lambda given: {"file": given} if isinstance(given, str) else given)]
"""The table [crack.fill], or only the name of its file."""
