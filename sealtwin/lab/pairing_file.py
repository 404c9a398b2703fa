"""The pairing as a table that a person corrects in a spreadsheet and gives back."""

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import get_args

from sealtwin.errors import InputError
from sealtwin.files import as_text_cell, sheet_text
from sealtwin.lab.naming import Role, Said, as_label, possible_roles, sample_key
from sealtwin.lab.pairing import Placed, Sample

PAIRING = "pairing.csv"
COLUMNS = ("file", "role", "sample", "question")
ROLES: tuple[Role, ...] = get_args(Role)


def pairing_text(placed: Sequence[Placed], samples: Sequence[Sample]) -> str:
    """A row for each file, in the order of samples; a question stands beside the files that it is about."""
    asked = {sample.key: " ".join(sample.questions) for sample in samples}
    ordered = sorted(placed, key=lambda item: (item.key, ROLES.index(item.role), item.file))
    return sheet_text(
        COLUMNS,
        [
            (item.file.as_posix(), item.role, item.sample, asked.get(item.key, "") if item.role != "ignore" else "")
            for item in ordered
        ],
    )


def read_pairing(path: Path, named: Mapping[PurePath, Said]) -> dict[PurePath, Placed]:
    """What the user has decided: files whose rows say another thing than their names do.

    Raises InputError, naming all that is wrong: a row whose file is not there or stands there twice, a role or a sample
    that cannot be.
    """
    by_cell = {as_text_cell(file.as_posix()): file for file in named} | {file.as_posix(): file for file in named}
    rows = _rows(path)
    decided: dict[PurePath, Placed] = {}
    seen: set[PurePath] = set()
    faults = []
    for where, row in rows:
        file = by_cell.get(row["file"])
        if file is None:
            faults.append(f"{where}: no file {row['file']!r:.80} in the lab's folder; delete the row, or correct it.")
        elif file in seen:
            faults.append(f"{where}: {file} stands there twice; keep one row.")
        else:
            seen.add(file)
            fault = _fault(file, row)
            if fault is not None:
                faults.append(f"{where}: {fault}")
            elif (said := _said(row)) != named[file]:
                decided[file] = Placed(file, said.role, said.sample, by_user=True)
    if faults:
        raise InputError("\n".join(faults))
    return decided


def _rows(path: Path) -> list[tuple[str, Mapping[str, str]]]:
    """Each with its place, whatever dialect a spreadsheet has saved it in."""
    from validate.settings import Declared
    from validate.sheets.cells import read_cells

    if not path.is_file():
        raise InputError(
            f"{path}: no such file; 'sealtwin ingest FOLDER --out LAB' writes LAB/{PAIRING} to start from."
        )
    grid = read_cells(path, Declared())
    head = [cell.text for cell in grid.rows[0].cells] if grid.rows else []
    if missing := [name for name in COLUMNS[:3] if name not in head]:
        raise InputError(
            f"{path}: no column {', '.join(missing)}; a pairing has {', '.join(COLUMNS)} in its first row."
        )
    place = {name: head.index(name) for name in COLUMNS[:3]}
    return [
        (str(grid.place(row.number)), {name: row.cell(column).text for name, column in place.items()})
        for row in grid.rows[1:]
    ]


def _fault(file: PurePath, row: Mapping[str, str]) -> str | None:
    possible = (*possible_roles(file.suffix.lower()), "ignore")
    if row["role"] not in possible:
        return f"{file} cannot be {row['role']!r:.40}; write one of {', '.join(possible)}."
    if row["role"] != "ignore" and not sample_key(row["sample"]):
        return f"{file} is of no sample; write its name, or the role ignore."
    return None


def _said(row: Mapping[str, str]) -> Said:
    return Said(as_label(row["sample"]), ROLES[ROLES.index(row["role"])])
