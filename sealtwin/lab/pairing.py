"""Pair files with samples by their names and by the user's corrections. Doubtful cases become questions."""

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path, PurePath
from typing import get_args

from sealtwin.core.errors import InputError
from sealtwin.core.files import as_text_cell, sheet_text
from sealtwin.lab.file_owners import Decisions
from sealtwin.lab.file_parts import Piece, texts_of, without_name
from sealtwin.lab.found_files import DIGIT, TABLES, UNREAD_TABLES, WORD, FilePlace, Role, as_label, few, possible_roles
from sealtwin.lab.pairing_columns import ANSWERS, COLUMNS, OPTIONAL, columns_asked, possible_answers
from validate.readings.header_words import sample_key
from validate.readings.samples import RANGE_PART, SamplePart, named_cells, read_table
from validate.readings.sheet import SheetGrid, quoted

PAIRING = "pairing.csv"
MOST_PHOTOS = 12  # Photos in one question
OF_SEVERAL = (
    "add a row of this file for each, with its range, its columns in s and levels, such as A and B:D, its sheet, or "
    "with 'rows of NAME' in the column part if a column names samples"
)
CODE = re.compile(r"[^\W\d_]{1,2}[0-9]{1,4}[^\W\d_]?")  # Key of a sample's name
LOOKALIKES = str.maketrans("oil", "011")
LIKENESS = 0.4  # Similarity of names from which a photo is suggested for a sample without one
UNKNOWN: tuple[Role, ...] = ("text", "readings")  # Roles of a text with another ending
ROLES: tuple[Role, ...] = get_args(Role)


@dataclass(frozen=True)
class SampleFiles:
    """Files of one sample, and questions about them."""

    name: str
    files: Mapping[Role, PurePath]  # One for each role; includes a photo if ``questions`` is empty
    questions: tuple[str, ...]
    part: SamplePart | None = None  # Part of the file of readings, if samples share it
    texts: Mapping[PurePath, Mapping[str, str]] = field(default_factory=dict)
    """Other texts about it, each with its answers from the pairing file."""
    answers: Mapping[Role, Mapping[str, str]] = field(default_factory=dict)  # From the pairing file, by role
    awaits: tuple[str, ...] = ()  # Questions about files that may be its own; the sample is not sound before an answer
    sheets: Mapping[Piece, Mapping[str, str]] = field(default_factory=dict)
    """Readings that may be its own, with the answers about them, if ``questions`` keep the sample from being read."""

    @property
    def key(self) -> str:
        return sample_key(self.name)


def pair(placed: Mapping[Piece, FilePlace]) -> list[SampleFiles]:
    """Return the samples with their files, sorted by name. Ignored files and texts without a sample are omitted."""
    groups: dict[str, dict[Piece, FilePlace]] = defaultdict(dict)
    texts: dict[str, dict[PurePath, Mapping[str, str]]] = defaultdict(dict)
    for piece, place in placed.items():
        if place.role == "text":
            texts[sample_key(place.sample)][piece.file] = place.answers
        elif place.role != "ignore":
            groups[sample_key(place.owner)][piece] = place
    samples = [_sample(key, group, groups) for key, group in sorted(groups.items())]
    samples = [replace(sample, texts=texts.get(sample.key, {})) for sample in samples]
    for key, group in groups.items():
        has_owner = bool(key) and any(place.role == "photo" for place in group.values())
        for piece, place in group.items():
            if place.likely or (place.role in TABLES and not has_owner):
                # The same words as the question of the group, so that they are shown once.
                pieces = [piece] if has_owner or not key else [*group]
                samples = awaiting(samples, place, _unpaired(pieces, group[pieces[0]], groups))
    return samples


def naming_others(folder: Path, samples: Sequence[SampleFiles]) -> list[SampleFiles]:
    """Return the samples, with a question about each whole file of readings in which another sample's name is.

    The samples that are named wait for the answer too, unless they have other readings.
    """
    photographed = [one for one in samples if one.key and "photo" in one.files]
    asked = defaultdict[str, list[str]](list)
    last = {one.key: sample_key(WORD.findall(one.name)[-1]) for one in photographed}
    for sample in photographed:
        file, given = sample.files.get("readings"), sample.answers.get("readings", {})
        is_answered = given.keys() & {"range", "levels"} or "readings.sample" in given.get("settings", "")
        if file is None or sample.part is not None or is_answered or (folder / file).is_symlink():
            continue
        named = dict[str, str]()
        for text in texts_of(folder / file, given.get("sheet")):
            rest, plain = without_name(text, sample.name), sample_key(text).replace("-", "")
            # Few names end in a word of the text: looking for all of each would take a minute in large labs.
            likely = (one for one in photographed if last[one.key] in plain and one is not sample)
            others = (one.key for one in likely if without_name(rest, one.name) != rest)
            named |= {key: named.get(key, text) for key in others}
        if named:
            question = (
                f"{file}: {quoted(next(iter(named.values())))} names another sample. If all of it is of {sample.name}, "
                f"write its rows into the column range, such as 1:20; if it is of several, {OF_SEVERAL}."
            )
            waiting = [one.key for one in photographed if one.key in named and "readings" not in one.files]
            for key in (sample.key, *waiting):
                asked[key].append(question)
    return [replace(one, awaits=(*one.awaits, *asked[one.key])) for one in samples]


