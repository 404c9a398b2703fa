"""Read a flow curve from the export of a rheometer: RheoCompass, TRIOS, RheoWin, rSpace, or any sheet with two columns.

Cells come from the reader of sheets. Here a row that names shear rate and shear stress is a header; units are in the
names or in a row below. Nothing is guessed: without a unit, or with several curves in a file, the file is refused.
"""

import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sealtwin.core.records import Floats
from validate.readings.samples import read_table
from validate.readings.sheet import BLANK, Place, SheetFaults, SheetGrid, SheetRow, quoted, refuse
from validate.readings.table_rows import first_cell, is_a_number
from validate.readings.text_table import WORDS, common_mark, is_ambiguous, is_missing, number, plain_letters
from validate.settings import Decimal

EXPECTED = "expected a sheet with columns for shear rate and shear stress, such as shear_rate_per_s,stress_pa"
LEAST_ROWS = 5
LEAST_RANGE = 3.0  # Least ratio of the largest to the smallest shear rate: a smaller range determines no law
MOST_OFF = 2.0  # Largest ratio of stress over rate times viscosity; corrections of a geometry change it by less
UNIT_ROWS = 2  # Rows below a header among which that of the units is
IN_NAME = re.compile(
    r"^(?P<name>.*?)\s*(?:[\[(](?P<bracket>[^\])\s]*)[\])]|\s(?:in|/)\s(?P<word>\S+)|,\s*(?P<comma>\S+))$"
)
AT_END = re.compile(r"^(?P<name>.*)_(?P<unit>per_s|[kKmM]?[pP][aA](?:_s)?)$")
GAMMA_DOT = re.compile("[\u03b3\u0263\u0194\u0393]\u0307")  # Without its dot the letter is that of the strain
IN_OWN_NAMES = {"per_s": "1/s", "pa": "Pa", "kpa": "kPa", "pa_s": "Pa.s"}  # mpa is mPa or MPa, and is refused
COLUMNS: dict[str, frozenset[str]] = {
    key: frozenset(name.strip() for name in WORDS["flow_curve"][key].split(","))
    for key in ("rate", "stress", "viscosity")
}
UNITS: dict[str, dict[str, float]] = WORDS["flow_curve"]["units"]
REJECTED = frozenset(WORDS["flow_curve"]["rejected"].split())
IN_WORDS = {"rate": "shear rate", "stress": "shear stress", "viscosity": "viscosity"}


class _Column(NamedTuple):
    at: int  # From 0
    name: str  # As in the file, with its unit
    unit: str | None


@dataclass(frozen=True)
class _Block:
    """A table of the file: the columns of its header, and its rows with a rate and a stress."""

    header: int
    columns: dict[str, _Column]
    rows: list[SheetRow]
    skipped: int  # Rows without a value, or rejected by the instrument

    def numbers(self, key: str, mark: Decimal | None) -> list[float | None]:
        index = self.columns[key].at
        return [float(c.text) if (c := row.cell(index)).kind == "number" else number(c.text, mark) for row in self.rows]

    @property
    def is_curve(self) -> bool:
        rates = [one for one in self.numbers("rate", None) if one is not None and one > 0]
        return len(rates) >= LEAST_ROWS and max(rates) >= LEAST_RANGE * min(rates)

    def __str__(self) -> str:
        return f"{self.rows[0].number}:{self.rows[-1].number}"


@dataclass(frozen=True)
class FlowCurve:
    """A flow curve as read, in the order of the file."""

    rate_per_s: Floats  # (n,), above 0 or not
    stress_pa: Floats  # (n,)
    places: tuple[Place, ...]  # Place of each stress
    basis: str  # How the file was read


def read_flow_curve(path: Path, rows: tuple[int, int] | None = None) -> FlowCurve:
    """Read a flow curve. ``rows`` limits it to these rows of the file, first and last, counted from 1.

    Raises SheetFaults or another InputError that names file, row, column, value and remedy.
    """
    grid = _cells(path)
    blocks = list(_blocks(grid, rows))
    if not blocks:
        within = "" if rows is None else f" with values in rows {rows[0]} to {rows[1]}"
        raise refuse(grid.place(), f"no row names a shear rate and a shear stress{within}; {EXPECTED}.", "Name them.")
    curves = [block for block in blocks if block.is_curve]
    if len(curves) > 1:
        finding = f"{len(curves)} curves, in rows {', '.join(map(str, curves[:12]))}: one paste has one."
        raise refuse(grid.place(), finding, f"Select one, for example --rows {curves[-1]}.")
    block = max(curves or blocks, key=lambda one: len(one.rows))
    mark = _mark(grid, block)
    factors = {key: _factor(grid, block, key) for key in ("rate", "stress")}
    values = {key: factor * np.array(_values(grid, block, key, mark)) for key, factor in factors.items()}
    _compare_viscosity(grid, block, values, mark)
    stress = block.columns["stress"]
    names = " and ".join(quoted(block.columns[key].name) for key in factors)
    units = ", ".join(f"{block.columns[key].unit}" for key in factors)
    skipped = f", {block.skipped} rows without a value left out" if block.skipped else ""
    return FlowCurve(
        values["rate"],
        values["stress"],
        tuple(grid.place(row.number, stress.at, stress.name) for row in block.rows),
        f"columns {names} in {units}, rows {str(block).replace(':', ' to ')} ({', '.join(grid.written)}){skipped}",
    )


