"""From a file's numbers to millimetres with the cracked face upward."""

from pathlib import Path
from typing import get_args

import numpy as np

from digitise.modelled.triangles import FileUnit, Triangles
from digitise.settings import MeshInput, MeshUnit
from sealtwin.errors import InputError
from sealtwin.records import Floats

MM: dict[FileUnit, float] = {"micron": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "foot": 304.8}
UPRIGHT = {
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
}
"""Rotations, by rows, that turn the axis out of the face to z."""
LEAST_MM, MOST_MM = 10.0, 1000.0
"""Longest side of any sample: outside, the unit is wrong."""


def upright(settings: MeshInput) -> Floats:
    """(4, 4): from the file's numbers to mm with the face's normal upward."""
    placed = np.eye(4)
    placed[:3, :3] = MM[settings.units] * np.array(UPRIGHT[settings.up], dtype=float)
    return placed


def moved(points_mm: Floats, placed: Floats) -> Floats:
    """Points (n, 3) through a (4, 4) transform; with no rounding but that of the step where it does not turn."""
    turn, step = placed[:3, :3], placed[:3, 3]
    return (points_mm if np.array_equal(turn, np.eye(3)) else points_mm @ turn.T) + step


def upright_mm(read: Triangles, settings: MeshInput) -> Floats:
    """Vertices (v, 3). Raises InputError where no sample has their size."""
    places_mm = moved(read.vertices, upright(settings))
    size_mm = np.ptp(places_mm, axis=0)
    if LEAST_MM <= size_mm.max() <= MOST_MM:
        return places_mm
    extent = float(size_mm.max()) / MM[settings.units]
    fitting = [unit for unit in get_args(MeshUnit) if LEAST_MM <= extent * MM[unit] <= MOST_MM]
    remedy = f"The file is probably in {' or '.join(fitting)}: set units" if fitting else "Crop the mesh to the sample"
    x, y, z = size_mm
    raise InputError(
        f"Bounding box {x:.4g} x {y:.4g} x {z:.4g} mm, with units = {settings.units}, is implausible for a sample "
        f"(expected {LEAST_MM:g} to {MOST_MM:g}). {remedy}."
    )


def notes_on_unit(read: Triangles, settings: MeshInput, path: Path) -> list[str]:
    """What is odd about it. Raises InputError where the file itself says another one."""
    if read.unit in (None, settings.units):
        return []
    if path.suffix.lower() == ".glb":
        # Many programs write millimetres into it all the same, so this is no proof.
        return [f"{path.name}: glTF counts in metres; its numbers are taken for {settings.units}, as units says"]
    raise InputError(f"{path}: it says itself that it is in {read.unit}, but units is {settings.units}. Correct units.")
