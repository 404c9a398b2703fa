"""Read and check a nozzle path with speed and flow from a CSV, written by 'sealtwin plan' or by a user."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, Tag

from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_columns
from sealtwin.core.records import Floats, Trajectory
from sealtwin.core.settings import ByForm, Settings

BOUNDS = {
    "t_s": (0.0, 1e5),
    "x_mm": (-10_000.0, 10_000.0),
    "y_mm": (-10_000.0, 10_000.0),
    "z_mm": (0.1, 100.0),
    "flow_mm3_s": (0.0, 1e6),
    "speed_mm_s": (0.0, 1000.0),
}
NEEDED = ("t_s", "x_mm", "y_mm", "z_mm", "flow_mm3_s")
COLUMNS = (*NEEDED[:4], "speed_mm_s", "flow_mm3_s")
MAX_ROWS = 1500  # Largest number of rows, because a trial's file contains all columns
# Largest relative difference between a stated speed and the speed from positions and times, because of rounding
SPEED_OFF = 2e-3
# Not strict: a discriminator runs before the check, and pydantic then does not accept a list from JSON as a tuple.
Column = Annotated[tuple[float, ...], Field(min_length=2, max_length=MAX_ROWS, strict=False)]


class PathTable(Settings):
    """Columns of a planned path, in the sample's frame.

    The flow of a row applies until the next row, and the last row has a flow of 0.
    """

    t_s: Column
    """Time at which the nozzle is at the row's position. Times must increase from row to row."""
    x_mm: Column
    """Position of the nozzle's tip along x, measured to the right from the face's lower left corner."""
    y_mm: Column
    """Position of the nozzle's tip along y, measured upward in the photo from the face's lower left corner."""
    z_mm: Column
    """Height of the nozzle's tip above the face."""
    flow_mm3_s: Column
    """Flow on the way from this row's position to the next row's position."""

    def _check(self) -> None:
        columns = dict(self)
        if len(set(map(len, columns.values()))) > 1:
            raise ValueError("its columns differ in length: give a number for every column in every row")
        if fault := _first_fault(columns):
            raise ValueError(f"row {fault[0] + 1}: {fault[1]}")

    @property
    def place_mm(self) -> Floats:
        return np.column_stack([self.x_mm, self.y_mm, self.z_mm])

    @property
    def flow(self) -> Floats:
        """Flow from each row to the next in mm³/s, (n,)."""
        return np.array(self.flow_mm3_s)

    @property
    def speed_mm_s(self) -> Floats:
        """Speed from each row to the next, (n,). It is 0 in the last row."""
        return np.append(np.diff(arc_length(self.place_mm)) / np.diff(self.t_s), 0.0)


def planned_path(trajectory: Trajectory) -> PathTable:
    """Return a trajectory as columns of a planned path, rounded to six decimals as in trajectory.csv."""
    columns = np.column_stack([trajectory.t_s, trajectory.position_mm, trajectory.flow_mm3_s]).round(6).T.tolist()
    return PathTable(**dict(zip(NEEDED, map(tuple, columns), strict=True)))


def read_planned_path(path: Path) -> PathTable:
    """Read a planned path. Raises InputError with file, row, column and value.

    The column speed_mm_s is optional and only for people who read the file. It must agree with positions and times.
    """
    columns = read_columns(path, BOUNDS, NEEDED, (2, MAX_ROWS))
    rows = columns.pop("row")
    if fault := _first_fault(columns):
        raise InputError(f"{path}, row {rows[fault[0]]:g}: {fault[1]}.")
    return PathTable(**{name: tuple(columns[name]) for name in NEEDED})


def _first_fault(columns: Mapping[str, Sequence[float]]) -> tuple[int, str] | None:
    """Return the row of the first fault, counted from 0, and a sentence about it. None if there is no fault."""
    values = {name: np.array(columns[name]) for name in columns}
    t_s, *place_mm, flow = (values[name] for name in NEEDED)
    lasts_s, way_mm = np.diff(t_s), np.linalg.norm(np.diff(place_mm, axis=1), axis=0)
    faults = [
        *(
            (name, (values[name] < low) | (values[name] > high), f"{low:g} to {high:g} is allowed")
            for name, (low, high) in BOUNDS.items()
            if name in values
        ),
        ("t_s", np.append(False, lasts_s <= 0), "times must increase"),
        ("flow_mm3_s", np.append(np.zeros(len(flow) - 1), flow[-1]) != 0, "the last row ends the path and must have 0"),
        ("flow_mm3_s", np.array([not flow.any()]), "a path must give sealant in at least one row"),
        (
            "x_mm",
            way_mm == 0,
            "the nozzle does not move until the next row. Move it slowly, since robots cannot pause on a path",
        ),
    ]
    if "speed_mm_s" in values:
        off = np.abs(values["speed_mm_s"][:-1] * lasts_s - way_mm) > SPEED_OFF * way_mm + 1e-5 * lasts_s
        faults.append(
            ("speed_mm_s", off, "its positions and times give another speed. Correct it, or leave the column out")
        )
    for name, wrong, reason in faults:
        if wrong.any():
            row = int(wrong.argmax())
            return row, f"{name} is {values[name][row]:g}; {reason}"
    return None


PlanOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[PathTable, Tag("several")], ByForm]
"""A planned path: its columns, or the name of a file that contains them."""
