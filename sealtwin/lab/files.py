"""Find the photos and sheets in a lab's folder, and their samples and roles, from their names or pairing.csv.

Links are not followed, and the files are not opened.
"""

import os
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Literal, get_args

from digitise.image.decoding import PHOTO_SUFFIXES
from sealtwin.core.errors import InputError, as_text
from sealtwin.core.files import as_text_cell, sheet_text
from validate.readings.grid import table_of
from validate.readings.words import WORDS, plain_letters, sample_key
from validate.settings import Columns, Declared

Role = Literal["photo", "mask", "readings", "scan", "fill", "ignore"]
"""Role of a file. A "scan" replaces the sheet of readings. A "fill" is the CSV of a liquid that was weighed into the
crack."""

ROLES: tuple[Role, ...] = get_args(Role)
NAMED_FILES: Mapping[Role, str] = {
    "photo": "photo.file",
    "mask": "photo.mask",
    "readings": "readings.file",
    "scan": "readings.scan",
    "fill": "crack.fill.file",
}
"""Setting of a trial that names the file, for each role."""
PAIRING = "pairing.csv"
SETTING = {
    **{name: f"readings.columns.{name}" for name in Columns.model_fields},
    **{name: f"readings.{name}" for name in Declared.model_fields if name not in ("columns", "quantity", "sample")},
    "sign": "readings.quantity",
    "crack": "photo.crack",
}
"""Setting of a trial that each column of the pairing file sets."""
NAMES = ("file", "role", "sample")
COLUMNS = (*NAMES, *SETTING, "question")
"""Columns of the pairing file. It is written with those that are needed.

A user may add any of them, and a column with the dotted name of any setting of a trial, such as crack.depth_mm."""
PART = ("sheet", "range", "s", "levels")  # Columns that say which part of a file a row describes
TRIAL = "trial.toml"  # Name of a trial file
TEXT_SUFFIXES = {".txt", ".md"}
TABLE_SUFFIXES = {
    ".csv", ".tsv", ".xlsx", ".xlsm", ".ods", ".lvm", ".dat", ".asc", ".prn", ".tab",
    ".xls", ".xlsb", ".numbers", ".sxc", ".gsheet",  # Cannot be read, but may contain a lab's numbers
}  # fmt: skip
SCAN_SUFFIXES = {".ply", ".stl", ".obj", ".glb", ".xyz", ".pts"}
POSSIBLE: Mapping[str, tuple[Role, ...]] = {
    **dict.fromkeys(PHOTO_SUFFIXES, ("photo", "mask", "scan")),
    **dict.fromkeys(SCAN_SUFFIXES, ("scan",)),
    **dict.fromkeys(TABLE_SUFFIXES, ("readings", "fill")),
    **dict.fromkeys(TEXT_SUFFIXES, ("readings", "fill")),
}
"""Roles that a file may have, by file suffix. The first role is the default."""
TABLES: tuple[Role, ...] = ("readings", "fill")  # Roles of files with tables of numbers
WORD = re.compile(r"[^\s._-]+")  # Pattern of a word in a file name
CAMERA = re.compile(r"(?i)^(?:(?:img|dsc[nf]?|pxl|20\d{6}|\d{6})[\s._-]+)+(?=.*[^\W\d])")
"""Words, dates and times that cameras write in front of a name."""
OUTSIDE_LABELS = re.compile(r"[^\w .,'+()#!~-]")
DEFAULTS = "lab.toml"  # Name of the file at the top of a lab's folder with settings of all samples
MAX_ENTRIES = 50_000  # Largest number of files and folders. With more, the user probably gave a disk by mistake
HIDDEN = (".", "~$")
NOT_READ = (
    "this file is not read. Settings of one sample are columns of pairing.csv, such as crack.depth_mm. The name of a "
    'text with readings needs a word such as "readings".'
)
UNSHOWN = "the name has characters that cannot be displayed. Rename the file."
CONTROLS = {"Cc", "Cf", "Zl", "Zp"}  # Unicode categories of control characters


@dataclass(frozen=True)
class FilePlace:
    """Sample and role of a file, or of part of a file, read from the file's name or from a row of the pairing file."""

    sample: str
    role: Role
    answers: Mapping[str, str] = field(default_factory=dict)  # Cells in the answer columns of the pairing file

    @property
    def key(self) -> str:
        return sample_key(self.sample)


