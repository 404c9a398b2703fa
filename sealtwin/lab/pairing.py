"""Pairing of files to samples by their names, as corrected by the user. Doubtful cases are asked, never decided."""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path, PurePath
from typing import Any, get_args

from sealtwin.core.errors import InputError
from sealtwin.core.files import as_text_cell, sheet_text
from sealtwin.lab.found_files import LeftOut, Piece, Role, Said, as_label, few, possible_roles, read_name
from validate.readings.samples import SamplePart, named_cells, read_table, sample_key

PAIRING = "pairing.csv"
ANSWERS = ("sheet", "s", "levels", "unit", "sign", "range", "skip", "missing", "as_written")
"""Columns that answer what a sheet leaves open, by the letters of its columns; blank where nothing is asked."""
COLUMNS = ("file", "role", "sample", "part", *ANSWERS, "question")
"""The part is that of a file that several samples share; blank for the whole file."""
SPANS = re.compile(r"[A-Z]{1,3}(:[A-Z]{1,3})?([\s,;]+[A-Z]{1,3}(:[A-Z]{1,3})?)*")  # B C D, or B:D
ROLES: tuple[Role, ...] = get_args(Role)
LIKENESS = 0.65  # Share of letters that two names have in one order; P0l and P01 have two of three
LONGEST_NAME = 80  # Longest name of a sample, and of a trial

Decisions = Mapping[tuple[PurePath, str], Said]
"""Decisions of the user on files and on parts of them by name; "" is the whole file."""
Answers = Mapping[tuple[str, str], Mapping[str, str]]
"""Answers on sheets by file and part, each as it stands in a column of the pairing file."""


@dataclass(frozen=True)
class SampleFiles:
    """Files of one sample, and what is in doubt about them."""

    name: str
    files: Mapping[Role, PurePath]  # One of a role; a photo among them, if ``questions`` is empty
    questions: tuple[str, ...]
    part: SamplePart | None = None  # Part of the file of readings, where samples share it
    lost: tuple[str, ...] = ()  # Files of its own that take no part, a sentence each, where no other stands in for them
    texts: tuple[PurePath, ...] = ()  # Free texts, which are kept and say nothing

    @property
    def key(self) -> str:
        return sample_key(self.name)


def place_files(named: Mapping[Piece, Said], decided: Decisions) -> dict[Piece, Said]:
    """Place each piece by the user's decision, on it or on all of its file, or else by what its name says."""
    placed: dict[Piece, Said] = {}
    for piece, said in named.items():
        if (piece.file, "") in decided:
            piece = Piece(piece.file)
        placed[piece] = decided.get((piece.file, piece.part_name), said)
    return placed


def pair(placed: Mapping[Piece, Said]) -> list[SampleFiles]:
    """Return samples in the order of their names; files to be ignored are of none, nor are texts without a sample."""
    groups: dict[str, dict[Piece, Said]] = defaultdict(dict)
    texts: dict[str, list[PurePath]] = defaultdict(list)
    for piece, said in placed.items():
        if said.role == "text":
            texts[sample_key(said.sample)].append(piece.file)
        elif said.role != "ignore":
            groups[sample_key(said.sample)][piece] = said
    alike = _alike(groups)
    samples = [_sample(key, group, alike.get(key, [])) for key, group in sorted(groups.items())]
    return [replace(sample, texts=tuple(texts.get(sample.key, ()))) for sample in samples]


def hold_back(
    samples: Sequence[SampleFiles], left_out: Sequence[LeftOut], folder: str
) -> tuple[list[SampleFiles], list[LeftOut]]:
    """Return samples with the files that they have lost, and the files left out that are of none of them.

    What was saved anew beside it, P01.csv beside P01.xls, stands in for it. ``folder`` is the name of the lab's own: of
    the sample whose files bear none.
    """
    by_key = {sample.key: sample for sample in samples}
    others = []
    for left in left_out:
        sample = None if left.said is None else by_key.get(sample_key(left.said.sample or as_label(folder)))
        if left.said is None or sample is None or left.said.role in sample.files:
            others.append(left)
        else:
            by_key[sample.key] = replace(sample, lost=(*sample.lost, left.sentence))
    return list(by_key.values()), others


