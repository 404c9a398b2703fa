"""Read and check a nozzle's path with speed and flow from a CSV, which 'sealtwin plan' or a user writes."""

from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.number_tables import read_columns
from sealtwin.core.records import Floats, Trajectory
from sealtwin.core.settings import Settings

BOUNDS = {
    "t_s": (0.0, 1e5),
    "x_mm": (-10_000.0, 10_000.0),
    "y_mm": (-10_000.0, 10_000.0),
    "z_mm": (0.1, 100.0),
    "flow_mm3_s": (0.0, 1e6),
    "speed_mm_s": (0.0, 1000.0),
}
COLUMNS = ("t_s", "x_mm", "y_mm", "z_mm", "speed_mm_s", "flow_mm3_s")
NEEDED = tuple(name for name in COLUMNS if name != "speed_mm_s")
MOST_ROWS = 1500  # Largest number of rows; a trial's file contains all columns
SPEED_OFF = 2e-3  # Largest relative difference of a stated speed from that of places and times, because of rounding
# Not strict: a discriminator runs before the check, and pydantic then does not accept a list from JSON as a tuple.
Column = Annotated[tuple[float, ...], Field(min_length=2, max_length=MOST_ROWS, strict=False)]


class PathTable(Settings):
    """Columns of a planned path, in the sample's frame. A row applies until the next one; the last one has no flow."""

    t_s: Column
    """Time at which the nozzle is at the row's position. Times must increase from row to row."""
    x_mm: Column
    """Position of the nozzle's tip along x, measured to the right from the face's lower left corner."""
    y_mm: Column
    """Position of the nozzle's tip along y, measured upward in the photo from the face's lower left corner."""
    z_mm: Column
    """Height of the nozzle's tip above the face."""
    flow_mm3_s: Column
    """Flow between this row's position and that of the next row."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        columns = self.model_dump()
        if len({len(values) for values in columns.values()}) > 1:
            raise ValueError("its columns differ in length; give a number for every column in every row")
        if fault := _first_fault(columns):
            row, sentence = fault
            raise ValueError(f"row {row + 1}: {sentence}")
        return self

    @property
    def place_mm(self) -> Floats:
        return np.column_stack([self.x_mm, self.y_mm, self.z_mm])

    @property
    def flow(self) -> Floats:
        """Flow from each row to the next, (n,)."""
        return np.array(self.flow_mm3_s)

    @property
    def speed_mm_s(self) -> Floats:
        """Speed from each row to the next, (n,). It is 0 in the last row."""
        return np.append(np.diff(arc_length(self.place_mm)) / np.diff(self.t_s), 0.0)


def planned_path(trajectory: Trajectory) -> PathTable:
    """Return a trajectory as columns of a trial, to the six decimals of its CSV."""
    columns = np.column_stack([trajectory.t_s, trajectory.position_mm, trajectory.flow_mm3_s]).round(6).T.tolist()
    return PathTable(**dict(zip(NEEDED, map(tuple, columns), strict=True)))


def read_planned_path(path: Path) -> PathTable:
    """Read a planned path. Raises InputError with file, row, column and value.

    A column speed_mm_s is optional, for people who read the file. It must agree with places and times.
    """
    columns = read_columns(path, BOUNDS, NEEDED, (2, MOST_ROWS))
    rows, stated = columns.pop("row"), columns.pop("speed_mm_s", None)
    if fault := _first_fault(columns):
        row, sentence = fault
        raise InputError(f"{path}, row {rows[row]:g}: {sentence}.")
    planned = PathTable(**{name: tuple(values) for name, values in columns.items()})
    if stated is not None:
        off = np.abs(np.array(stated) - planned.speed_mm_s)[:-1] > SPEED_OFF * planned.speed_mm_s[:-1] + 1e-5
        if off.any():
            row = int(off.argmax())
            raise InputError(
                f"{path}, row {rows[row]:g}, column speed_mm_s: {stated[row]:g}, but its places and times give "
                f"{planned.speed_mm_s[row]:.6g}. Correct one of them, or leave the column out."
            )
    return planned


def _first_fault(columns: dict[str, tuple[float, ...]] | dict[str, list[float]]) -> tuple[int, str] | None:
    """Return the row of the first fault, counted from 0, and a sentence about it; None if there is no fault."""
    t_s, flow = np.array(columns["t_s"]), np.array(columns["flow_mm3_s"])
    for name in NEEDED:
        low, high = BOUNDS[name]
        values = np.array(columns[name])
        outside = ~((values >= low) & (values <= high))
        if outside.any():
            row = int(outside.argmax())
            return row, f"{name} is {values[row]:g}; {low:g} to {high:g} is allowed"
    if (late := np.diff(t_s) <= 0).any():
        row = int(late.argmax()) + 1
        return row, f"t_s is {t_s[row]:g} after {t_s[row - 1]:g}; times must increase"
    if flow[-1] != 0:
        return len(flow) - 1, f"flow_mm3_s is {flow[-1]:g}; the last row ends the path and must have 0"
    if not flow.any():
        return 0, "flow_mm3_s is 0 in all rows; a path must give sealant"
    still = np.linalg.norm(np.diff([columns[name] for name in ("x_mm", "y_mm", "z_mm")], axis=1), axis=0) == 0
    if still.any():
        row = int(still.argmax())
        return row, "the nozzle does not move until the next row; move it slowly, since robot programs have no stops"
    return None


PlanOrFile = Annotated[
    Annotated[Path, Tag("one")] | Annotated[PathTable, Tag("several")],
    Discriminator(lambda value: "one" if isinstance(value, str | Path) else "several"),
]
"""A planned path: its columns, or the name of a file that contains them."""
