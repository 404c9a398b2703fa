"""A file of readings that several samples share: a column names the sample of each row, or each has a worksheet."""

import hashlib
import json
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

from sealtwin.errors import InputError
from validate.settings import Declared
from validate.sheets.cells import read_all_cells
from validate.sheets.columns import Column, Header, read_header
from validate.sheets.faults import FaultList, SheetFaults, clipped
from validate.sheets.grid import Grid, Row

WORD = re.compile(r"[^\W_]+")
MOST_NAMED = 12


@dataclass(frozen=True)
class Part:
    """What of a file may be one sample's."""

    sheet: str | None
    """Of a workbook with several; None where there is but one."""
    rows_of: str | None
    """The sample, as the sheet's own column spells it first; None where no column names any."""
    sha256: str = field(compare=False)
    """Of the part's cells, the sample's name aside: equal for equal readings."""
    headed: bool = field(default=True, compare=False)
    """False for a worksheet in which no header of readings is found: a cover, or readings under unknown names."""

    def __str__(self) -> str:
        said = (self.sheet and f"sheet {self.sheet}", self.rows_of and f"rows of {self.rows_of}")
        return ", ".join(part for part in said if part)


def sample_key(sample: str) -> str:
    """Equal for two spellings of one sample: case, spaces, points, hyphens and underscores do not count.

    Between two digits a gap does: 1-11 is not 11-1.
    """
    words = WORD.findall(unicodedata.normalize("NFKC", sample).casefold())
    key = ""
    for word in words:
        key += f"-{word}" if key[-1:].isdigit() and word[0].isdigit() else word
    return key


def parts_of(path: Path) -> tuple[Part, ...]:
    """Each table of readings in a file, divided by its samples; of several worksheets the others, too."""
    try:
        grids = read_all_cells(path)
    except InputError:
        # It is told of by whoever reads the file as a sample's.
        return ()
    return tuple(part for grid in grids for part in _parts(grid, grid.sheet if len(grids) > 1 else None))


def rows_of_sample(grid: Grid, header: Header, declared: Declared, faults: FaultList) -> Header:
    """``header`` with the rows of the declared sample below it; what keeps them from being told is added to ``faults``.

    A column that names one sample only is of that sample.
    """
    column, place = header.sample, grid.place(header.row.number)
    if column is None:
        if declared.sample is not None:
            faults.add(
                place,
                f"no column names samples, while [readings] sample names {clipped(declared.sample)!r}.",
                "Name it in a column 'sample', or leave [readings] sample out.",
                declared.sample,
            )
        return header
    nameless = [row for row in header.body if not sample_key(row.cell(column.index).text)]
    for row in nameless:
        faults.add(
            grid.place(row.number, column.index, column.name),
            "which sample this row is of is not said.",
            "Write its name into every row.",
        )
    spelt = _spelt(column, header.body)
    names = ", ".join(repr(clipped(name)) for name in list(spelt.values())[:MOST_NAMED])
    if declared.sample is None:
        if len(spelt) > 1:
            faults.add(place, f"rows of several samples: {names}.", "Name the one that is meant: [readings] sample.")
        return header
    wanted = sample_key(declared.sample)
    if wanted not in spelt:
        faults.add(
            place,
            f"no row of sample {clipped(declared.sample)!r}; column {clipped(column.name)!r} names {names}.",
            "Correct the name there, or which sample the file is of.",
            declared.sample,
        )
    rows = tuple(row for row in header.body if row in nameless or sample_key(row.cell(column.index).text) == wanted)
    return replace(header, body=rows)


def _parts(grid: Grid, sheet: str | None) -> Iterable[Part]:
    try:
        header = read_header(grid, Declared(), FaultList())
    except SheetFaults:
        if sheet is not None:
            yield Part(sheet, None, _sha256(grid.rows, None), headed=False)
        return
    column = header.sample
    if column is None:
        yield Part(sheet, None, _sha256(grid.rows, None))
        return
    for key, name in _spelt(column, header.body).items():
        own = [row for row in header.body if sample_key(row.cell(column.index).text) == key]
        yield Part(sheet, name, _sha256([header.row, *own], column.index))


def _spelt(column: Column, rows: Iterable[Row]) -> dict[str, str]:
    """Samples that a column names, by their keys, each as it is spelt first."""
    spelt: dict[str, str] = {}
    for row in rows:
        if key := sample_key(row.cell(column.index).text):
            spelt.setdefault(key, row.cell(column.index).text)
    return spelt


def _sha256(rows: Iterable[Row], without: int | None) -> str:
    cells = [[cell for index, cell in enumerate(row.cells) if index != without] for row in rows]
    return hashlib.sha256(json.dumps(cells).encode()).hexdigest()
