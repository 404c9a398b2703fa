"""The face of this package: a file into places and readings in millimetres, or all that is wrong with it."""

from dataclasses import dataclass
from pathlib import Path

from sealtwin.records import Floats
from validate.settings import Declared, Quantity, Unit
from validate.sheets.cells import read_cells
from validate.sheets.columns import read_header
from validate.sheets.dialect import Dialect
from validate.sheets.faults import FaultList, shown
from validate.sheets.possible import Crack, level_mm
from validate.sheets.samples import rows_of_sample
from validate.sheets.table import read_table
from validate.wording import counted


@dataclass(frozen=True)
class Sheet:
    """Readings as the lab wrote them, turned into millimetres and sorted along the crack, and nothing else done."""

    path: Path
    sha256: str
    """Of the bytes that were read."""
    s_mm: Floats  # (n,), increasing
    repeats_mm: Floats  # (n, r); NaN where one is missing, and never a whole row
    quantity: Quantity
    """Which way the repeats count from the datum: level upward, depth downward."""
    declared: Declared
    dialect: Dialect

    @property
    def levels_mm(self) -> Floats:
        """(n, r): heights above the sample's surface, whatever the sheet counts from and which way."""
        return level_mm(self.repeats_mm, self.quantity, self.declared)


def read_sheet(path: Path, declared: Declared, crack: Crack | None = None) -> Sheet:
    """A CSV or XLSX in the dialect that it is written in, helped by what is ``declared``.

    Rows may stand in any order; a station without any reading is left out. Where the ``crack`` is known, a station
    outside it, and a level that no filling of it can have, are faults as well.

    Raises:
        SheetFaults: with every fault of the file, each with its place, value and remedy.
        InputError: the file cannot be opened.
    """
    grid = read_cells(path, declared)
    faults = FaultList()
    header = rows_of_sample(grid, read_header(grid, declared, faults), declared, faults)
    table = read_table(grid, header, declared, crack, faults)
    stations = len(table.s_mm)
    if stations < 2 and not faults.count:
        faults.add(
            grid.place(),
            f"{counted(stations, 'station')} with a reading; a level along the crack needs two or more.",
            "Add the others.",
        )
    faults.raise_if_any()
    quantity, station_unit = header.quantity, header.station.unit
    units: tuple[Unit, ...] = tuple(dict.fromkeys(column.unit for column in header.readings if column.unit is not None))
    assert quantity is not None, "a fault when the header was read"
    assert station_unit is not None, "likewise"
    dialect = Dialect(
        written=(*grid.written, *([] if declared.sample is None else [f"rows of {shown(declared.sample)}"])),
        decimal=table.mark,
        layout="wide" if header.repeat is None else "long",
        repeats=table.repeats_mm.shape[1],
        missing=table.missing,
        quantity=quantity,
        station_unit=station_unit,
        units=units,
        datum=declared.datum,
        datum_level_mm=declared.datum_level_mm or 0.0,
        above=header.above,
        skipped=tuple(column.name for column in header.skipped),
        remarks=grid.remarks,
    )
    return Sheet(path, grid.sha256, table.s_mm, table.repeats_mm, quantity, declared, dialect)