Placed = dict[PurePath, list[FilePlace]]
"""Samples and roles of each file. A file of several samples has one entry for each sample.

The answers of an entry say which part of the file is read."""


@dataclass(frozen=True)
class KeptFile:
    """A file in the lab's folder, and its copy in a trial's folder."""

    role: Role
    original: str  # Path in the lab's folder
    kept_as: str  # Path of the identical copy in the trial's folder
    sha256: str
    size_bytes: int


@dataclass(frozen=True, order=True)
class CatalogueFault:
    name: str  # Name of the sample, or of a file that belongs to no sample
    sentence: str
    is_fault: bool = True  # True if a file cannot be used, False for a question to the user


def place_of(file: PurePath) -> FilePlace | None:
    """Return the sample and the role of a file from its path relative to the lab's folder, or None if it is not read.

    The sample's name is the stem of the file name, without words for a role at its ends. If there are no other words,
    it is the whole file name. Names of folders are treated alike: photos/P01.jpg and sheets/P01.csv belong to one
    sample, but May/P01.jpg and June/P01.jpg belong to two. A text file is read only if its name states a role.
    """
    possible, names = POSSIBLE.get(file.suffix.lower()), dict[str, str]()
    if not possible:
        return None
    roles: list[Role] = []
    stem = "" if file.name == TRIAL else file.stem
    for part in (*file.parent.parts, stem):
        name, meant = _without_words(part, possible if part == stem else ROLES)
        # A sample's folder and the files in it often have the same name.
        names |= {sample_key(name): name} if name else {}
        roles = [*meant, *(roles if file.suffix.lower() not in TEXT_SUFFIXES else ())]
    # Roles other than the default of the suffix have priority: a mask in a folder of photos is a mask.
    named = [role for role in roles if role in possible]
    if not named and file.suffix.lower() in TEXT_SUFFIXES:
        return None
    roles = [role for role in named if role in possible[1:]] or [*possible]
    return FilePlace(as_label("-".join(names.values()) or file.name), roles[0])


def _without_words(name: str, roles: Sequence[Role]) -> tuple[str, list[Role]]:
    """Return a name without the words at its ends that mean one of ``roles``, and the roles of these words."""
    name = CAMERA.sub("", name)
    words = [*WORD.finditer(name)]
    meant = list[Role]()
    for end in (-1, 0):
        while words and (role := _role_of(words[end][0], roles)):
            meant.append(role)
            del words[end]
    return (name[words[0].start() : words[-1].end()] if words else ""), meant


def _role_of(word: str, roles: Sequence[Role]) -> Role | None:
    letters = plain_letters(word)
    return next((role for role in roles if letters in WORDS["files"].get(role, "").split()), None)


def as_label(text: str) -> str:
    """Return a text as a sample's name that reports and spreadsheets can show.

    Other characters are replaced by their Unicode number, so that different names remain different.
    """
    return OUTSIDE_LABELS.sub(lambda mark: f"u{ord(mark[0]):04x}", text.strip())


def find_files(folder: Path) -> tuple[dict[PurePath, FilePlace], list[CatalogueFault], list[CatalogueFault]]:
    """Find the photos and sheets in ``folder`` and its subfolders.

    Returns the entry of each file by path relative to ``folder``, then the files that are not used, then the lost files
    and folders. Lost files and folders may contain data of the lab, but cannot be read. Hidden files are skipped, such
    as ._photo.jpg (macOS) and ~$sheet.xlsx (Excel). Raises InputError if ``folder`` is not a folder, or contains more
    than ``MAX_ENTRIES`` files and folders.
    """
    if not folder.is_dir():
        raise InputError(f"{as_text(folder)}: no such folder. Give the folder of photos and sheets.")
    files, unused, lost, entries = dict[PurePath, FilePlace](), list[CatalogueFault](), list[CatalogueFault](), 0

    def shut(fault: OSError) -> None:
        reason = f"this folder cannot be read ({fault.strerror}). Make it readable, or move it elsewhere."
        lost.append(CatalogueFault(plain(as_text(Path(fault.filename).relative_to(folder))), reason))

    for parent, folders, names in os.walk(folder, onerror=shut):
        entries += len(folders) + len(names)
        if entries > MAX_ENTRIES:
            raise InputError(f"{folder}: has more than {MAX_ENTRIES:,} files. Give parts of it one by one.")
        folders[:] = [name for name in folders if not name.startswith(HIDDEN)]
        names += [name for name in folders if Path(parent, name).is_symlink()]
        for file in (Path(parent, name).relative_to(folder) for name in names if not name.startswith(HIDDEN)):
            entry, shown = place_of(file), plain(as_text(file))
            if str(file) == DEFAULTS:
                continue
            if entry is None:
                unused.append(CatalogueFault(shown, NOT_READ))
            elif shown != str(file):
                lost.append(CatalogueFault(shown, UNSHOWN))
            else:
                files[file] = entry
    return files, sorted(unused), sorted(lost)


