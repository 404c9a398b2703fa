"""A sheet of a liquid weighed into a crack, as labs write it: mass and level of each step, under names of any language.

It is known by its columns: one is a mass, none a place along the crack.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from digitise.weighing.fill import WeighedFill
from sealtwin.core.settings import checked
from validate.readings.header_words import WORDS, is_calculated, is_number, meaning, quantity_in, unit_in
from validate.readings.read_readings import MM
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetGrid, SheetRow, letters, quoted, refuse
from validate.readings.table_rows import columns_named, first_cell, is_a_number
from validate.readings.text_table import common_mark, number, plain_letters
from validate.settings import SIGNS, Declared

MASS = frozenset(WORDS["fill"]["mass"].split())
GRAMS: dict[str, float] = WORDS["fill"]["grams"]
LEAST_STEPS = 2
SAY = "Say it in pairing.csv: mass and levels by the letters of their columns; or is its role readings, or note?"
Names = Mapping[int, str]


def is_fill(grid: SheetGrid) -> bool:
    """Return whether a sheet can only be a fill: a mass over numbers, at most one other column, and no place."""
    for names, body in _headers(grid):
        masses = [at for at in names if _is_mass(names[at])]
        if not masses or sum(is_a_number(row.cell(masses[0])) for row in body) < LEAST_STEPS:
            continue
        found = {at: meaning(name) for at, name in names.items() if at not in masses}
        others = {at for row in body for at, cell in enumerate(row.cells) if is_a_number(cell)} - {*masses}
        others -= {at for at, one in found.items() if one is not None and one.role == "skipped"}
        return len(others) <= 1 and not any(one is not None and one.role == "station" for one in found.values())
    return False


def read_fill(path: Path, answers: Mapping[str, str]) -> tuple[dict[str, Any], str]:
    """Return the columns of [crack.fill] of a trial, and in a sentence how the sheet was understood.

    ``answers`` are the user's. Raises InputError: file, row, column and value, and what to answer.
    """
    grid = read_cells(path, Declared(sheet=answers.get("sheet")))
    head, _, unit = (answer := answers.get("mass", "")).rpartition(" ")
    reference, unit = (head, unit) if head and unit in GRAMS else (answer, "")
    names, body, mass_at = _mass_column(grid, reference)
    place = grid.place(body[0].number - 1)
    level_at = _level_column(grid, names, body, mass_at, answers.get("levels"))
    mass_name, level_name = (names.get(at, letters(at)) for at in (mass_at, level_at))
    grams = _grams(unit or mass_name)
    if grams is None:
        raise refuse(place, f"{quoted(mass_name)}: no unit.", 'Say it in pairing.csv, as mass = "A g" (or kg).')
    length = answers.get("unit", "").lower() or unit_in(level_name)
    if length not in MM:
        raise refuse(place, f"{quoted(level_name)}: no unit.", "Say it in pairing.csv: unit, one of mm, cm, m, inch.")
    quantity = SIGNS.get(answers.get("sign", "").lower()) or quantity_in(level_name)
    if quantity is None:
        found = f"{quoted(level_name)} says neither level (upward from the face) nor depth (downward)."
        raise refuse(place, found, "Say it in pairing.csv: sign, up or down.")
    both = [(row, row.cell(mass_at), row.cell(level_at)) for row in body]
    mark = common_mark((cell.text for _, *cells in both for cell in cells if cell.kind == "text"), grid.separator)
    steps = list[tuple[float, float]]()
    for row, *cells in both:
        read = [number(cell.text, None if cell.kind == "number" else mark) for cell in cells]
        first = first_cell(row)
        if all(value is None for value in read) or (first is not None and is_calculated(first.text)):
            continue
        for at, name, cell, value in zip((mass_at, level_at), (mass_name, level_name), cells, read, strict=True):
            if value is None:
                raise refuse(grid.place(row.number, at, name), f"{quoted(cell.text)} is no number.", "Write it.")
        steps.append((read[0] or 0.0, read[1] or 0.0))
    way = MM[length] * (-1 if quantity == "depth" else 1)
    table = {
        "mass_g": [round(mass_ * grams, 6) for mass_, _ in steps],
        "level_mm": [round(level * way, 6) + 0.0 for _, level in steps],
    }
    checked(WeighedFill, path, table)
    shown = f"{path}: a fill of {len(steps)} steps, up to {table['mass_g'][-1]:g} g at {table['level_mm'][-1]:g} mm"
    return table, f"{shown}; mass in {quoted(mass_name)}, {quantity} in {quoted(level_name)}."


def _headers(grid: SheetGrid) -> Iterator[tuple[Names, Sequence[SheetRow]]]:
    """Yield each row that may name columns, a row of units joined to it, and the rows below."""
    for at, row in enumerate(grid.rows):
        names, body = {at: cell.text for at, cell in enumerate(row.cells) if cell.text}, grid.rows[at + 1 :]
        if body and not any(map(is_a_number, body[0].cells)):
            below = {at: cell.text for at, cell in enumerate(body[0].cells) if cell.text}
            if any(len(_words(text)) == 1 and _grams(text) is not None for text in below.values()):
                names, body = {at: f"{name} {below.get(at, '')}" for at, name in names.items()}, body[1:]
        yield names, body


def _mass_column(grid: SheetGrid, reference: str) -> tuple[Names, Sequence[SheetRow], int]:
    """Return names of columns, the rows below, and the column of masses."""
    for names, body in _headers(grid):
        found = columns_named(names, reference) if reference else [at for at in names if _is_mass(names[at])]
        numbers = [at for at in found if sum(is_a_number(row.cell(at)) for row in body) >= LEAST_STEPS]
        if len(numbers) == 1 and not is_number(names.get(numbers[0], "")):
            return names, body, numbers[0]
    raise refuse(grid.place(), "no column of masses, or several.", SAY)


def _level_column(grid: SheetGrid, names: Names, body: Sequence[SheetRow], mass_at: int, reference: str | None) -> int:
    numeric = {at for row in body for at, cell in enumerate(row.cells) if is_a_number(cell)} - {mass_at}
    if reference is not None:
        found = columns_named(names, reference)
    else:
        # One that says a level or a depth goes before one that only may be one.
        skipped = {at for at, name in names.items() if (one := meaning(name)) is not None and one.role == "skipped"}
        found = [at for at in numeric if quantity_in(names.get(at, ""))] or [*(numeric - skipped)]
    if len(found) != 1:
        beside = ", ".join(f"{letters(at)} {quoted(names.get(at, ''))}" for at in sorted(numeric))
        what = f"{len(found) or 'no'} columns of levels beside {quoted(names.get(mass_at, ''))}, among {beside}."
        raise refuse(grid.place(body[0].number - 1), what, SAY)
    return found[0]


def _words(name: str) -> list[str]:
    return "".join(letter if letter.isalpha() else " " for letter in plain_letters(name)).split()


def _is_mass(name: str) -> bool:
    return bool(MASS.intersection(_words(name)))


def _grams(name: str) -> float | None:
    """Return how many grams the unit is that a name ends with, or None."""
    return next((GRAMS[word] for word in reversed(_words(name)) if word in GRAMS), None)