def awaiting(samples: Sequence[SampleFiles], place: FilePlace, question: str) -> list[SampleFiles]:
    """Return the samples, with a question about a file in those that it may belong to.

    These are samples with a photo and without a file of this role, except for the one as whose the file is read: that
    of its name or the likely ones; else those with a number in common, if its name is the code of a sample, such as
    Z99, or has the words of a photo's name; else all.
    """
    photos = {one.key: one for one in samples if "photo" in one.files}
    names = [sample_key(name) for name in (place.sample, *place.likely) if sample_key(name) in photos]
    rest_of = {sample_key(place.read_as), *map(sample_key, place.rest_of)}
    words = {_words(one.name) for one in photos.values()}
    if names:
        owners = set(names)
    elif place.sample and (CODE.fullmatch(sample_key(place.sample)) or _words(place.sample) in words):
        owners = {key for key in photos if _numbers(key) & _numbers(sample_key(place.sample))}
    else:
        owners = set(photos)
    return [
        replace(one, awaits=(*one.awaits, question))
        if one.key in owners and (place.role not in one.files or one.key in rest_of)
        else one
        for one in samples
    ]


def _words(name: str) -> str:
    return " ".join(WORD.findall(DIGIT.sub(" ", name.casefold())))


def _numbers(key: str) -> set[int]:
    """Return the numbers in the key of a name. An O, I or l beside a digit may be one."""
    return {int(digits.translate(LOOKALIKES)) for digits in re.findall("[oil0-9]*[0-9][oil0-9]*", key)}


def _sample(key: str, group: Mapping[Piece, FilePlace], groups: Mapping[str, Mapping[Piece, FilePlace]]) -> SampleFiles:
    """Return the sample with the files ``group``, and questions about them. ``groups`` has the files of all samples."""
    by_role: dict[Role, list[Piece]] = defaultdict(list)
    for piece, place in group.items():
        by_role[place.role].append(piece)
    for role, pieces in by_role.items():
        # A copy in a format that is read replaces it: P01.csv for P01.xls.
        by_role[role] = [piece for piece in pieces if piece.file.suffix.lower() not in UNREAD_TABLES] or pieces
    name = group[by_role["photo"][0] if "photo" in by_role else next(iter(group))].owner
    files: dict[Role, PurePath] = {role: pieces[0].file for role, pieces in by_role.items() if len(pieces) == 1}
    questions = [
        f"{len(pieces)} files are its {role.replace('_', ' ')}: {few(pieces)}{_twins(pieces)}; keep one, and set the "
        "role of the others to ignore."
        for role, pieces in by_role.items()
        if len(pieces) > 1
    ]
    if not key:
        questions = [_unpaired([piece], place, groups) for piece, place in group.items()]
    elif "photo" not in by_role:
        questions.append(_unpaired(list(group), next(iter(group.values())), groups))
    part = by_role["readings"][0].part if "readings" in files else None
    answers: dict[Role, Mapping[str, str]] = {role: group[by_role[role][0]].answers for role in files}
    sheets = {piece: group[piece].answers for piece in by_role["readings"] if questions}
    return SampleFiles(name, files, tuple(questions), part, answers=answers, sheets=sheets)