def _sample(key: str, group: Mapping[Piece, Said], alike: Sequence[Mapping[Piece, Said]]) -> SampleFiles:
    """Return a sample with its questions. ``alike`` are the groups of files that may be of one sample with it."""
    by_role: dict[Role, list[Piece]] = defaultdict(list)
    for piece, said in group.items():
        by_role[said.role].append(piece)
    name = group[by_role["photo"][0] if "photo" in by_role else next(iter(group))].sample
    files: dict[Role, PurePath] = {role: pieces[0].file for role, pieces in by_role.items() if len(pieces) == 1}
    questions = [
        f"{len(pieces)} files are its {role.replace('_', ' ')}: {few(pieces)}; "
        "keep one, and give the others the role ignore."
        for role, pieces in by_role.items()
        if len(pieces) > 1
    ]
    if not key:
        questions = [f"{piece}: its name says no sample; rename it, or give it a sample." for piece in group]
    elif "photo" in by_role:
        questions += [
            f"{few(by_role['photo'])}: {few(list(orphan))} has no photo and nearly its name; decide about it first."
            for orphan in alike
        ]
    else:
        photos = [piece for other in alike for piece, said in other.items() if said.role == "photo"]
        likely = f"Is it of {few(photos)}? Name both alike" if photos else "Add it, give it the sample's name"
        questions.append(f"{few(list(group))}: no photo of sample {name}. {likely}, or give this the role ignore.")
    return SampleFiles(name, files, tuple(questions), by_role["readings"][0].part if "readings" in files else None)


def _alike(groups: Mapping[str, Mapping[Piece, Said]]) -> dict[str, list[Mapping[Piece, Said]]]:
    """Return, for each sample without a photo, those with one whose files it may be of; for one such, vice versa.

    Names are compared without their folders, too: May/P01.jpg and sheets/P01.csv.
    """
    roles = {key: {said.role for said in group.values()} for key, group in groups.items()}
    names = {key: {key, *map(_own_key, group)} - {""} for key, group in groups.items()}
    alike: dict[str, list[Mapping[Piece, Said]]] = defaultdict(list)
    for key in sorted(key for key in groups if key and "photo" not in roles[key]):
        by_name: dict[str, set[str]] = defaultdict(set)
        # A sample that lacks what the orphan has waits for it.
        for other in (other for other in groups if "photo" in roles[other] and not roles[other] & roles[key]):
            for name in names[other]:
                by_name[name].add(other)
        close = [name for name in by_name if any(name in mine or mine in name for mine in names[key])]
        close = close or [name for mine in names[key] for name in get_close_matches(mine, by_name, cutoff=LIKENESS)]
        likely = set[str]().union(*(by_name[name] for name in close))
        alike[key] = [groups[other] for other in sorted(likely)]
        # Of several that may be meant none is held back.
        if len(likely) == 1:
            alike[likely.pop()].append(groups[key])
    return alike


def _own_key(piece: Piece) -> str:
    """Return the key of the sample that a piece's own name says, without its folders."""
    part = piece.part
    said = read_name(PurePath(piece.file.name if part is None else f"{part.rows_of or part.sheet}.csv"))
    return sample_key(said.sample) if said else ""


@dataclass(frozen=True)
class PairingRow:
    """Row of the pairing file as the user wrote it."""

    where: str  # The file and the line
    file: str
    role: str
    sample: str
    part: str = ""
    answers: Mapping[str, str] = field(default_factory=dict)


