"""Settings of a liquid that is weighed into a crack: its properties, and its mass and level after each step."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BeforeValidator, Field

from sealtwin.core.errors import present
from sealtwin.core.plain_files import read_columns
from sealtwin.core.records import Floats
from sealtwin.core.settings import Settings

BOUNDS = {"mass_g": (1e-3, 1e5), "level_mm": (-500.0, 0.0)}
MAX_ROWS = 1000
LOADED = "a column of the fill, whose file loaded reads"
Mass = Annotated[float, Field(ge=1e-3, le=1e5)]
Level = Annotated[float, Field(ge=-500, le=0)]
# Not strict: after the validator of ``FillOrFile``, pydantic no longer accepts a JSON list as a tuple.
Rows = Field(default=None, min_length=1, max_length=MAX_ROWS, strict=False)


class WeighedFill(Settings):
    """The table [crack.fill], which gives the crack's volume from a weighed liquid.

    Level the sample, and tape its open ends.
    """

    file: Path | None = None
    """CSV with the columns mass_g and level_mm and one row for each step. In a run's folder, the columns replace the
    file."""
    mass_g: tuple[Mass, ...] | None = Rows
    """Mass of all liquid in the crack after each step. Zero the scale with the empty sample on it."""
    level_mm: tuple[Level, ...] | None = Rows
    """Height of the liquid above the face after each step, measured at the lowest line of the meniscus. It is negative
    below the face, and 0 if the liquid is flush with the face."""
    density_kg_m3: float = Field(default=998.0, ge=500, le=3000)
    """Density of the liquid. The default is the density of water at 20 °C, right to 0.2 %."""
    surface_tension_n_m: float = Field(default=0.030, ge=0, le=0.1)
    """Surface tension of the liquid, which lifts the liquid at the walls above the lowest line of its surface. Default:
    water with a drop of detergent. Pure water, with 0.073, wets poorly. Give 0 if the levels are means across the
    crack."""
    mass_sd_g: float = Field(default=0.05, gt=0, le=100)
    """Standard deviation of one weighing. The default is half of the last digit of a kitchen scale."""
    level_sd_mm: float = Field(default=0.2, gt=0, le=10)
    """Standard deviation of one reading of the level."""
    flush_sd_mm: float = Field(default=0.1, gt=0, le=10)
    """Standard deviation of a level of 0, which the reflection on the liquid's surface makes visible."""

    def _check(self) -> None:
        kinds = [value is not None for value in (self.file, self.mass_g, self.level_mm)]
        mass_g, level_mm = self.mass_g or (), self.level_mm or ()
        if kinds not in ([True, False, False], [False, True, True]) or len(mass_g) != len(level_mm):
            raise ValueError(
                "give file, a CSV with the columns mass_g and level_mm, or give both mass_g and level_mm with a "
                "value for every step"
            )
        if fault := _fall({"mass_g": mass_g, "level_mm": level_mm}):
            raise ValueError(f"{fault[1]}, row {fault[0] + 1}: {fault[2]}")

    def loaded(self, folder: Path) -> Self:
        """Return the fill with its columns instead of their file, which is in ``folder``.

        Raises InputError with file, row, column and value.
        """
        if self.file is None:
            return self
        path = folder / self.file
        columns = read_columns(path, BOUNDS, list(BOUNDS), (1, MAX_ROWS), list(BOUNDS))
        columns.pop("row")
        return self.model_copy(update={"file": None, **{name: tuple(values) for name, values in columns.items()}})

    @property
    def volume_mm3(self) -> Floats:
        """Volume in the crack after each step, (k,). Raises ValueError unless the file is loaded."""
        return 1e6 * np.array(present(self.mass_g, LOADED)) / self.density_kg_m3

    @property
    def levels_mm(self) -> Floats:
        """Level after each step, (k,). Raises ValueError unless the file is loaded."""
        return np.array(present(self.level_mm, LOADED))


def _fall(columns: Mapping[str, Sequence[float]]) -> tuple[int, str, str] | None:
    """Return row, column and reason of the first value that is not above the value before it. None if all are.

    Rows count from 0.
    """
    for name, values in columns.items():
        if (falls := np.diff(values) <= 0).any():
            row = int(falls.argmax()) + 1
            before = f"{values[row]:g} after {values[row - 1]:g}"
            return row, name, f"{before}. Each step includes all liquid poured before, so its value must be higher"
    return None


FillOrFile = Annotated[WeighedFill, BeforeValidator(lambda value: {"file": value} if isinstance(value, str) else value)]
"""The table [crack.fill], or only the name of its file."""
