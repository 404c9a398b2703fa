"""The rows of a table that name its columns."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from validate.readings.header_words import (
    OTHER_UNITS,
    is_number,
    is_particular,
    is_scaled_unit,
    meaning,
    repeat_number,
    unit_of,
)
from validate.readings.place_words import may_be_place
from validate.readings.sheet import BLANK, MOST_COLUMNS, SheetRow
from validate.readings.table_rows import columns_named, is_a_number, plain_name
from validate.readings.text_table import NOTE_HEAD, is_missing, plain_letters
from validate.settings import Columns

MOST_LINES_ABOVE = 100
"""Limit on the lines of title and notes above a header; a header further down belongs to another table."""
MOST_HEADER_ROWS = 4
Merged = Sequence[tuple[int, int, int, int]]  # Ranges of cells, as in ``SheetGrid``
DATE = re.compile(r"(?<!\d)(\d{1,2}\s?[./-]\s?\d{1,2}\s?[./-]\s?\d{2,4}|\d{4}-\d{2}-\d{2})(?!\d)")


@dataclass(frozen=True)
class HeaderRows:
    """Rows that contain the column names."""

    first: int  # Index of the first header row
    count: int
    names: Mapping[int, str]  # Name of each column from 0, joined from its cells
    units: Sequence[SheetRow] = ()  # Rows of units between the names and those below


def find_header(rows: Sequence[SheetRow], merged: Merged, given: Columns) -> HeaderRows:
    """Return the rows that name the most columns. These are several if a name spans columns and continues below."""
    if isinstance(given.header_rows, str):
        return _stated_header(rows, merged, given.header_rows)
    wanted = {plain_name(name) for name in (given.s, given.repeat, *(given.levels or ())) if name is not None}

    def key(candidate: tuple[int, Sequence[SheetRow]]) -> tuple[float, ...]:
        first, header = candidate
        named, _ = _without_units(header)
        names = _joined(named, merged)
        written = {at: name for at, name in names.items() if any(row.cell(at).text for row in named)}
        hits = len(wanted & set(map(plain_name, written.values())))
        likeness = _likeness(written)
        # Only unknown names are known by the numbers below them: a row that is no row of numbers may be a mistake.
        above = not any(likeness[:3]) and _is_above_numbers(header, rows[first + len(header) :])
        # Of equals, prefer names of repeats below, then fewer rows, then the first; units are in a row of their own.
        return hits, *likeness, above, len(header) > 1 and _names_repeats(header[-1]), -len(named), -first

    candidates = list(_candidates(rows, merged, given.header_rows))
    whole = [one for one in candidates if not _leaves_names(*one, rows)]
    candidates = whole if any(any(key(one)[1:3]) for one in whole) else candidates
    begin = _first_numbers(rows, given)
    if begin is not None:
        higher = [one for one in candidates if one[0] + len(one[1]) <= begin]
        candidates = [one for one in higher if _ends_at(one, rows, begin)]
        candidates = candidates or [one for one in higher if any(key(one)[1:4])]
    best = max(candidates, key=key, default=(begin or 0, ()))
    hits, *likeness = key(best) if best[1] else (0, *_likeness({}), False)
    above = likeness[5]
    if not hits and given.header_rows is not None and not (any(likeness[:3]) or above):
        best = 0, rows[: given.header_rows]
    elif begin is None and not hits and not any(likeness[:4]) and _begins_with_numbers(best[1]):
        best = best[0], ()  # The sheet begins with readings.
    named, units = _without_units(best[1])
    return HeaderRows(best[0], len(best[1]), _joined(named, merged), units)


def _leaves_names(first: int, header: Sequence[SheetRow], rows: Sequence[SheetRow]) -> bool:
    """Return whether the row above a header names columns of numbers that the header does not name."""
    above, below = rows[first - 1] if first else None, rows[first + len(header) :]
    if above is None or any(map(is_a_number, above.cells)) or _is_title(above, rows[first:]):
        return False
    numeric = {at for row in below[:MOST_HEADER_ROWS] for at, cell in enumerate(row.cells) if is_a_number(cell)}
    return any(above.cell(at).text and all(row.cell(at) == BLANK for row in header) for at in numeric)


def _begins_with_numbers(header: Sequence[SheetRow]) -> bool:
    return bool(header) and sum(map(is_a_number, header[0].cells)) > 1


def _first_numbers(rows: Sequence[SheetRow], given: Columns) -> int | None:
    """Return the index of the row at which the numbers of given columns begin; None if s is not given by a letter.

    Two rows of numbers are needed, since one may be a particular of the sheet.
    """
    lettered = columns_named({}, given.s or "")
    named = {plain_name(cell.text) for row in rows[:MOST_LINES_ABOVE] for cell in row.cells}
    if len(lettered) != 1 or (given.s and not given.s.isupper() and plain_name(given.s) in named):
        return None
    levels = {at for level in given.levels or () for at in columns_named({}, level)} - {lettered[0]}
    beside = [_has_number(row, levels) for row in rows]
    along = [
        _has_number(row, lettered) or (has_level and may_be_place(row.cell(lettered[0])))
        for row, has_level in zip(rows, beside, strict=True)
    ]
    both = [is_along and has_level for is_along, has_level in zip(along, beside, strict=True)]
    starts = [at for at in range(len(rows)) if all(both[at : at + 2])] or [at for at, one in enumerate(along) if one]
    if not starts:
        return None
    # Readings of the first station may be unreadable.
    return next((at for at in range(starts[0], 0, -1) if not along[at - 1]), 0)


def _has_number(row: SheetRow, columns: Iterable[int]) -> bool:
    return any(is_a_number(row.cell(at)) or row.cell(at).kind == "formula" for at in columns)


def _ends_at(candidate: tuple[int, Sequence[SheetRow]], rows: Sequence[SheetRow], begin: int) -> bool:
    """Return whether a header ends where numbers begin. Units, or a remark in one cell, may be between them."""
    first, header = candidate
    end = first + len(header)
    filled = {at for row in header for at, cell in enumerate(row.cells) if cell != BLANK}
    between = (is_units_row(row) or sum(cell != BLANK for cell in row.cells) == 1 for row in rows[end:begin])
    return end <= begin and len(filled) > 1 and all(between)


def header_of_note(rows: Sequence[SheetRow]) -> HeaderRows | None:
    """Return the header of a note; None if it is outside of the declared range."""
    first = next((at for at, row in enumerate(rows) if row.cells == NOTE_HEAD), None)
    return None if first is None else HeaderRows(first, 1, _joined([rows[first]], ()))


def _stated_header(rows: Sequence[SheetRow], merged: Merged, span: str) -> HeaderRows:
    """Return the header of declared rows, such as "3:5"."""
    top, bottom = map(int, span.split(":"))
    header = [row for row in rows if top <= row.number <= bottom]
    named, units = _without_units(header)
    first = next((at for at, row in enumerate(rows) if row.number >= top), len(rows) - 1)
    return HeaderRows(first, len(header), _joined(named, merged), units)


def _without_units(header: Sequence[SheetRow]) -> tuple[list[SheetRow], list[SheetRow]]:
    """Return the rows of a header that have names, and the rows of units between or below them."""
    units = [row for row in header[1:] if is_units_row(row)]
    return [row for row in header if row not in units], units


def is_units_row(row: SheetRow) -> bool:
    """Return whether a row contains only units."""
    texts = [cell.text for cell in row.cells if not is_missing(cell.text)]
    units = [text for text in texts if unit_of(text) or is_scaled_unit(text)]
    return bool(units) and all(text in units or plain_letters(text.strip("[]()")) in OTHER_UNITS for text in texts)


def _is_above_numbers(header: Sequence[SheetRow], below: Sequence[SheetRow]) -> bool:
    """Return whether a row without numbers is directly above a row of numbers, as the names of a table are."""
    rest = below[1:] if below and is_units_row(below[0]) else below
    return not any(map(is_a_number, header[0].cells)) and bool(rest) and sum(map(is_a_number, rest[0].cells)) > 1


def _candidates(
    rows: Sequence[SheetRow], merged: Merged, declared: int | None
) -> Iterator[tuple[int, Sequence[SheetRow]]]:
    """Yield the candidates for the header, each with the index of its first row."""
    for first in range(min(len(rows), MOST_LINES_ABOVE)):
        for count in range(1, MOST_HEADER_ROWS + 1) if declared is None else (declared,):
            header = rows[first : first + count]
            if len(header) < count or _has_decimals(rows[first]):
                break
            if declared is None and count > 1:
                if is_units_row(header[-1]):
                    continue  # The rows of a header end with names; units below them are no part of it.
                named, _ = _without_units(header[:-1])
                if not _continues(_joined(named, merged), header[-1]):
                    break
                if _is_above_names(header, merged):
                    continue
            is_title = not header or _is_title(header[0], rows[first + 1 :])
            if not is_title and not _is_cut(header, rows[first + count :], merged):
                yield first, header


def _has_decimals(row: SheetRow) -> bool:
    """Return whether a row has several decimal numbers, as rows of readings have, and no header."""
    return sum(is_number(cell.text) and not cell.text.strip("+-").isdigit() for cell in row.cells) > 1


def _is_above_names(header: Sequence[SheetRow], merged: Merged) -> bool:
    """Return whether the first row is a title: each of its columns has a name below, to which it adds nothing."""
    named = [at for at, cell in enumerate(header[0].cells) if cell != BLANK]
    if not all(any(row.cell(at) != BLANK for row in header[1:]) for at in named):
        return False
    return 0 < _facts(header[1:], merged) >= _facts(header, merged)


def _facts(header: Sequence[SheetRow], merged: Merged) -> int:
    """Return how many roles, units, directions and numbers the names of a header's columns state."""
    meanings = map(meaning, _joined(_without_units(header)[0], merged).values())
    read = [each for each in meanings if each is not None and each.role != "skipped"]
    return sum(1 + bool(each.unit) + bool(each.quantity) + bool(each.number) for each in read)


