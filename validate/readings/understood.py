"""Account of how a sheet was understood: a sentence on the whole of it, and a line for each of its columns."""

from sealtwin.core.records import ReadColumn
from validate.readings.columns import Header
from validate.readings.sheet import SheetGrid, letters, shown
from validate.settings import Decimal, Declared
from validate.units import LABELS, counted

MOST_ROWS_SHOWN = 8  # Rows that are named as not read


def dialect_of(
    grid: SheetGrid, header: Header, declared: Declared, mark: Decimal | None, repeats: int, missing: int
) -> str:
    """Return in a sentence how a sheet was understood, so that whoever measured can see that it was meant."""
    sample = () if declared.sample is None else (f"rows of {shown(declared.sample)}",)
    decimal = () if mark is None else (f"decimal {mark}",)
    units = list(dict.fromkeys(str(column.unit) for column in header.readings))
    upward = "upward" if header.quantity == "level" else "downward"
    counting = f"{header.quantity} {upward} in {' and '.join(units)} from {LABELS['datums'][declared.datum]}"
    if declared.datum != "sample_surface":
        counting += f", {declared.datum_level_mm or 0.0:+g} mm from the sample surface"
    if units != [header.station.unit]:
        counting += f", places in {header.station.unit}"
    layout = "wide" if header.repeat is None else "long"
    parts = [", ".join((*grid.written, *sample, *decimal)), f"{layout}, {counted(repeats, 'repeat')}", counting]
    if missing:
        parts.append(f"{counted(missing, 'reading')} missing")
    if header.above:
        parts.append(f"{counted(header.above, 'line')} above the header")
    if header.skipped:
        parts.append("not readings: " + ", ".join(shown(column.name) for column in header.skipped[:8]))
    return "; ".join((*parts, *grid.remarks))


def understood(grid: SheetGrid, header: Header) -> tuple[ReadColumn, ...]:
    """Return the columns of a table and what each is taken for, then the rows that are not read."""
    roles = {header.station.index: "s"}
    for place, column in enumerate(header.readings, start=1):
        way = (
            f"{header.quantity} {'upward' if header.quantity == 'level' else 'downward'}"
            if header.quantity
            else "reading"
        )
        roles[column.index] = f"{way}, {place}" if header.repeat is None and len(header.readings) > 1 else way
    roles |= {
        one.index: what for one, what in ((header.repeat, "repeat"), (header.sample, "sample")) if one is not None
    }
    what = "row" if grid.turned is None else "column"
    shown_columns = [
        ReadColumn(
            letters(column.index) if grid.turned is None else f"row {grid.turned[column.index]}",
            shown(column.name),
            roles.get(column.index, "not read"),
            column.unit or "",
            shown(next((text for row in header.body if (text := row.cell(column.index).text)), "")),
        )
        for column in sorted([*header.read, *header.skipped], key=lambda column: column.index)
    ]
    texts = [(row, next(cell.text for cell in row.cells if cell.text)) for row in (*header.remarks, *header.passed)]
    rows = [
        ReadColumn(
            f"{row.number}" if grid.turned is None else letters(row.number - 1),
            shown(text),
            f"{what}, not read",
            "",
            "",
        )
        for row, text in texts[:MOST_ROWS_SHOWN]
    ]
    return (*shown_columns, *rows)