def _unpaired(pieces: Sequence[Piece], place: FilePlace, groups: Mapping[str, Mapping[Piece, FilePlace]]) -> str:
    """Return the question of which sample the files are that have no photo. ``place`` is that of the first one.

    It names the photos that the name of the file fits, otherwise all photos that have no file of this role.
    """
    lacking, key = _lacking(place.role, groups), sample_key(place.sample)
    likely = [sample_key(name) for name in place.likely] or get_close_matches(key, lacking, cutoff=LIKENESS)
    photos = {piece: groups[one][piece].sample for one in likely or lacking for piece in _photos(groups[one])}
    names = few([*photos], MOST_PHOTOS)
    samples = dict.fromkeys(photos.values())
    which = next(iter(samples)) if len(samples) == 1 else "its sample"
    if likely:
        likely_owner = f"Is it of {names}? If so, write {which} into the column sample"
    elif lacking:
        likely_owner = f"Photos without {place.role}: {names}. If it is of one, write its sample into the column sample"
        if place.role == "readings":
            likely_owner += f"; if it is of several, {OF_SEVERAL}"
    else:
        photo = f"as {place.sample}.jpg" if key else f"and write its sample into the column sample of {PAIRING}"
        likely_owner = f"Every photo has its {place.role}. If its photo is missing, add it to the folder {photo}"
    if key:
        return f"{few(pieces)}: no photo of sample {place.sample}. {likely_owner}; if not, set role to ignore."
    fault = "its name gives no sample"
    if place.rest_of:
        fault = f"outside of the range of {few(place.rest_of)}; if it is of the same sample, extend that range"
    return f"{few(pieces)}: {fault}. {likely_owner}; if not, set role to ignore."


def _lacking(role: Role, groups: Mapping[str, Mapping[Piece, FilePlace]]) -> list[str]:
    """Return the keys of the samples with a photo and without a file of this role."""
    of_roles = {one: {other.role for other in group.values()} for one, group in groups.items()}
    return [one for one, roles in of_roles.items() if one and "photo" in roles and role not in roles]


def _photos(group: Mapping[Piece, FilePlace]) -> list[Piece]:
    return [piece for piece, place in group.items() if place.role == "photo"]


def _twins(pieces: Sequence[Piece]) -> str:
    """Return a remark if names look equal but differ in their bytes; otherwise ""."""
    names = list(dict.fromkeys(str(piece.file) for piece in pieces))
    if len({unicodedata.normalize("NFC", name) for name in names}) == len(names):
        return ""
    apart = next(name for name in names if unicodedata.normalize("NFC", name) != name)
    number = names.index(apart) + 1
    return f" (these names look equal: file {number} has its accents as separate characters, as macOS writes them)"


@dataclass(frozen=True)
class PairingRow:
    """A row of the pairing file, as the user wrote it."""

    where: str  # The file and the line
    file: str
    role: str
    sample: str
    part: str = ""
    answers: Mapping[str, str] = field(default_factory=dict)


def pairing_text(placed: Mapping[Piece, FilePlace], samples: Sequence[SampleFiles], about: Mapping[Piece, str]) -> str:
    """Return the text of the pairing file: a row for each piece, sorted by sample, with the question about it.

    ``about`` has questions about the content of single pieces. Of the columns for replies the file has those that a
    question asks for and those that have content.
    """
    by_key = {sample.key: sample for sample in samples}
    used = {"part"} if any(piece.part_name for piece in placed) else set[str]()
    rows = list[tuple[tuple[str, int, PurePath, str], dict[str, str]]]()
    for piece, place in placed.items():
        key, file, asked = sample_key(place.owner), piece.file, about.get(piece, "")
        row = {"file": file.as_posix(), "role": place.role, "sample": place.sample, "part": piece.part_name}
        row |= {name: text for name, text in place.answers.items() if text}
        if place.role != "ignore":
            sample = by_key.get(key, SampleFiles("", {}, ()))
            of_piece = [one for one in (*sample.questions, *sample.awaits) if one.startswith(f"{piece}:")]
            of_piece = of_piece or sample.questions
            asks_owner = not asked or piece in sample.sheets
            row["question"] = " ".join([*(of_piece if asks_owner else ()), *([asked] if asked else ())])
            used.update(columns_asked(asked, possible_answers(place.role), PAIRING))
        used.update(row.keys() & ANSWERS)
        rows.append(((key, ROLES.index(place.role), file, piece.part_name), row))
    columns = [name for name in COLUMNS if name in used or name not in OPTIONAL]
    order = [row for _, row in sorted(rows, key=lambda row: row[0])]
    return sheet_text(columns, [[row.get(name, "") for name in columns] for row in order])


