"""Photos, sheets and notes in a lab's folder, with the sample and the role that their names give.

Links are not followed. Only texts and tables of readings are opened, since several samples may share them.
"""

import os
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise
from pathlib import Path, PurePath
from typing import Literal

from digitise.image.decoding import PHOTO_SUFFIXES
from sealtwin.core.errors import InputError, as_text
from sealtwin.lab.sheets import kind_of_text
from validate.readings.header_words import crack_depth, sample_key
from validate.readings.samples import SamplePart, part_of, parts_of, sheets_of
from validate.readings.table_rows import within
from validate.readings.text_table import WORDS as LAB_WORDS
from validate.readings.text_table import plain_letters

Role = Literal["photo", "second_photo", "mask", "readings", "fill", "note", "text", "ignore"]
"""Role of a file. A "fill" is the sheet of a liquid weighed into the crack. A "text" is kept with its sample but gives
no settings."""

PICTURES: Mapping[Role, str] = {"photo": "photo.file", "second_photo": "photo.second_photo", "mask": "photo.mask"}
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
SAMPLE_WORDS = LAB_WORDS["columns"]["sample"].split()
OF_SAMPLES = frozenset(SAMPLE_WORDS + LAB_WORDS["columns"]["counter"].split())
TITLE = re.compile(
    rf"(?:(?:{'|'.join(SAMPLE_WORDS)})\W+(?P<after>[\w.-]*\d[\w.-]*)|(?P<alone>(?=[\w-]*[^\W\d])[\w-]*\d[\w-]*))(?:\W.*)?",
    re.IGNORECASE,
)
"""Title of a table that may contain the name of a sample, such as S13 in "Probe S13, links". That sample may have no
photo."""
LEAST_BESIDE = 3  # Rows of numbers outside of all given ranges from which they may be another table
MOST_WORDS = 5  # Words of a sample's name in a title
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
        return ("photo", "second_photo", "mask")
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
class Piece:
    file: PurePath  # Relative to the lab's folder
    part: SamplePart | None = None  # None: all of it

    @property
    def part_name(self) -> str:
        """Name of the part in the pairing file; "" for the whole file."""
        return "" if self.part is None else str(self.part)

    def __str__(self) -> str:
        return f"{self.file}, {self.part}" if self.part else str(self.file)


def divide(
    folder: Path, named: Mapping[PurePath, FilePlace], photographed: Set[str], *, has_range: bool = False
) -> dict[Piece, FilePlace]:
    """Return the pieces of all files: the parts of a table with readings of several samples, otherwise the whole file.

    A column of sample names always divides a table. The name of a worksheet, or a title above one of several tables of
    a sheet, does so if it is in ``photographed``, the keys of samples with a photo; the other tables of this workbook
    then become questions. So do several tables of a sheet without any name, unless the folder's settings have a range
    (``has_range``) and the file has the name of a sample.
    """
    pieces: dict[Piece, FilePlace] = {}
    for file, place in named.items():
        if (folder / file).is_symlink():
            pieces[Piece(file)] = place
            continue
        is_text, is_table = file.suffix.lower() in FREE_TEXT, file.suffix.lower() in TABLE_SUFFIXES
        looked_at = is_text or (is_table and not (place.stated and place.role == "note"))
        kind = kind_of_text(folder / file) if looked_at else None
        # A file named note may contain sentences or a table of words and values; a fill is recognised by its columns.
        of_words = kind == "note" and place.role == "readings" and not place.stated
        if kind is not None and (
            kind == "fill" or of_words or (is_text and not (place.stated and place.role in TABLES))
        ):
            place = replace(place, role=kind)
        if place.role == "readings":
            pieces |= _divided(folder, file, place, photographed, has_range)
        else:
            pieces[Piece(file)] = place
    return pieces


