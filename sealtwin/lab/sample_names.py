"""Sample and role of a lab's file by its name."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import PurePath
from typing import Literal

from sealtwin.photos.batch import PHOTO_SUFFIXES
from validate.readings.samples import sample_key
from validate.readings.text_table import plain_letters
from validate.readings.words import WORDS as LAB_WORDS

Role = Literal["photo", "second_photo", "mask", "readings", "note", "ignore"]

NOTE_SUFFIX = ".toml"
STARTED = "trial.toml"  # Name of the trial file that 'sealtwin init' writes, in a folder of one sample
TABLE_SUFFIXES = {".csv", ".tsv", ".txt", ".xlsx"}
UNREAD_TABLES = {".xls", ".xlsm", ".xlsb", ".ods", ".numbers", ".sxc"}
"""A lab's own numbers in formats that are not read: to be named, not passed over."""
WORDS: dict[Role, frozenset[str]] = {role: frozenset(words.split()) for role, words in LAB_WORDS["files"].items()}
"""Words at the beginning or the end of a name, for each role."""
CAMERA = re.compile(r"(img|imag|dsc[nf]?|pxl|mvimg|cimg|gopr)[ _-]?\d{3,}([ _-]\d+)*|p\d{7}", re.IGNORECASE)
"""A name that a camera gave says nothing of a sample."""
WORD = re.compile(r"[^\W_]+")
OUTSIDE_LABELS = re.compile(r"[^\w .-]+")


@dataclass(frozen=True)
class Said:
    """Sample and role in a file's name."""

    sample: str  # Letters, digits, spaces and -_. only; empty where the name says none.
    role: Role


def read_names(files: Iterable[PurePath], folder: str) -> dict[PurePath, Said]:
    """Read the names of a lab's photos, sheets and notes, which are relative to the lab's folder.

    Where no part of a name says a sample, the file is of the one that ``folder``, the lab's folder itself, is named by.
    A camera's name is that of a sample only where a sheet or a note bears it too, as those of 'sealtwin trace' do.
    """
    files = list(files)
    by_camera = {
        file.parent for file in files if file.suffix.lower() not in PHOTO_SUFFIXES and CAMERA.fullmatch(file.stem)
    }
    named = {file: read_name(file, camera_counts=file.parent in by_camera) for file in files}
    return {
        file: said if said.sample else Said(as_label(folder), said.role)
        for file, said in named.items()
        if said is not None
    }


def read_name(file: PurePath, *, camera_counts: bool = False) -> Said | None:
    """Read one name by itself. Return None for a file that is neither photo, sheet nor note by its suffix.

    A folder is part of a sample's name too, unless its own name only says what lies in it: photos/P01.jpg and
    sheets/P01.csv are of one sample, May/P01.jpg and June/P01.jpg are not.
    """
    possible = possible_roles(file.suffix.lower())
    if not possible:
        return None
    rest, said = ("", list[Role]()) if file.name == STARTED else _without(file.stem, possible)
    folders = [_without(part, tuple(WORDS)) for part in file.parent.parts]
    named = [folder for folder, _ in folders if folder]
    if camera_counts or not (named and CAMERA.fullmatch(rest)):
        named.append(rest)
    # A folder of one sample often holds files of its name.
    parts = [part for before, part in pairwise(["", *named]) if sample_key(part) not in ("", sample_key(before))]
    by_folder: list[Role] = [role for _, roles in folders for role in roles]
    # A mask in a folder of photos is a mask: what a name adds to its suffix counts.
    told: list[Role] = [role for role in (*said, *by_folder[::-1]) if role in possible[1:]]
    return Said("-".join(parts), told[0] if told else possible[0])


def as_label(text: str) -> str:
    """Return a sample's name that is valid in a file's name, a report and a spreadsheet."""
    return OUTSIDE_LABELS.sub("-", text.strip())


def possible_roles(suffix: str) -> tuple[Role, ...]:
    """Return the roles that a file of that suffix can have, the default first."""
    if suffix in PHOTO_SUFFIXES:
        return ("photo", "second_photo", "mask")
    if suffix in TABLE_SUFFIXES | UNREAD_TABLES:
        return ("readings", "note")
    return ("note",) if suffix == NOTE_SUFFIX else ()


def _without(name: str, roles: tuple[Role, ...]) -> tuple[str, list[Role]]:
    """``name`` less the words at its ends that name one of ``roles``, and the roles that they named."""
    name = unicodedata.normalize("NFC", name)
    words = list(WORD.finditer(name))
    found: list[Role] = []
    for place in (-1, 0):
        while words and (named := _named(words[place].group(), roles)):
            found.append(named[0])
            del words[place]
    return as_label(name[words[0].start() : words[-1].end()] if words else ""), found


def _named(word: str, roles: tuple[Role, ...]) -> list[Role]:
    return [role for role in roles if plain_letters(word) in WORDS[role]]