def decided(
    rows: Sequence[PairingRow], named: Mapping[Piece, FilePlace], left_out: Mapping[str, str] | None = None
) -> Decisions:
    """Return the user's decisions: the rows that differ from what the names of the files give.

    ``left_out`` has the reasons why other files of the folder are not used.
    Raises InputError with every fault: a file or a part that does not exist or has two rows, or an invalid role or
    sample.
    """
    pieces = {piece.file: place for piece, place in named.items()}
    # By the name itself, and by the name with the mark that stops a spreadsheet from calculating it.
    by_cell = {as_text_cell(file.as_posix()): file for file in pieces} | {file.as_posix(): file for file in pieces}
    decisions: dict[tuple[PurePath, str], FilePlace] = {}
    rowed: set[tuple[PurePath, str]] = set()
    several = {file for file, count in Counter(row.file for row in rows).items() if count > 1}
    rows = [_of_own_part(row) if row.file in several else row for row in rows]
    parted = {row.file for row in rows if row.part}
    faults = []
    for row in rows:
        file = by_cell.get(row.file)
        if file is None:
            unused = (left_out or {}).get(row.file)
            fault = f"{row.file!r:.80} is not used: {unused} Save it in one of these forms" if unused else ""
            fault = fault or f"no file {row.file!r:.80} in the lab's folder; delete the row, or correct it"
            faults.append(f"{row.where}: {fault}.")
            continue
        part, fault = row.part, _fault(file, row.part, row)
        if (file, part) in rowed:
            fault = f"{file} has two rows; keep one, or give each its own range, levels or sheet."
        elif not part and row.file in parted:
            fault = f"{file} has rows for its parts too; delete this row, or write its part into range or levels."
        rowed.add((file, part))
        if fault is not None:
            faults.append(f"{row.where}: {fault}")
            continue
        place = FilePlace(as_label(row.sample), ROLES[ROLES.index(row.role)], answers=row.answers)
        if part or place != pieces[file]:
            decisions[file, part] = place
    if faults:
        raise InputError("\n".join(faults))
    return decisions


def _of_own_part(row: PairingRow) -> PairingRow:
    """Return one of several rows of a file as the part that its range, columns of readings or worksheet give."""
    names = {"range": "{}", "levels": "columns {}", "sheet": "sheet {}"}
    key = next((key for key in names if key in row.answers), None)
    if row.part or key is None:
        return row
    sheet = f"sheet {row.answers['sheet']}, " if "sheet" in row.answers and key != "sheet" else ""
    name = names[key].format(row.answers[key].upper() if key == "range" else row.answers[key])
    answers = {other: text for other, text in row.answers.items() if other not in (key, "sheet")}
    return replace(row, part=f"{sheet}{name}", answers=answers)


def read_pairing(path: Path) -> list[PairingRow]:
    """Read a pairing file as any spreadsheet program saves it. Raises InputError if it is not a pairing file."""
    table = read_table(path, f"'sealtwin ingest FOLDER --out LAB' writes LAB/{PAIRING}")
    _refuse_other_columns(table)
    rows = []
    for place, cells in named_cells(table, COLUMNS[:3], OPTIONAL):
        answers = {key: text for key in ANSWERS if (text := cells.pop(key, ""))}
        rows.append(PairingRow(str(place), **cells, answers=answers))
    return rows


def _refuse_other_columns(table: SheetGrid) -> None:
    """Raise InputError for a column without a known name: an answer in it would not be read."""
    names = [cell.text for cell in table.rows[0].cells] if table.rows else []
    faults = list[str]()
    for name in (name for name in names if name and name not in COLUMNS):
        close = get_close_matches(name.lower(), COLUMNS, n=1)
        allowed = f"did you mean {close[0]!r}?" if close else f"delete it; allowed are {', '.join(COLUMNS)}."
        faults.append(f"{table.path}: no such column {name!r:.80}; {allowed}")
    for row in table.rows[1:]:
        for at, cell in enumerate(row.cells):
            if cell.text and not (at < len(names) and names[at]):
                faults.append(f"{table.place(row.number, at)}: {cell.text!r:.80} is in a column without a name.")
    if faults:
        raise InputError("\n".join(faults))


def _fault(file: PurePath, part: str, row: PairingRow) -> str | None:
    if part and not RANGE_PART.fullmatch(part):
        return f"{file}: a part {part!r:.80}; write a range, such as A1:D20, or rows of NAME."
    possible = (*(("readings",) if part else possible_roles(file.suffix.lower()) or UNKNOWN), "ignore")
    if row.role not in possible:
        return f"{file}{part and ', '}{part} cannot be {row.role!r:.40}; write one of {', '.join(possible)}."
    if row.role == "ignore":
        return None
    if not sample_key(row.sample):
        if part:
            return None  # The question about this row is still open.
        return f"{file} has no sample; write the sample's name, or the role ignore."
    if as_label(row.sample) != row.sample:
        return f"{file}: a sample {row.sample!r:.80}; names may have letters, digits, spaces and -_. only."
    return None