def with_parts(
    folder: Path, pieces: Mapping[Piece, FilePlace], decisions: Mapping[tuple[PurePath, str], FilePlace]
) -> dict[Piece, FilePlace]:
    """Return ``pieces`` with the ranges of files that only the user named, in place of these files as a whole."""
    files, present = {piece.file for piece in pieces}, {(piece.file, piece.part_name) for piece in pieces}
    added = dict[Piece, FilePlace]()
    for (file, name), place in decisions.items():
        if file in files and (file, name) not in present and (part := part_of(folder / file, name)) is not None:
            added[Piece(file, part)] = place
    divided = {piece.file for piece in added}
    return {piece: place for piece, place in pieces.items() if piece.part or piece.file not in divided} | added


def beside_ranges(
    folder: Path, pieces: Mapping[Piece, FilePlace], decisions: Mapping[tuple[PurePath, str], FilePlace]
) -> dict[Piece, FilePlace]:
    """Return rows of numbers that are in none of the ranges which the user gave for a file, without a sample."""
    files, present = {piece.file for piece in pieces}, {(piece.file, piece.part_name) for piece in pieces}
    ranges = defaultdict[PurePath, list[SamplePart]](list)
    for (file, name), place in decisions.items():
        if file in files and (not name or (file, name) not in present):
            given = part_of(folder / file, name or place.answers.get("range", ""))
            ranges[file] += [] if given is None else [given]
    return {
        Piece(file, part): FilePlace("", "readings")
        for file, given in ranges.items()
        for part in _beside(folder / file, given)
        if (file, str(part)) not in decisions
    }


def _beside(path: Path, ranges: Sequence[SamplePart]) -> Iterator[SamplePart]:
    """Yield rows of numbers that are in none of the ranges which the user gave: they may be another sample's."""
    if not ranges or any(part.cells is None for part in ranges):
        return
    grids = sheets_of(path)
    for grid in (grid for grid in grids if len(grids) == 1 or grid.sheet in {part.sheet for part in ranges}):
        given = [part.cells for part in ranges if part.sheet in (None, grid.sheet)]
        covered = {row.number for cells in given for row in within(grid.rows, cells) if any(c.text for c in row.cells)}
        for is_covered, group in groupby(grid.rows, key=lambda row: row.number in covered):
            rows = list(group)
            of_numbers = [row.number for row in rows if sum(bool(DIGIT.search(cell.text)) for cell in row.cells) > 1]
            if not is_covered and len(of_numbers) >= LEAST_BESIDE:
                sheet = f"sheet {grid.sheet}, " if len(grids) > 1 else ""
                if (part := part_of(path, f"{sheet}{rows[0].number}:{of_numbers[-1]}")) is not None:
                    yield part


def _divided(
    folder: Path, file: PurePath, place: FilePlace, photographed: Set[str], has_range: bool
) -> dict[Piece, FilePlace]:
    samples = {part: _sample(file, part, photographed) for part in parts_of(folder / file)}
    # Columns, or rows, are parts only if they name several samples; their sheet as a whole then is none.
    levels = defaultdict[tuple[str | None, bool], set[str]](set)
    for part, sample in samples.items():
        # A row of places that names a sample is one of readings.
        if part.levels and not (part.beside and _samples_in(file, part.beside.corner, photographed)):
            levels[part.sheet, part.beside is not None].add(sample_key(sample))
    by_level = {sheet: way for (sheet, way), keys in levels.items() if len(keys) > 1 and keys & photographed}
    samples = {
        part: sample
        for part, sample in samples.items()
        if by_level.get(part.sheet) is (part.beside is not None if part.levels else None)
    }
    columns = [sample for part, sample in samples.items() if part.levels]
    # A worksheet or a table with the name of a sample is used although it has no readings: reading it reports why.
    samples = {
        part: sample
        for part, sample in samples.items()
        if part.headed or part.levels or sample_key(sample) in photographed
    }
    naming = [
        part for part, sample in samples.items() if part.rows_of is not None or sample_key(sample) in photographed
    ]
    keys, own = {sample_key(samples[part]) for part in naming}, sample_key(place.sample)
    is_divided = len(samples) > 1 and any(part.headed for part in naming)
    is_divided = is_divided or (bool(columns) and all(columns))
    tables = [part for part in samples if part.cells is not None and not any(map(crack_depth, part.title))]
    unnamed = not naming and len(tables) > 1 and not (has_range and own in photographed)
    if unnamed:
        samples = {part: sample for part, sample in samples.items() if part.cells is None or part in tables}
    if not unnamed and (not naming or (keys == {own} and not is_divided)):
        return {Piece(file): place}
    if own in photographed and own not in keys and all(samples.values()):
        # The file's name and its rows contradict each other: reading the file as that sample's reports it.
        by_column = next((part for part in naming if part.rows_of is not None), None)
        return {Piece(file, by_column and replace(by_column, rows_of=place.sample)): place}
    return {Piece(file, part): FilePlace(sample, "readings") for part, sample in _joined(samples).items()}


