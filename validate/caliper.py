"""Caliper readings from a CSV: every doubt is an error that names file, line, column, value and remedy."""

import csv
import io
import re
from pathlib import Path

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Floats, Profile
from validate.settings import Readings
from validate.wording import counted

MOST_BYTES = 1_000_000
MOST_ROWS = 10_000
MOST_REPEATS = 32
CLOSEST_MM = 0.01
"""Between stations: the last digit of a caliper. Closer ones are one place, read twice."""
HEADER = "s_mm,level_1_mm,level_2_mm,level_3_mm (level upward from the face) or s_mm,depth_1_mm,... (depth downward)"
READING_COLUMN = re.compile(r"(level|depth)(_\d+)?_mm")


def read_readings(path: Path, settings: Readings, length_mm: float, depth_mm: float) -> Profile:
    """The mean level of each station and its repeats, in the order of s.

    A blank field is a missing reading; a station without any reading is left out. ``length_mm`` and ``depth_mm`` are
    the crack's: a station outside it, or a level that no filling of it can have, is refused.

    Raises InputError where the sheet cannot be read without guessing.
    """
    lines = _lines(path)
    names = _header(path, lines)
    sign = -1.0 if names[1].startswith("depth") else 1.0
    stations_mm: list[float] = []
    repeats_mm: list[list[float]] = []
    for line, row in lines[1:]:
        if len(row) != len(names):
            raise InputError(
                f"{path}, line {line}: {len(row)} fields under {len(names)} columns. "
                "Write one field for each column; leave a missing reading blank, and decimals with a point."
            )
        s_mm, *readings = (_number(path, line, name, text) for name, text in zip(names, row, strict=True))
        _check_station(path, line, s_mm, stations_mm, length_mm)
        for name, text, value in zip(names[1:], row[1:], readings, strict=True):
            _check_level(path, line, name, text, sign * value, depth_mm)
        stations_mm.append(s_mm)
        repeats_mm.append([sign * value for value in readings])
    return _profile(path, np.array(stations_mm), np.array(repeats_mm).reshape(-1, len(names) - 1), settings)


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Line numbers and fields of the lines that hold anything."""
    try:
        with path.open("rb") as sheet:
            content = sheet.read(MOST_BYTES + 1)
    except OSError as fault:
        raise InputError(
            f"{path}: readings cannot be opened ({fault.strerror}). Give the sheet's path in [readings] file."
        ) from fault
    if len(content) > MOST_BYTES:
        raise InputError(f"{path}: larger than {MOST_BYTES:,} bytes. Give one trial's readings, not a collection.")
    try:
        # A byte order mark is what spreadsheets put first; it is no part of the first column's name.
        reader = csv.reader(io.StringIO(content.decode("utf-8-sig"), newline=""), strict=True)
        lines = [(reader.line_num, [field.strip() for field in row]) for row in reader if any(map(str.strip, row))]
    except (UnicodeDecodeError, csv.Error) as fault:
        raise InputError(f"{path}: no CSV in UTF-8 ({fault}). Save the sheet as 'CSV UTF-8'.") from fault
    if len(lines) < 2:
        raise InputError(f"{path}: no rows of readings. Write a header {HEADER} and a row for each station.")
    if len(lines) > MOST_ROWS:
        raise InputError(f"{path}: {len(lines)} lines; at most {MOST_ROWS} are read. Thin the stations out.")
    return lines


def _header(path: Path, lines: list[tuple[int, list[str]]]) -> list[str]:
    line, names = lines[0]
    where = f"{path}, line {line}"
    if "s_mm" not in names:
        hint = " Fields are separated by commas, decimals by a point." if ";" in names[0] or "\t" in names[0] else ""
        raise InputError(f"{where}: no column s_mm in {names}; expected {HEADER}.{hint}")
    if names[0] != "s_mm":
        raise InputError(f"{where}: column s_mm stands at place {names.index('s_mm') + 1}. Put it first.")
    for name in names[1:]:
        if not READING_COLUMN.fullmatch(name):
            raise InputError(
                f"{where}: column {name!r} is unknown; expected {HEADER}. Name its sign and unit, or delete it."
            )
    if len(names) < 2:
        raise InputError(f"{where}: no column of readings beside s_mm; expected {HEADER}.")
    if len({name.split("_")[0] for name in names[1:]}) > 1:
        raise InputError(f"{where}: level and depth columns in one sheet. Write all readings one way.")
    if len(set(names)) < len(names):
        raise InputError(f"{where}: a column name stands twice in {names}. Number the repeats.")
    if len(names) - 1 > MOST_REPEATS:
        raise InputError(f"{where}: {len(names) - 1} repeats; at most {MOST_REPEATS} are read.")
    return names


def _number(path: Path, line: int, column: str, text: str) -> float:
    """NaN where a reading is missing."""
    if not text and column != "s_mm":
        return np.nan
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(
            f"{path}, line {line}, column {column}: {text!r} is no number in mm, such as -4.25. "
            + (
                "Give every row its station."
                if column == "s_mm"
                else "Leave the field blank if the reading is missing."
            )
        )
    return value


def _check_station(path: Path, line: int, s_mm: float, before_mm: list[float], length_mm: float) -> None:
    where = f"{path}, line {line}, column s_mm: {s_mm:.12g}"
    # The crack's length is known to about a millimetre; the last station of a caliper is its end.
    slack_mm = max(2.0, 0.03 * length_mm)
    if not -slack_mm <= s_mm <= length_mm + slack_mm:
        raise InputError(
            f"{where} mm is outside the crack, 0 to {length_mm:.1f} mm along its centreline. "
            "Check the unit, and from which end s is counted."
        )
    if before_mm and s_mm == before_mm[-1]:
        raise InputError(f"{where} mm stands twice. Write repeated readings of a station as columns of one row.")
    if before_mm and s_mm < before_mm[-1]:
        raise InputError(f"{where} mm after {before_mm[-1]:.12g} mm. Sort the rows by s_mm.")
    if before_mm and s_mm - before_mm[-1] < CLOSEST_MM * (1 - 1e-9):
        raise InputError(
            f"{where} mm is less than {CLOSEST_MM:g} mm after {before_mm[-1]:.12g} mm. "
            "Write repeated readings of a station as columns of one row."
        )


def _check_level(path: Path, line: int, column: str, text: str, level_mm: float, depth_mm: float) -> None:
    """A sign or a unit gone wrong puts most levels where no sealant can be."""
    lowest_mm = -1.25 * depth_mm - 1.0
    """Below the mean depth by a quarter: hand-made floors are uneven."""
    highest_mm = max(5.0, depth_mm / 2)
    """A bead of paste on a crack stands a few millimetres high."""
    if not np.isnan(level_mm) and not lowest_mm <= level_mm <= highest_mm:
        raise InputError(
            f"{path}, line {line}, column {column}: {text} is a level of {level_mm:g} mm from the face; "
            f"{lowest_mm:g} to {highest_mm:g} mm is possible in a crack {depth_mm:g} mm deep. "
            "Level counts upward, depth downward: check the column's name, its unit and the datum."
        )


def _profile(path: Path, s_mm: Floats, repeats_mm: Floats, settings: Readings) -> Profile:
    read = ~np.isnan(repeats_mm).all(axis=1)
    if read.sum() < 2:
        raise InputError(
            f"{path}: {counted(int(read.sum()), 'station')} with a reading; a level along the crack needs two or more."
        )
    s_mm, repeats_mm = s_mm[read], repeats_mm[read]
    return Profile(
        s_mm=s_mm,
        level_mm=np.nanmean(repeats_mm, axis=1),
        repeats_mm=repeats_mm,
        data=settings.data,
        source=path.name,
    )
