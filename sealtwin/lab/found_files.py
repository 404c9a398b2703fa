"""Photos, sheets and notes in a lab's folder, with the sample and the role that their names give.

Links are not followed. Only texts and tables of readings are opened, since several samples may share them.
"""

import os
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path, PurePath
from typing import Literal

from digitise.image.decoding import PHOTO_SUFFIXES
from sealtwin.core.errors import InputError, as_text
from validate.readings.header_words import sample_key
from validate.readings.text_table import WORDS as LAB_WORDS
from validate.readings.text_table import plain_letters

Role = Literal["photo", "mask", "readings", "fill", "note", "text", "ignore"]
"""Role of a file. A "fill" is the sheet of a liquid weighed into the crack. A "text" is kept with its sample but gives
no settings."""

PICTURES: Mapping[Role, str] = {"photo": "photo.file", "mask": "photo.mask"}
NAMED_FILES: Mapping[Role, str] = {**PICTURES, "readings": "readings.file"}
"""Settings of a trial that name a file, by the file's role."""
NOTE_SUFFIX = ".toml"
TRIAL = "trial.toml"  # Name of a trial file; 'sealtwin init' writes one into a folder of one sample
UNREAD_TABLES = {".xls", ".xlsb", ".numbers", ".sxc", ".gsheet"}  # Reported as a fault: they contain a lab's numbers
TABLE_SUFFIXES = {".csv", ".tsv", ".xlsx", ".xlsm", ".ods"} | UNREAD_TABLES
FREE_TEXT = {".txt", ".md", ".lvm", ".dat", ".asc", ".prn", ".tab"}
"""Endings of texts, which may be tables: their content decides."""
TABLES: tuple[Role, ...] = ("readings", "fill")  # Roles of tables of numbers
WORDS: dict[Role, frozenset[str]] = {role: frozenset(words.split()) for role, words in LAB_WORDS["files"].items()}
"""Words, by role, that give a file this role if they are at the beginning or the end of a name."""
CAMERA = re.compile(
    r"(img|imag|dsc[nf]?|pxl|mvimg|cimg|gopr)[ _-]?\d{3,}([ _-]\d+)*([ _-]wa\d+)?|p\d{7}|\d{8}_\d{6}", re.IGNORECASE
)
"""Name that a camera gave to a file. It is not the name of a sample."""
BESIDE_CAMERA = re.compile(rf"(?:{CAMERA.pattern})[ _-]+(?=[^\W\d_])|(?<=\w)[ _-]+(?:{CAMERA.pattern})$", re.IGNORECASE)
"""A camera's name before or after another name, as in IMG_0412_P4."""
DIGIT = re.compile(r"\d")
REMARK = re.compile(r"\s*[(\[{][^)\]}]*[)\]}]")  # Remark in brackets: P-03 (von oben)
WORD = re.compile(r"[^\W_]+")
OUTSIDE_LABELS = re.compile(r"[^\w .-]+")
DEFAULTS = "lab.toml"  # Settings of all samples, on top of a lab's folder
MOST_ENTRIES = 50_000  # Files and folders; more means that a disk was given by mistake
MOST_NAMES = 3  # Names in one sentence
HIDDEN = (".", "~$")
SHEETS, PHOTOS = (
    " ".join(sorted(endings)) for endings in ((TABLE_SUFFIXES - UNREAD_TABLES) | FREE_TEXT, PHOTO_SUFFIXES)
)
NOT_READ = f"its ending is not read. Read are sheets and texts ({SHEETS}), photos ({PHOTOS}) and notes ({NOTE_SUFFIX})."
NOT_DOWNLOADED = re.compile(r"\.(.+)\.icloud")  # iCloud's placeholder of a file
CONTROLS = {"Cc", "Cf", "Zl", "Zp"}  # Unicode's categories of characters that control a text