def _joined(samples: Mapping[SamplePart, str]) -> dict[SamplePart, str]:
    """Return the parts with their samples; columns of one sample become one part if their names differ."""
    joined: dict[object, tuple[SamplePart, str]] = {}
    alike = Counter((part.sheet, part.names, part.title) for part in samples if part.levels)
    for part, sample in samples.items():
        is_joined = part.levels is not None and alike[part.sheet, part.names, part.title] == 1
        key = (part.sheet, sample_key(sample)) if is_joined else part
        joined[key] = (joined[key][0].with_columns_of(part), sample) if key in joined else (part, sample)
    return dict(joined.values())


def _sample(file: PurePath, part: SamplePart, photographed: Set[str]) -> str:
    """Return the sample that a part of a file names; "" if it names none or several."""
    if (part.cells is None and part.levels is None) or part.rows_of is not None:
        return _sample_called(file, part.rows_of or part.sheet or "", photographed)
    named = [_samples_in(file, line, photographed) for line in (" ".join(part.title), *part.names)]
    # A column may be called P1 for its first repeat: a header names a sample only if all its columns do.
    samples = named[0] or (named[1] if len({tuple(one) for one in named[1:]}) == 1 else {})
    if samples:
        return next(iter(samples.values())) if len(samples) == 1 else ""
    titles = (match for line in part.title[::-1] if (match := TITLE.fullmatch(line.strip())))
    return _sample_called(file, next((title["after"] or title["alone"] for title in titles), ""), photographed)


def _samples_in(file: PurePath, text: str, photographed: Set[str]) -> dict[str, str]:
    """Return the samples with a photo that a line names, by their keys. A number alone must follow "sample"."""
    words, samples, end = list(WORD.finditer(text)), dict[str, str](), 0
    for start, first in enumerate(words):
        for last in words[start : start + MOST_WORDS][::-1]:
            name = text[first.start() : last.end()]
            sample = _sample_called(file, name, photographed)
            follows = start > 0 and plain_letters(words[start - 1].group()) in OF_SAMPLES
            is_name = follows or name == text.strip() or (DIGIT.search(name) and not name.isdecimal())
            if is_name and first.start() >= end and sample_key(sample) in photographed:
                samples[sample_key(sample)] = sample
                end = last.end()
                break
    return samples


def _sample_called(file: PurePath, name: str, photographed: Set[str]) -> str:
    """Return the sample with a name in a file.

    The name is read like that of a file in the same folder: P01 in May/all.csv means the sample May-P01. If May-P01 has
    no photo but P01 has one, it means P01.
    """
    path = PurePath(f"{as_label(name)}.csv")
    there, alone = (read_name(folder / path, camera_counts=True) for folder in (file.parent, PurePath()))
    place = alone if alone is not None and sample_key(alone.sample) in photographed else there
    place = there if there is not None and sample_key(there.sample) in photographed else place
    return place.sample if place is not None and name else ""


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
