"""The pairing as a table that a person corrects in a spreadsheet and gives back."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import get_args

from sealtwin.errors import InputError
from sealtwin.lab.naming import Role, Said, as_label, possible_roles
from sealtwin.lab.pairing import Decisions, Placed, Sample
from sealtwin.lab.pieces import Piece
from sealtwin.store.tables import as_text_cell, sheet_text
from validate.sheets.samples import sample_key

PAIRING = "pairing.csv"
COLUMNS = ("file", "role", "sample", "part", "question")
NEEDED = COLUMNS[:3]
PART = "part"
"""Of a file that several samples share. Left blank, the row is about all of the file."""
ROLES: tuple[Role, ...] = get_args(Role)
LARGEST_BYTES = 5_000_000
"""Of all files that are looked at, with long names and questions."""


@dataclass(frozen=True)
class PairingRow:
    """As a person has written it."""

    where: str
    """The file and the line."""
    file: str
    role: str
    sample: str
    part: str


def pairing_text(placed: Sequence[Placed], samples: Sequence[Sample]) -> str:
    """A row for each piece, in the order of samples; a question stands beside the pieces that it is about."""
    asked = {sample.key: " ".join(sample.questions) for sample in samples}
    ordered = sorted(placed, key=lambda item: (item.key, ROLES.index(item.role), item.piece.file, item.piece.part_name))
    return sheet_text(
        COLUMNS,
        [
            (
                item.piece.file.as_posix(),
                item.role,
                item.sample,
                item.piece.part_name,
                asked.get(item.key, "") if item.role != "ignore" else "",
            )
            for item in ordered
        ],
    )


def photographed(rows: Sequence[PairingRow]) -> set[str]:
    """Keys of the samples that are given a photo."""
    return {sample_key(row.sample) for row in rows if row.role == "photo"}


def decided(rows: Sequence[PairingRow], named: Mapping[Piece, Said]) -> Decisions:
    """What the user has decided: pieces whose rows say another thing than their names do, and files taken as a whole.

    Raises InputError, naming all that is wrong: a row whose file or part is not there or stands there twice, a role or
    a sample that cannot be.
    """
    pieces: dict[PurePath, dict[str, Said]] = defaultdict(dict)
    for piece, said in named.items():
        pieces[piece.file][piece.part_name] = said
    by_cell = {as_text_cell(file.as_posix()): file for file in pieces} | {file.as_posix(): file for file in pieces}
    decisions: dict[tuple[PurePath, str], Said] = {}
    seen: set[tuple[PurePath, str]] = set()
    faults = []
    for row in rows:
        file = by_cell.get(row.file)
        if file is None:
            faults.append(f"{row.where}: no file {row.file!r:.80} in the lab's folder; delete the row, or correct it.")
            continue
        part = next((part for part in pieces[file] if row.part in (part, as_text_cell(part))), row.part)
        fault = _fault(file, part, row, pieces[file])
        if (file, part) in seen:
            fault = f"{file} stands there twice; keep one row."
        seen.add((file, part))
        if fault is not None:
            faults.append(f"{row.where}: {fault}")
        elif (said := _said(row)) != pieces[file].get(part):
            decisions[file, part] = said
    if faults:
        raise InputError("\n".join(faults))
    return decisions


def read_pairing(path: Path) -> list[PairingRow]:
    """Whatever dialect a spreadsheet has saved it in. Raises InputError where it is no pairing."""
    from validate.settings import Declared
    from validate.sheets.cells import read_cells

    start = f"'sealtwin ingest FOLDER --out LAB' writes LAB/{PAIRING} to start from."
    if not path.is_file():
        raise InputError(f"{path}: no such file; {start}")
    if (size := path.stat().st_size) > LARGEST_BYTES:
        raise InputError(f"{path}: {size / 1e6:,.0f} MB, which no pairing has; {start}")
    grid = read_cells(path, Declared())
    head = [cell.text for cell in grid.rows[0].cells] if grid.rows else []
    if missing := [name for name in NEEDED if name not in head]:
        raise InputError(
            f"{path}: no column {', '.join(missing)}; a pairing has {', '.join(COLUMNS)} in its first row."
        )
    place = {name: head.index(name) for name in (*NEEDED, PART) if name in head}
    return [
        PairingRow(str(grid.place(row.number)), **{PART: ""} | {name: row.cell(at).text for name, at in place.items()})
        for row in grid.rows[1:]
    ]


def _fault(file: PurePath, part: str, row: PairingRow, parts: Mapping[str, Said]) -> str | None:
    possible = (*possible_roles(file.suffix.lower()), "ignore")
    if part and part not in parts:
        known = ", ".join(repr(name) for name in parts if name) or "none: several samples do not share it"
        return f"{file} has no part {part!r:.80}; its parts are {known}."
    if row.role not in possible:
        return f"{file} cannot be {row.role!r:.40}; write one of {', '.join(possible)}."
    if part and row.role not in ("readings", "ignore"):
        return f"{file}, {part}: can be readings or ignore, not {row.role}."
    if row.role == "ignore":
        return None
    if not sample_key(row.sample):
        return f"{file} is of no sample; write its name, or the role ignore."
    if as_label(row.sample) != row.sample:
        return f"{file}: a sample {row.sample!r:.80}; a name has letters, digits, spaces and -_. only."
    return None


def _said(row: PairingRow) -> Said:
    return Said(as_label(row.sample), ROLES[ROLES.index(row.role)])