def _is_title(row: SheetRow, below: Sequence[SheetRow]) -> bool:
    """Return whether a row is a title, unlike any header: it has a date, or particulars such as "Probe S11".

    Directly above numbers, a row with such words among others is a header.
    """
    cells = [cell for cell in row.cells if cell != BLANK]
    dated = [cell for cell in cells if cell.kind == "date" or DATE.search(cell.text)]
    if dated and len(cells) < 3:
        return True
    if _is_above_numbers([row], below):
        return False
    if any(cell.kind == "date" or DATE.fullmatch(cell.text) for cell in dated):
        return True
    roles = {named.role for cell in cells if (named := meaning(cell.text)) is not None}
    return not roles & {"station", "mass", "reading", "repeat"} and any(is_particular(cell.text) for cell in cells)


def _continues(names: Mapping[int, str], below: SheetRow) -> bool:
    """Return whether a row continues a header: words, or repeat numbers 1, 2, 3 in a header with a station column."""
    cells = [cell for cell in below.cells if cell != BLANK]
    numbers = {at: cell.text for at, cell in enumerate(below.cells) if cell.kind != "text" or is_number(cell.text)}
    if numbers:
        stations = [at for at, name in names.items() if (named := meaning(name)) and named.role == "station"]
        above = {meaning(names.get(at, "")) for at in numbers}
        are_repeats = len(above) == 1 and all(what is not None and what.role == "reading" for what in above)
        stations = stations or ([] if are_repeats else list(names)[:1])
        counted = [repeat_number(text) for text in numbers.values()] == [*range(1, len(numbers) + 1)]
        return (
            counted and (are_repeats or bool(stations)) and all(unit_of(below.cell(at).text or "mm") for at in stations)
        )
    return not all(unit_of(cell.text) or is_missing(cell.text) for cell in cells)


