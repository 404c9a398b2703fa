"""Rows of a table whose column names the sample of each row, of its first row, or of rows merged into one cell."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby, pairwise

from validate.readings.header import Header
from validate.readings.header_words import sample_key
from validate.readings.place_words import only_number
from validate.readings.sheet import FaultList, SheetGrid, SheetRow, letters, quoted
from validate.settings import Declared

MOST_NAMES = 12  # Names in a message


def rows_of_sample(grid: SheetGrid, header: Header, declared: Declared, faults: FaultList) -> Header:
    """Return ``header`` with only the rows of the declared sample; ambiguities are added to ``faults``.

    Without a declared sample, the column must name a single sample.
    """
    place, wanted = grid.place(header.row.number), declared.sample
    span = None if declared.columns is None else declared.columns.range
    at = header.sample.index if header.sample is not None else _column_outside(grid, header, wanted if span else None)
    if at is None:
        if wanted is not None:
            finding = f"no column contains sample names, but [readings] sample = {quoted(wanted)}."
            faults.add(place, finding, "Add a column 'sample', or remove [readings] sample.", wanted)
        return header
    spelt = names_by_row(grid, header, at)
    by_sample: dict[str, list[SheetRow]] = {}
    for row in header.body:
        by_sample.setdefault(sample_key(spelt[row.number]), []).append(row)
    nameless, key = by_sample.pop("", []), sample_key(wanted or "")
    if nameless and not (span and by_sample.keys() == {key}):
        rows = f"{nameless[0].number}" + (f" to {nameless[-1].number}" if len(nameless) > 1 else "")
        finding = f"rows without a sample name, {rows}; places do not begin again at each name."
        remedy = "Write the rows of this sample into the column range of its row in pairing.csv, such as 7:22."
        faults.add(grid.place(nameless[0].number, at, _name(header, at)), finding, remedy)
    names = ", ".join(quoted(spelt[rows[0].number]) for rows in list(by_sample.values())[:MOST_NAMES])
    if wanted is None:
        if len(by_sample) > 1:
            remedy = "Write the one to read into the trial, such as [readings] sample = "
            remedy += f"{names.partition(',')[0]}, or in pairing.csv (one row for each sample)."
            faults.add(place, f"rows of several samples: {names}.", remedy)
        return header
    if key not in by_sample:
        finding = f"no row of sample {quoted(wanted)}; column {quoted(_name(header, at))} contains {names}."
        faults.add(place, finding, "Correct the name there, or the file's sample.", wanted)
    rows = [*nameless, *by_sample.get(key, [])]
    return replace(header, body=tuple(sorted(rows, key=lambda row: row.number)))


def _name(header: Header, at: int) -> str:
    return header.sample.name if header.sample is not None else letters(at)


def _column_outside(grid: SheetGrid, header: Header, wanted: str | None) -> int | None:
    """Return the column beside the range of a table that names the wanted sample in its rows, or None."""
    if wanted is None:
        return None
    numbers, key = {row.number for row in header.body}, sample_key(wanted)
    cells = [(at, cell) for row in grid.rows if row.number in numbers for at, cell in enumerate(row.cells)]
    return min((at for at, cell in cells if sample_key(cell.text) == key), default=None)


def names_by_row(grid: SheetGrid, header: Header, column: int) -> dict[int, str]:
    """Return the name of the sample of each row of a table, by the row's number; "" if it is open.

    A name goes on over the cells that it is merged with. It also goes on over blank cells below it, if every name has
    one block of rows, whose places rise or fall, and the places begin again at the next name.
    """
    cells = {row.number: row.cell(column).text for row in grid.rows}
    names = {row.number: cells.get(row.number, "") for row in header.body}
    for top, first, bottom, last in grid.merged:
        if first <= column <= last:
            names |= {number: cells.get(top, "") for number in names if top <= number <= bottom}
    if all(names.values()) or not any(names.values()):
        return names
    down, name = dict[int, str](), ""
    for number, own in names.items():
        name = own or name
        down[number] = name
    blocks = [list(rows) for _, rows in groupby(header.body, key=lambda row: sample_key(down[row.number]))]
    keys = [sample_key(down[block[0].number]) for block in blocks]
    places = [[only_number(row.cell(header.station.index)) for row in block] for block in blocks]
    is_open = "" in keys or len(set(keys)) < len(keys) or not all(map(_is_one_way, places))
    return names if is_open or not all(_begins_again(*pair) for pair in pairwise(places)) else down


def _is_one_way(places: Sequence[float | None]) -> bool:
    """Return whether places rise, or fall, from the first to the last."""
    numbers = [place for place in places if place is not None]
    steps = [after - before for before, after in pairwise(numbers)]
    return len(numbers) == len(places) and bool(steps) and (min(steps) >= 0 or max(steps) <= 0) and any(steps)


def _begins_again(before: Sequence[float | None], after: Sequence[float | None]) -> bool:
    """Return whether places go back at a name, against the direction of those before it."""
    first, last, following = before[0] or 0.0, before[-1] or 0.0, after[0] or 0.0
    return (following - last) * (last - first) < 0
