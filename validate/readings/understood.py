"""Account of how a sheet was understood: a sentence on the whole of it, and a line for each of its columns."""

from sealtwin.core.records import ReadColumn
from validate.readings.columns import Header
from validate.readings.sheet import SheetGrid, letters, shown
from validate.settings import Decimal, Declared
from validate.units import LABELS, counted

WAYS = {"level": "level upward", "depth": "depth downward", None: "reading"}
NO_SUCH = "skip: no such row"
MOST_ROWS_SHOWN = 8  # Rows that are named as not read


def dialect_of(
    grid: SheetGrid, header: Header, declared: Declared, mark: Decimal | None, repeats: int, missing: int
) -> str:
    """Return in a sentence how a sheet was understood, so that whoever measured can see that it was meant."""
    units = list(dict.fromkeys(str(column.unit) for column in header.readings))
    counting = f"{WAYS[header.quantity]} in {' and '.join(units)} from {LABELS['datums'][declared.datum]}"
    if declared.datum != "sample_surface":
        counting += f", {declared.datum_level_mm or 0.0:+g} mm from the sample surface"
    if units != [header.station.unit]:
        counting += f", places in {header.station.unit}"
    sample = () if declared.sample is None else (f"rows of {shown(declared.sample)}",)
    written = ", ".join((*grid.written, *sample, *(() if mark is None else (f"decimal {mark}",))))
    layout = f"{'wide' if header.repeat is None else 'long'}, {counted(repeats, 'repeat')}"
    skipped = ", ".join(shown(column.name) for column in header.skipped[:8])
    more = {
        f"{counted(missing, 'reading')} missing": missing,
        f"{counted(header.above, 'line')} above the header": header.above,
        f"not readings: {skipped}": skipped,
    }
    return "; ".join((written, layout, counting, *(text for text, said in more.items() if said), *grid.remarks))


def understood(grid: SheetGrid, header: Header, along: str = "s") -> tuple[ReadColumn, ...]:
    """Return the columns of a table and what each is taken for, then the rows that are not read."""
    way, turned = WAYS[header.quantity], grid.turned
    several = header.repeat is None and len(header.readings) > 1
    roles = {one.index: f"{way}, {at}" if several else way for at, one in enumerate(header.readings, start=1)}
    others = ((header.station, along), (header.repeat, "repeat"), (header.sample, "sample"))
    roles |= {one.index: what for one, what in others if one is not None}
    columns = [
        ReadColumn(
            letters(column.index) if turned is None else f"row {turned[column.index]}",
            shown(column.name),
            roles.get(column.index, "not read"),
            column.unit or "",
            shown(next((text for row in header.body if (text := row.cell(column.index).text)), "")),
        )
        for column in sorted([*header.read, *header.skipped], key=lambda column: column.index)
    ]
    for row in (*header.remarks, *header.passed)[:MOST_ROWS_SHOWN]:
        place, what = (f"{row.number}", "row") if turned is None else (letters(row.number - 1), "column")
        text = next(cell.text for cell in row.cells if cell.text)
        columns.append(ReadColumn(place, shown(text), f"{what}, not read", "", ""))
    return (*columns, *(ReadColumn("-", shown(text), NO_SUCH, "", "") for text in header.unmet))