def _cells(path: Path) -> SheetGrid:
    try:
        return read_table(path, EXPECTED)
    except SheetFaults as fault:
        place, finding = fault.faults[0].place, fault.faults[0].finding
        if "[readings]" not in fault.faults[0].remedy:
            raise
        raise refuse(place, finding, "Save the sheet with the flow curve as a file of its own.") from fault


def _blocks(grid: SheetGrid, limits: tuple[int, int] | None) -> Iterator[_Block]:
    """Yield the tables of the file that have a row."""
    headers = [(at, columns) for at, row in enumerate(grid.rows) if (columns := _named(grid, row))]
    ends = [*(at for at, _ in headers[1:]), len(grid.rows)]
    for (at, columns), end in zip(headers, ends, strict=False):
        below = grid.rows[at + 1 : end]
        above = next((k for k, row in enumerate(below[: UNIT_ROWS + 1]) if any(map(is_a_number, row.cells))), UNIT_ROWS)
        columns = {key: _with_unit(one, below[:above]) for key, one in columns.items()}
        rows, skipped = list[SheetRow](), 0
        for place, row in enumerate(below[above:], start=above):
            first = first_cell(row)
            if first is None or _begins_section(row) or not any(map(is_a_number, row.cells)):
                _refuse_rows_below(grid, columns, below[place:])
                break
            if grid.separator == "," and row.width > grid.rows[at].width:
                finding = f"{row.width} fields under {grid.rows[at].width} columns."
                remedy = "If these are decimal commas, export with semicolons or tabs, or with decimal points."
                raise refuse(grid.place(row.number), finding, remedy)
            if limits is not None and not limits[0] <= row.number <= limits[1]:
                continue
            blank = any(
                is_missing((c := row.cell(columns[key].at)).text) and c.kind == "text" for key in ("rate", "stress")
            )
            rejected = bool(plain_letters(first.text)) and plain_letters(first.text) in REJECTED
            if blank or rejected:
                skipped += 1
            else:
                rows.append(row)
        if rows:
            yield _Block(grid.rows[at].number, columns, rows, skipped)


def _begins_section(row: SheetRow) -> bool:
    """Return whether a row begins a section of an export: "Interval data:" of RheoCompass, "[step]" of TRIOS."""
    first = first_cell(row)
    return first is not None and (first.text.endswith(":") or first.text.startswith("["))


def _refuse_rows_below(grid: SheetGrid, columns: dict[str, _Column], below: Sequence[SheetRow]) -> None:
    """Refuse a text between rows of one curve, so that the rows below it are not left out without a word."""
    for row in below[: UNIT_ROWS + 2]:
        if _begins_section(row):
            return
        if all(is_a_number(row.cell(columns[key].at)) for key in ("rate", "stress")):
            text = next(cell.text for cell in below[0].cells if cell != BLANK)
            finding = f"{quoted(text)} is between rows of numbers: two curves, or a remark."
            raise refuse(grid.place(below[0].number), finding, "Delete it, or name the columns of the second.", text)


def _named(grid: SheetGrid, row: SheetRow) -> dict[str, _Column]:
    """Return the columns that a header names, or {} for another row. A column that is named twice is refused."""
    columns: dict[str, list[_Column]] = {}
    for index, cell in enumerate(row.cells):
        name, unit = _split(cell.text)
        words = " ".join(re.findall(r"[^\W_]+", plain_letters(name)))
        for key, names in COLUMNS.items():
            if cell != BLANK and words in names:
                columns.setdefault(key, []).append(_Column(index, cell.text, unit))
    if not {"rate", "stress"} <= columns.keys():
        return {}
    for key in ("rate", "stress"):
        if len(columns[key]) > 1:
            named = ", ".join(quoted(one.name) for one in columns[key])
            finding = f"{len(columns[key])} columns with a {IN_WORDS[key]}: {named}."
            raise refuse(grid.place(row.number), finding, "Delete all but one curve in a copy.")
    return {key: one[0] for key, one in columns.items()}