def plain(text: str) -> str:
    """Return ``text`` on one line, with "?" for control characters, which may move the cursor or reverse the text."""
    return "".join("?" if unicodedata.category(letter) in CONTROLS else letter for letter in text)


def rows_of(placed: Placed) -> list[tuple[PurePath, FilePlace]]:
    """Return the rows of the pairing file, sorted by sample, role and file."""
    rows = [(file, entry) for file, places in placed.items() for entry in places]
    return sorted(rows, key=lambda row: (row[1].key, ROLES.index(row[1].role), row[0]))


def pairing_text(placed: Placed, questions: Mapping[tuple[PurePath, str], Sequence[str]], asked: set[str]) -> str:
    """Return the text of the pairing file, with a row for each file and sample, sorted by sample.

    ``questions`` contains the questions by file and sample key. ``asked`` names the columns for the answers.
    """
    rows = [
        {
            "file": file.as_posix(),
            "role": entry.role,
            "sample": entry.sample,
            "question": " ".join(questions.get((file, entry.key), ())),
            **entry.answers,
        }
        for file, entry in rows_of(placed)
    ]
    used = asked.union(NAMES, ["question"], *rows)
    columns = [name for name in COLUMNS if name in used]
    columns[-1:-1] = sorted(used - {*COLUMNS})
    return sheet_text(columns, [[row.get(name, "") for name in columns] for row in rows])


def read_decisions(path: Path, named: Mapping[PurePath, FilePlace], is_setting: Callable[[str], bool]) -> Placed:
    """Return the user's decisions: the rows of a pairing file that differ from the pairing by names.

    Any spreadsheet program may have saved the file. ``is_setting`` tells whether a column is the dotted name of a
    setting. Raises InputError with all faults: an unknown column, a file that does not exist or is not read,
    several rows for the same part of a file, or a role that the file cannot have.
    """
    faults = list[str]()
    by_name = {file.as_posix(): file for file in named}
    decisions: Placed = {}
    for line, texts in table_of(path)[1]:
        # Remove the apostrophe that stops a spreadsheet from running a cell as a formula.
        bare = ((name, text[as_text_cell(text[1:]) == text :]) for name, text in texts)
        where, cells = f"{path}, line {line}", {name: text for name, text in bare if text}
        faults += [
            f"{where}: {cells[name]!r:.80} is in the column {name!r:.80}; allowed columns are {', '.join(COLUMNS)}, "
            "and names of settings such as crack.depth_mm."
            for name in cells.keys() - {*COLUMNS}
            if not is_setting(name)
        ]
        written, role = cells.get("file", ""), cells.get("role", "")
        if (file := by_name.get(written)) is None:
            faults.append(f"{where}: {written!r:.80} is not a file that is read. Correct or delete the row.")
        elif role not in (possible := (*POSSIBLE[file.suffix.lower()], "ignore")):
            faults.append(f"{where}: {file} cannot have the role {role!r:.40}; write one of {', '.join(possible)}.")
        else:
            answers = {name: text for name, text in cells.items() if name not in (*NAMES, "question")}
            sample = as_label(cells.get("sample", named[file].sample))
            decisions.setdefault(file, []).append(FilePlace(sample, ROLES[ROLES.index(role)], answers))
    for file, places in decisions.items():
        parts = {"".join(entry.answers.get(name, "") for name in PART).upper() for entry in places} - {""}
        if len(parts) < len(places) != 1:
            faults.append(f"{path}: {file} has several rows. Keep one, or give each another range, sheet or levels.")
    if faults:
        raise InputError("\n".join(faults))
    return {file: places for file, places in decisions.items() if places != [named[file]]}
