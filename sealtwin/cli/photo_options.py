"""Options of ``sealtwin digitise`` as settings of a trial."""

import math
from pathlib import Path
from typing import Any

import typer

from sealtwin.core.errors import InputError


def points(text: str | None, option: str) -> list[tuple[float, float]] | None:
    """``"x,y x,y"`` in pixels. Raises typer.BadParameter, naming the option."""
    return None if text is None else [two_numbers(pair, ",", option) for pair in text.split()]


def two_numbers(text: str, separator: str, option: str) -> tuple[float, float]:
    """Raises typer.BadParameter, naming the option."""
    try:
        first, second = (float(part) for part in text.split(separator))
    except ValueError:
        first = second = math.nan
    if not (math.isfinite(first) and math.isfinite(second)):
        raise typer.BadParameter(f"{option} {text}: expected two numbers, as in 12{separator}340")
    return first, second


def one_or_two(text: str | None, option: str) -> float | tuple[float, float] | None:
    """``"11"``, or ``"11,8"`` for left and right. Raises typer.BadParameter, naming the option."""
    if text is None:
        return None
    if "," in text:
        return two_numbers(text, ",", option)
    return _number(text, option, "a number, or two with a comma between")


def depth(text: str) -> float | list[list[float]]:
    """A number, or the rows of a CSV with the columns s_mm and depth_mm.

    Raises typer.BadParameter where it is neither, InputError where the file cannot be used.
    """
    path = Path(text)
    if path.suffix.lower() not in {".csv", ".txt"}:
        return _number(text, "--depth-mm", "millimetres, or a CSV with the columns s_mm and depth_mm")
    from sealtwin.lab.tables import named_cells, read_table
    from validate.readings.text_table import number

    table = read_table(path, "--depth-mm takes a number, or a CSV with the columns s_mm and depth_mm")
    # Between commas a decimal comma may as well set thousands apart.
    mark = "point" if table.separator == "," else None
    rows = []
    for place, cells in named_cells(table, ("s_mm", "depth_mm")):
        row = [value for text in cells.values() if (value := number(text, mark)) is not None]
        if len(row) < len(cells):
            raise InputError(f"{place}: {list(cells.values())!r:.80}; s_mm and depth_mm must both be numbers, in mm.")
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: no rows below its header; give s_mm and depth_mm in each, in mm.")
    return rows


def board(path: Path | None) -> dict[str, Any] | None:
    """The [photo.markers] of a TOML file, as 'sealtwin markers' writes it. Raises InputError where it has none."""
    if path is None:
        return None
    from digitise.settings import MarkerBoard
    from sealtwin.core.settings import Settings, read_settings

    class PhotoOptions(Settings):
        markers: MarkerBoard

    class MarkerFile(Settings):
        photo: PhotoOptions

    read = read_settings(MarkerFile, path, name="file of markers", starter="'sealtwin markers' writes one")
    return read.photo.markers.model_dump(mode="json")


def _number(text: str, option: str, expected: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise typer.BadParameter(f"{option} {text}: expected {expected}")
    return value
