"""Rows of a table whose column names the sample of each row, of its first row, or of rows merged into one cell."""

from dataclasses import replace

from validate.readings.header import Header
from validate.readings.header_words import sample_key
from validate.readings.sheet import FaultList, SheetGrid, SheetRow, quoted
from validate.settings import Declared

MOST_NAMES = 12  # Names in a message


def rows_of_sample(grid: SheetGrid, header: Header, declared: Declared, faults: FaultList) -> Header:
    """Return ``header`` with only the rows of the declared sample; ambiguities are added to ``faults``.

    Without a declared sample, the column must name a single sample.
    """
    place, wanted = grid.place(header.row.number), declared.sample
    span = None if declared.columns is None else declared.columns.range
    if header.sample is None:
        if wanted is not None:
            finding = f"no column contains sample names, but [readings] sample = {quoted(wanted)}."
            faults.add(place, finding, "Add a column 'sample', or remove [readings] sample.", wanted)
        return header
    at, name = header.sample.index, header.sample.name
    spelt = names_by_row(grid, header, at)
    by_sample: dict[str, list[SheetRow]] = {}
    for row in header.body:
        by_sample.setdefault(sample_key(spelt[row.number]), []).append(row)
    nameless, key = by_sample.pop("", []), sample_key(wanted or "")
    if nameless and not (span and by_sample.keys() == {key}):
        rows = f"{nameless[0].number}" + (f" to {nameless[-1].number}" if len(nameless) > 1 else "")
        finding = f"rows without a sample name, {rows}."
        remedy = "Write the rows of this sample into the column range of its row in pairing.csv, such as 7:22."
        faults.add(grid.place(nameless[0].number, at, name), finding, remedy)
    names = ", ".join(quoted(spelt[rows[0].number]) for rows in list(by_sample.values())[:MOST_NAMES])
    if wanted is None:
        if len(by_sample) > 1:
            remedy = "Write the one to read into the trial, such as [readings] sample = "
            remedy += f"{names.partition(',')[0]}, or in pairing.csv (one row for each sample)."
            faults.add(place, f"rows of several samples: {names}.", remedy)
        return header
    if key not in by_sample:
        finding = f"no row of sample {quoted(wanted)}; column {quoted(name)} contains {names}."
        faults.add(place, finding, "Correct the name there, or the file's sample.", wanted)
    rows = [*nameless, *by_sample.get(key, [])]
    return replace(header, body=tuple(sorted(rows, key=lambda row: row.number)))


def names_by_row(grid: SheetGrid, header: Header, column: int) -> dict[int, str]:
    """Return the name of the sample of each row of a table, by the row's number; "" if it is open.

    A name goes on over the cells that it is merged with.
    """
    cells = {row.number: row.cell(column).text for row in grid.rows}
    names = {row.number: cells.get(row.number, "") for row in header.body}
    for top, first, bottom, last in grid.merged:
        if first <= column <= last:
            names |= {number: cells.get(top, "") for number in names if top <= number <= bottom}
    return names