@dataclass(frozen=True)
class FilePlace:
    """Sample and role of a file, given by its name or by the user, and the user's replies in the pairing file."""

    sample: str  # Letters, digits, spaces and -_. only; empty if the name gives none
    role: Role
    stated: bool = field(default=False, compare=False)  # True if a word of the file's own name gives the role
    answers: Mapping[str, str] = field(default_factory=dict)  # As written in the pairing file
    likely: tuple[str, ...] = field(default=(), compare=False)  # Samples that it may belong to; the user decides
    read_as: str = field(default="", compare=False)  # One of them, as whose the file is read meanwhile
    rest_of: tuple[str, ...] = field(
        default=(), compare=False
    )  # Samples whose ranges leave this part of their file out

    @property
    def owner(self) -> str:
        """Sample as whose the file is read."""
        return self.read_as or self.sample


def read_names(files: Iterable[PurePath], folder: str) -> dict[PurePath, FilePlace]:
    """Return the sample and role of each photo, sheet and note by its path, relative to the lab's folder.

    If the path gives no sample, the sample is ``folder``, the name of the lab's folder. A camera's name counts as the
    name of a sample only if a sheet or a note in the same folder has such a name too. 'sealtwin trace' writes such
    files.
    """
    files = list(files)
    by_camera = {
        file.parent for file in files if file.suffix.lower() not in PHOTO_SUFFIXES and CAMERA.fullmatch(file.stem)
    }
    named = {file: read_name(file, camera_counts=file.parent in by_camera) for file in files}
    return {
        file: place if place.sample else replace(place, sample=as_label(folder))
        for file, place in named.items()
        if place is not None
    }


def read_name(file: PurePath, *, camera_counts: bool = False) -> FilePlace | None:
    """Read one name. Returns None if its suffix is not that of a photo, a sheet or a note.

    A folder's name is part of the sample's name unless it is the word for a role: photos/P01.jpg and sheets/P01.csv
    belong to one sample, May/P01.jpg and June/P01.jpg do not.
    """
    possible = possible_roles(file.suffix.lower())
    if not possible:
        return None
    stem = REMARK.sub("", file.stem).strip() or file.stem
    stem = stem if CAMERA.fullmatch(stem) else BESIDE_CAMERA.sub("", stem)
    rest, own = ("", list[Role]()) if file.name == TRIAL else _without(stem, possible)
    folders = [_without(part, tuple(WORDS)) for part in file.parent.parts]
    named = [folder for folder, _ in folders if folder]
    if camera_counts or not (named and CAMERA.fullmatch(rest)):
        named.append(rest)
    # The folder of a sample often has files with the same name.
    parts = [part for before, part in pairwise(["", *named]) if sample_key(part) not in ("", sample_key(before))]
    by_folder: list[Role] = [role for _, roles in folders for role in roles]
    # A mask in a folder of photos is a mask: roles other than the default of the suffix count.
    roles: list[Role] = [role for role in (*own, *by_folder[::-1]) if role in possible[1:]]
    role = roles[0] if roles else possible[0]
    return FilePlace("-".join(parts), role, role in own and role != possible[0])


def as_label(text: str) -> str:
    """Return a text as a sample's name that is valid in file names, reports and spreadsheets."""
    return OUTSIDE_LABELS.sub("-", text.strip())


def possible_roles(suffix: str) -> tuple[Role, ...]:
    """Return the roles that a file with this suffix may have. The first is the default."""
    if suffix in PHOTO_SUFFIXES:
        return ("photo", "mask")
    if suffix in TABLE_SUFFIXES:
        return ("readings", "note", "fill")
    if suffix in FREE_TEXT:
        return ("text", "readings", "note", "fill")
    return ("note",) if suffix == NOTE_SUFFIX else ()