def _split(text: str) -> tuple[str, str | None]:
    """Return the name of a column without its unit, and the unit as written."""
    plain = unicodedata.normalize("NFKC", GAMMA_DOT.sub("gamma dot", text)).replace("\u2212", "-").strip()
    if match := IN_NAME.match(plain):
        return match["name"], match["bracket"] or match["word"] or match["comma"]
    if match := AT_END.match(plain):
        return match["name"], IN_OWN_NAMES.get(match["unit"], match["unit"])
    return plain, None


def _with_unit(column: _Column, below: Sequence[SheetRow]) -> _Column:
    """Return a column with the unit from a row below the header, if its name has none."""
    texts = [cell.text for row in below if (cell := row.cell(column.at)).text and not is_a_number(cell)]
    if column.unit is not None or not texts:
        return column
    return column._replace(unit=unicodedata.normalize("NFKC", texts[0]).replace("\u2212", "-").strip("[](){} "))


def _factor(grid: SheetGrid, block: _Block, key: str) -> float:
    column, units = block.columns[key], UNITS[key]
    place = grid.place(block.header, column.at, column.name)
    if column.unit is None:
        example = f"{column.name} [{'1/s' if key == 'rate' else 'Pa'}]"
        raise refuse(place, f"no unit of the {IN_WORDS[key]}.", f"Write it into the name: {example}.", column.name)
    factor = _known(units, column.unit)
    if factor is None:
        finding = f"{quoted(column.unit)} is no unit of a {IN_WORDS[key]} that is read ({', '.join(units)})."
        raise refuse(place, finding, "Export the column in one of these; capitals count.", column.unit)
    return factor


def _known(units: dict[str, float], unit: str) -> float | None:
    return units.get("".join(unit.split()).replace("\u00b7", ".").replace("\u22c5", "."))


def _mark(grid: SheetGrid, block: _Block) -> Decimal | None:
    """Return the decimal mark of the file. Any number of the table's rows may decide it."""
    texts = [cell.text for row in block.rows for cell in row.cells if cell.kind == "text"]
    mark = common_mark(texts, grid.separator)
    used = [(row, block.columns[key]) for row in block.rows for key in ("rate", "stress")]
    doubtful = [
        (row, column)
        for row, column in used
        if row.cell(column.at).kind == "text" and is_ambiguous(row.cell(column.at).text)
    ]
    if mark is None and doubtful:
        row, column = doubtful[0]
        text = row.cell(column.at).text
        raise refuse(
            grid.place(row.number, column.at, column.name),
            f"{text!r} is {text.replace(',', '.')}, or {text.replace(',', '').replace('.', '')} with a thousands "
            f"separator; {len(doubtful)} numbers are like this, and no other number decides it.",
            "Export with decimal points and without thousands separators, or as XLSX.",
            text,
        )
    return mark


def _values(grid: SheetGrid, block: _Block, key: str, mark: Decimal | None) -> list[float]:
    values, column = block.numbers(key, mark), block.columns[key]
    for row, value in zip(block.rows, values, strict=True):
        if value is None:
            text = row.cell(column.at).text
            marked = f" with a decimal {mark}, as the other numbers have" if mark else ""
            remedy = "Correct it, or clear the cell if the value is missing."
            raise refuse(
                grid.place(row.number, column.at, column.name), f"{quoted(text)} is no number{marked}.", remedy, text
            )
    return [value for value in values if value is not None]


def _compare_viscosity(grid: SheetGrid, block: _Block, values: dict[str, Floats], mark: Decimal | None) -> None:
    """Refuse a stress that is not rate times viscosity, if the file has a viscosity: one of the units is wrong."""
    column = block.columns.get("viscosity")
    factor = None if column is None or column.unit is None else _known(UNITS["viscosity"], column.unit)
    if column is None or factor is None:
        return
    given = np.array([np.nan if one is None else one for one in block.numbers("viscosity", mark)]) * factor
    sheared = (values["rate"] > 0) & (given > 0) & (values["stress"] > 0)
    if not sheared.any():
        return
    ratio = float(np.median(values["stress"][sheared] / (given * values["rate"])[sheared]))
    if not 1 / MOST_OFF <= ratio <= MOST_OFF:
        stress = block.columns["stress"]
        finding = f"the stresses are {ratio:.3g} times shear rate times {quoted(column.name)}."
        raise refuse(grid.place(block.header, stress.at, stress.name), finding, "Correct the unit that is wrong.")
