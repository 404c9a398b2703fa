"""A centreline that the user brings along with a mesh."""

import re
from pathlib import Path

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Floats

LARGEST_BYTES = 5_000_000
"""Fifty thousand points; a path of a crack has some hundred."""
SEPARATORS = re.compile(r"[;,\s]+")
HEADERS = (("x_mm", "y_mm"), ("x", "y"))
"""Of a first line of words, as our own trajectory.csv has one; without it the first two numbers of a line count."""


def read_path(path: Path) -> Floats:
    """Points in mm, (n, 2), from lines of x and y, or x, y and z, parted by commas, semicolons or blanks.

    Raises InputError, naming file and line, where a line holds anything else, or fewer than two points are left.
    """
    if not path.is_file():
        raise InputError(
            f"{path}: no such path file; what mesh.path names is looked for beside its trial file. It may be left out."
        )
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB; a path has some hundred lines.")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{path}: no text; a path is x and y in mm, a line for each point.") from None
    points = []
    columns = [0, 1]
    for number, line in enumerate(lines, start=1):
        words = [word for word in SEPARATORS.split(line.partition("#")[0]) if word]
        header = next((names for names in HEADERS if not points and set(names) <= set(words)), None)
        if header is not None:
            columns = [words.index(name) for name in header]
        elif words:
            points.append(_point(path, number, words, columns))
    places_mm = np.array(points).reshape(-1, 2)
    places_mm = places_mm[np.append(True, np.any(np.diff(places_mm, axis=0) != 0, axis=1))[: len(places_mm)]]
    if len(places_mm) < 2:
        raise InputError(f"{path}: {len(places_mm)} different points; a path needs two and more.")
    return places_mm


def _point(path: Path, number: int, words: list[str], columns: list[int]) -> tuple[float, float]:
    try:
        x, y = (float(words[column]) for column in columns)
    except (ValueError, IndexError):
        raise InputError(f"{path}, line {number}: expected x and y in mm, found {' '.join(words)[:60]!r}.") from None
    if not np.isfinite([x, y]).all():
        raise InputError(f"{path}, line {number}: x and y must be finite numbers, found {' '.join(words)[:60]!r}.")
    return x, y