def _without(name: str, roles: tuple[Role, ...]) -> tuple[str, list[Role]]:
    """Return ``name`` without the words at its ends that mean one of ``roles``, and the roles that they mean."""
    name = unicodedata.normalize("NFC", name)
    words, named_roles = list(WORD.finditer(name)), list[Role]()

    def named(word: str) -> Role | None:
        return next((role for role in roles if plain_letters(word) in WORDS.get(role, ())), None)

    for place in (-1, 0):
        while words and (role := named(words[place].group())) is not None:
            named_roles.append(role)
            del words[place]
    return as_label(name[words[0].start() : words[-1].end()] if words else ""), named_roles


@dataclass(frozen=True)
class LeftOut:
    """A file or a folder that is not used, and the reason."""

    file: str
    reason: str
    lost: bool  # True if it may contain data of the lab
    may_be_readings: bool = False  # True if lines of it may be

    @property
    def sentence(self) -> str:
        return f"{self.file}: {self.reason}"


def find_files(folder: Path) -> tuple[list[PurePath], list[LeftOut]]:
    """Return the photos, sheets and notes in ``folder`` and its subfolders, and the files that are not used.

    Paths are relative to ``folder``. Raises InputError if it is not a folder, or if it contains more than
    ``MOST_ENTRIES`` files and folders.
    """
    if not folder.is_dir():
        raise InputError(f"{as_text(folder)}: no such folder; give the folder of photos, sheets and notes.")
    files, left_out = list[PurePath](), list[LeftOut]()
    for path in sorted(_paths(folder, left_out)):
        file = path.relative_to(folder)
        reason, lost = NOT_READ, read_name(file) is not None
        if as_text(file) != str(file):
            reason = "a name that is not UTF-8; rename it."
        elif plain(str(file)) != str(file):
            reason = "a name with control characters; rename it."
        elif file.name == DEFAULTS != str(file):
            reason = f"{DEFAULTS} is read from the top of the folder only; move it there."
        elif lost:
            files += [] if file == Path(DEFAULTS) else [file]
            continue
        left_out.append(LeftOut(plain(as_text(file)), reason, lost))
    return files, left_out


def plain(text: str) -> str:
    """Return ``text`` on one line, with "?" for characters that move a terminal's cursor or reverse the writing."""
    return "".join("?" if unicodedata.category(letter) in CONTROLS else letter for letter in text)


def few(names: Sequence[object], most: int = MOST_NAMES) -> str:
    """Return a text with the first ``most`` names and the number of the others."""
    more = len(names) - most
    return ", ".join(map(str, names[:most])) + (f" and {more} more" if more > 0 else "")


def _paths(folder: Path, left_out: list[LeftOut]) -> Iterator[Path]:
    """Yield all files that are not hidden. Hidden files are, for example, macOS's ._photo.jpg and Excel's ~$sheet.xlsx.

    Folders that cannot be read, and files that iCloud has not downloaded, are added to ``left_out``. Raises InputError
    if there are too many files.
    """

    def leave_out(fault: OSError) -> None:
        place = plain(as_text(Path(os.path.relpath(fault.filename, folder))))
        reason = f"this folder cannot be read ({fault.strerror}). Make it readable, or move it away."
        left_out.append(LeftOut(place, reason, lost=True))

    entries = 0
    for place, folders, names in os.walk(folder, onerror=leave_out):
        entries += len(folders) + len(names)
        if entries > MOST_ENTRIES:
            raise InputError(f"{folder}: more than {MOST_ENTRIES:,} files; give one part of it at a time.")
        folders[:] = [name for name in folders if not name.startswith(HIDDEN)]
        for name in names:
            inner = NOT_DOWNLOADED.fullmatch(name)
            if inner is not None and read_name(PurePath(inner[1])) is not None:
                file = plain(as_text(Path(os.path.relpath(Path(place, inner[1]), folder))))
                left_out.append(LeftOut(file, "not downloaded: iCloud has a placeholder here. Download it.", lost=True))
        links = [name for name in folders if Path(place, name).is_symlink()]
        yield from (Path(place, name) for name in (*names, *links) if not name.startswith(HIDDEN))