def _names_repeats(row: SheetRow) -> bool:
    """Return whether a row contains only names of readings, such as "Messung 1", or their numbers."""
    texts = [cell.text for cell in row.cells if cell.text]
    roles = {named.role for text in texts if not is_number(text) and (named := meaning(text)) is not None}
    return roles <= {"reading", "repeat"} and all(
        repeat_number(text) is not None or is_number(text) or meaning(text) is not None for text in texts
    )


def _is_cut(header: Sequence[SheetRow], below: Sequence[SheetRow], merged: Merged) -> bool:
    """Return whether a name is merged with cells above the header, or below it and a row of units."""
    first, last = header[0].number, header[-1].number
    last = below[0].number if merged and below and is_units_row(below[0]) else last
    return any(
        top < first <= bottom or first <= top <= last < bottom < top + MOST_HEADER_ROWS for top, _, bottom, _ in merged
    )


def _joined(rows: Sequence[SheetRow], merged: Merged) -> dict[int, str]:
    """Join the names of each column: "Tiefe [mm]" above "Messung 1" and "Messung 2" is part of both.

    A name spans the cells that it is merged with, or blank cells up to the next name. A merged name without names below
    it is the name of repeats, which are then numbered.
    """
    spans = {(row, column): min(last, MOST_COLUMNS) for row, column, last_row, last in merged if last_row == row}
    width = max((row.width for row in rows), default=0)
    names, own = dict[int, str](), set[int]()
    for place, row in enumerate(rows):
        below = {at for other in rows[place + 1 :] for at, cell in enumerate(other.cells) if cell.text}
        starts = [at for at, cell in enumerate(row.cells) if cell.text]
        is_merged = any((row.number, at) in spans for at in starts)
        for start, following in zip(starts, [*starts[1:], None], strict=True):
            last = spans.get((row.number, start), start)
            beyond = last + 1 if is_merged or not below else following or 1 + max(start, *below)
            for at in range(start, beyond):
                if at == start or at in below:
                    names[at] = _either(names.get(at, ""), row.cell(start).text, whole=at in own)
                elif not below:
                    names[at] = f"{row.cell(start).text} {at - start + 1}"
            if last > start and not below and len(rows) == 1:
                names[start] += " 1"
            # A name that is merged over some columns is part of their names; over all columns it is a title.
            own |= set(range(start, last + 1)) if last > start and last - start + 1 < width else set()
    return dict(sorted(names.items()))


def _either(upper: str, lower: str, *, whole: bool) -> str:
    """Join two names. If only one has a meaning, such as the one below a title, return that one, unless ``whole``."""
    joined = f"{upper} {lower}".strip()
    if whole or not upper or not lower or meaning(joined) is not None:
        return joined
    return next((name for name in (lower, upper) if meaning(name) is not None), joined)


def _likeness(names: Mapping[int, str]) -> tuple[bool, bool, int, int, int]:
    """Return a sort key that grows with the number of names that have a meaning. Notes above may have some, too."""
    roles = [named.role for name in names.values() if (named := meaning(name)) is not None]
    along = "station" in roles or "mass" in roles
    table = along and ("reading" in roles or "repeat" in roles)
    return table, along, sum(role != "skipped" for role in roles), len(roles), min(len(names), 2)