def pairing_text(
    placed: Mapping[Piece, Said], samples: Sequence[SampleFiles], answers: Answers, about: Mapping[Piece, str]
) -> str:
    """Write a row for each piece, in the order of samples; a question stands beside the pieces that it is about.

    ``about`` are questions on what single pieces hold.
    """
    asked = {sample.key: " ".join(sample.questions) for sample in samples}
    questions = {(piece.file, piece.part_name): question for piece, question in about.items()}
    keyed = [
        (sample_key(said.sample), ROLES.index(said.role), piece.file, piece.part_name, said)
        for piece, said in placed.items()
    ]
    return sheet_text(
        COLUMNS,
        [
            (
                *(file.as_posix(), said.role, said.sample, part),
                *(answers.get((file.as_posix(), part), {}).get(name, "") for name in ANSWERS),
                "" if said.role == "ignore" else questions.get((file, part)) or asked.get(key, ""),
            )
            for key, _, file, part, said in sorted(keyed, key=lambda row: row[:4])
        ],
    )


def answers_of(rows: Sequence[PairingRow], decided_files: Mapping[str, PurePath]) -> Answers:
    """Return what the user answers on sheets. ``decided_files`` are the files by the cell that names each."""
    return {
        (decided_files[row.file].as_posix(), row.part): row.answers
        for row in rows
        if row.answers and row.file in decided_files
    }


def as_columns(answers: Mapping[str, str]) -> dict[str, Any]:
    """Return answers as a table of columns of a trial, ``as_written`` apart."""
    table: dict[str, Any] = {key: answers[key] for key in ("sheet", "unit", "sign", "range") if key in answers}
    if "s" in answers:
        table["s"] = _column(answers["s"])
    if "levels" in answers:
        levels = answers["levels"]
        table["levels"] = [*map(_column, re.split(r"[\s,;]+" if SPANS.fullmatch(levels) else r"\s*;\s*", levels))]
    if "missing" in answers:
        table["missing"] = re.split(r"\s*;\s*", answers["missing"])
    if "skip" in answers:
        parts = re.split(r"\s*[;,]\s*", answers["skip"])
        table["skip"] = [int(part) if part.isdecimal() else part for part in parts]
    return table


def _column(reference: str) -> str:
    """Return a letter as a span of letters, which no column has for a name."""
    return f"{reference}:{reference}" if re.fullmatch("[A-Z]{1,3}", reference) else reference


def decided(rows: Sequence[PairingRow], named: Mapping[Piece, Said]) -> Decisions:
    """Return the user's decisions: pieces whose rows differ from their names, and files taken as a whole.

    Raises InputError, naming all that is wrong: a row whose file or part is not there or stands there twice, a role or
    a sample that cannot be.
    """
    pieces: dict[PurePath, dict[str, Said]] = defaultdict(dict)
    for piece, said in named.items():
        pieces[piece.file][piece.part_name] = said
    by_cell = files_by_cell(pieces)
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
        elif (said := Said(as_label(row.sample), ROLES[ROLES.index(row.role)])) != pieces[file].get(part):
            decisions[file, part] = said
    if faults:
        raise InputError("\n".join(faults))
    return decisions


def files_by_cell(found: Iterable[PurePath]) -> dict[str, PurePath]:
    """Return files by the cells that may name them: as they are, and as a spreadsheet must not calculate them."""
    files = list(found)
    return {as_text_cell(file.as_posix()): file for file in files} | {file.as_posix(): file for file in files}


def read_pairing(path: Path) -> list[PairingRow]:
    """Read a pairing in whatever dialect a spreadsheet has saved it. Raises InputError where it is none."""
    table = read_table(path, f"'sealtwin ingest FOLDER --out LAB' writes LAB/{PAIRING}")
    rows = []
    for place, cells in named_cells(table, COLUMNS[:3], ["part", *ANSWERS]):
        answers = {key: text for key in ANSWERS if (text := cells.pop(key, ""))}
        rows.append(PairingRow(str(place), **cells, answers=answers))
    return rows


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
