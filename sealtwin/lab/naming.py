"""What the name of a lab's file says: which sample it belongs to, and what it shows of it."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import PurePath
from typing import Literal

from sealtwin.photos.batch import PHOTO_SUFFIXES
from validate.sheets.letters import plain_letters
from validate.sheets.samples import sample_key

Role = Literal["photo", "second_photo", "mask", "readings", "note", "ignore"]

NOTE_SUFFIX = ".toml"
STARTED = "trial.toml"
"""As 'sealtwin init' calls it, in a folder that is one sample's."""
TABLE_SUFFIXES = {".csv", ".tsv", ".txt", ".xlsx"}
UNREAD_TABLES = {".xls", ".xlsm", ".xlsb", ".ods", ".numbers", ".sxc"}
"""A lab's own numbers in formats that are not read: to be named, not passed over."""


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


WORDS: dict[Role, frozenset[str]] = {
    "photo": _set(
        "photo photos foto fotos picture pictures pic pics image images bild bilder dcim top above oben draufsicht "
        "aufsicht side seite front back hinten vorne detail before after vorher nachher "
        "photographie dessus vue avant apres imagen imagenes arriba antes despues"
    ),
    "second_photo": _set("second zweites 2nd otherlight gegenlicht deuxieme segunda"),
    "mask": _set("mask masks maske masken painted masque masques mascara mascaras"),
    "readings": _set(
        "caliper calipers reading readings measurement measurements measured level levels depth depths height heights "
        "sheet sheets data schieblehre messschieber messung messungen messwert messwerte messreihe messdaten daten "
        "tiefe tiefen hoehe hoehen pegel tabelle "
        "mesure mesures releve releves lecture lectures donnees profondeur profondeurs niveau niveaux tableau "
        "lectura lecturas medida medidas medicion mediciones datos profundidad profundidades nivel niveles tabla"
    ),
    "note": _set(
        "note notes info infos meta metadata protocol protokoll protokolle log notiz notizen bemerkung bemerkungen "
        "angaben remarque remarques fiche nota notas observaciones ficha"
    ),
}
"""At the beginning or the end of a name, in four languages, as ``plain_letters`` leaves them. Two views of one sample
are both photos: which one counts is a question, and no name answers it.
"""
CAMERA = re.compile(r"(img|imag|dsc[nf]?|pxl|mvimg|cimg|gopr)[ _-]?\d{3,}([ _-]\d+)*|p\d{7}", re.IGNORECASE)
"""A name that a camera gave says nothing of a sample."""
WORD = re.compile(r"[^\W_]+")
OUTSIDE_LABELS = re.compile(r"[^\w .-]+")


@dataclass(frozen=True)
class Said:
    """What a file's name says."""

    sample: str
    """Letters, digits, spaces and -_. only; empty where the name says none."""
    role: Role


def read_names(files: Iterable[PurePath], folder: str) -> dict[PurePath, Said]:
    """What the name of each of a lab's photos, sheets and notes says; they are relative to the lab's folder.

    Where no part of a name says a sample, the file is of the one that ``folder``, the lab's folder itself, is named by.
    A camera's name is that of a sample only where a sheet or a note bears it too, as those of 'sealtwin trace' do.
    """
    files = list(files)
    by_camera = {file.parent for file in files if not _is_picture(file) and CAMERA.fullmatch(file.stem)}
    named = {file: read_name(file, camera_counts=file.parent in by_camera) for file in files}
    return {
        file: said if said.sample else Said(as_label(folder), said.role)
        for file, said in named.items()
        if said is not None
    }


def read_name(file: PurePath, *, camera_counts: bool = False) -> Said | None:
    """What one name says by itself. None for what is neither photo, sheet nor note by its suffix.

    A folder is part of a sample's name too, unless its own name only says what lies in it: photos/P01.jpg and
    sheets/P01.csv are of one sample, May/P01.jpg and June/P01.jpg are not.
    """
    possible = possible_roles(file.suffix.lower())
    if not possible:
        return None
    rest, said = ("", []) if file.name == STARTED else _without(file.stem, possible)
    folders = [_without(part, tuple(WORDS)) for part in file.parent.parts]
    named = [folder for folder, _ in folders if folder]
    if camera_counts or not (named and CAMERA.fullmatch(rest)):
        named.append(rest)
    # A folder of one sample often holds files of its name.
    parts = [part for before, part in pairwise(["", *named]) if sample_key(part) not in ("", sample_key(before))]
    by_folder: list[Role] = [role for _, roles in folders for role in roles]
    return Said("-".join(parts), _narrowest([*said, *by_folder[::-1]], possible))


def as_label(text: str) -> str:
    """What can name a sample anywhere: in a file's name, a report, a spreadsheet."""
    return OUTSIDE_LABELS.sub("-", text.strip())


def within_one_letter(keys: Iterable[str]) -> dict[str, set[str]]:
    """For each key those that differ from it by one letter more, less or other.

    Its time grows with their number, not with that of their pairs.
    """
    keys = list(keys)
    alike: dict[str, set[str]] = {}
    for key in keys:
        for place in range(len(key) + 1):
            alike.setdefault(f"{key[:place]}\0{key[place:]}", set()).add(key)
            alike.setdefault(f"{key[:place]}\0{key[place + 1 :]}", set()).add(key)
    near: dict[str, set[str]] = {key: set() for key in keys}
    for group in alike.values():
        if len(group) > 1:
            for key in group:
                near[key] |= group - {key}
    return near


def read_any_name(file: PurePath) -> Said | None:
    """``read_name``, of tables in formats that are not read too."""
    unread = file.suffix.lower() in UNREAD_TABLES
    return read_name(file.with_suffix(".xlsx") if unread else file)


def shorter_keys(sample: str) -> set[str]:
    """Of what is left of a name without some of its first words, or of its last: P02 of "P02 mesures 3"."""
    words = WORD.findall(sample)
    cuts = range(1, len(words))
    return {sample_key(" ".join(part)) for cut in cuts for part in (words[:cut], words[cut:])}


def possible_roles(suffix: str) -> tuple[Role, ...]:
    """What a file of that suffix can be; first what it is where its name says no more."""
    if suffix in PHOTO_SUFFIXES:
        return ("photo", "second_photo", "mask")
    if suffix in TABLE_SUFFIXES:
        return ("readings", "note")
    return ("note",) if suffix == NOTE_SUFFIX else ()


def _is_picture(file: PurePath) -> bool:
    return file.suffix.lower() in PHOTO_SUFFIXES


def _without(name: str, roles: tuple[Role, ...]) -> tuple[str, list[Role]]:
    """``name`` less the words at its ends that name one of ``roles``, and the roles that they named."""
    name = unicodedata.normalize("NFC", name)
    words = list(WORD.finditer(name))
    found: list[Role] = []
    for place in (-1, 0):
        while words and (role := _role(words[place].group(), roles)):
            found.append(role)
            del words[place]
    return as_label(name[words[0].start() : words[-1].end()] if words else ""), found


def _role(word: str, roles: tuple[Role, ...]) -> Role | None:
    word = plain_letters(word)
    return next((role for role in roles if word in WORDS[role]), None)


def _narrowest(said: list[Role], possible: tuple[Role, ...]) -> Role:
    """A mask in a folder of photos is a mask: what a name adds to its suffix counts."""
    for role in said:
        if role in possible[1:]:
            return role
    return possible[0]
