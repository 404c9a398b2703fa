"""Which files of a lab's folder are photos, sheets and notes; nothing in it is opened, and no link is followed."""

import os
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath

from sealtwin.errors import InputError, as_text
from sealtwin.lab.naming import UNREAD_TABLES, Said, read_any_name, read_name

DEFAULTS = "lab.toml"
"""What holds for all samples of the folder in which it lies on top."""
MOST_ENTRIES = 50_000
"""Files and folders that are looked at. More is a disk given by mistake."""
MOST_FILES = 5_000
"""Photos, sheets and notes: the work of years, and as many rows as the pairing file is read back with."""
MOST_FOLDERS_DEEP = 12
UNSEEN = {"Cc", "Cf", "Zl", "Zp"}
"""Unicode's categories of what controls a text and is no part of it."""


@dataclass(frozen=True)
class LeftOut:
    """A file, or a folder, that takes no part, and why."""

    file: str
    reason: str
    lost: bool
    """Whether something of the lab's is missing by it, as a sheet that cannot be read."""
    said: Said | None = None
    """What its name says of a sample."""

    @property
    def sentence(self) -> str:
        return f"{self.file}: {self.reason}"


@dataclass(frozen=True)
class Found:
    """What lies in a lab's folder; names are relative to it, in the order of their names."""

    files: tuple[PurePath, ...]
    left_out: tuple[LeftOut, ...]
    defaults: bool
    """Whether it has a lab.toml."""


def find_files(folder: Path) -> Found:
    """Look through ``folder`` and all below it.

    Raises InputError where it is no folder, or holds more than is looked at.
    """
    if not folder.is_dir():
        raise InputError(f"{as_text(folder)}: no such folder; give the one that holds photos, sheets and notes.")
    files, left_out, defaults = [], list[LeftOut](), False
    for entry in sorted(_entries(folder, left_out), key=lambda entry: entry.path):
        file = PurePath(os.path.relpath(entry.path, folder))
        reason = _refusal(entry, file)
        if reason is not None:
            said = read_any_name(file)
            left_out.append(LeftOut(plain(as_text(Path(file))), reason, lost=said is not None, said=said))
        elif file == PurePath(DEFAULTS):
            defaults = True
        elif file.name == DEFAULTS:
            left_out.append(
                LeftOut(str(file), f"{DEFAULTS} counts on top of the folder only; move it there.", lost=True)
            )
        elif file.suffix.lower() in UNREAD_TABLES:
            reason = f"{file.suffix} is not read; save it as XLSX or CSV."
            left_out.append(LeftOut(str(file), reason, lost=True, said=read_any_name(file)))
        elif read_name(file) is None:
            left_out.append(LeftOut(str(file), "neither photo, sheet nor note, by its name.", lost=False))
        else:
            files.append(file)
    if len(files) > MOST_FILES:
        raise InputError(
            f"{folder}: {len(files):,} photos, sheets and notes; at most {MOST_FILES:,} at a time are taken."
        )
    return Found(tuple(files), tuple(left_out), defaults)


def plain(text: str) -> str:
    """``text`` on one line, with nothing in it that moves a terminal's cursor or turns its letters round."""
    return "".join("?" if unicodedata.category(letter) in UNSEEN else letter for letter in text)


def _entries(folder: Path, left_out: list[LeftOut]) -> Iterator[os.DirEntry[str]]:
    """All but folders and hidden files: a Mac leaves a ._photo.jpg beside each photo, Excel a ~$sheet.xlsx.

    Folders that are not looked into are added to ``left_out``. Raises InputError where there is too much of it all.
    """

    def leave_out(place: Path, reason: str) -> None:
        left_out.append(LeftOut(plain(as_text(Path(os.path.relpath(place, folder)))), reason, lost=True))

    seen = 0
    waiting = [(folder, 0)]
    while waiting:
        place, deep = waiting.pop()
        try:
            entries = os.scandir(place)
        except OSError as fault:
            leave_out(place, f"a folder that cannot be read ({fault.strerror}). Make it readable, or move it away.")
            continue
        with entries:
            for entry in entries:
                seen += 1
                if seen > MOST_ENTRIES:
                    raise InputError(f"{folder}: more than {MOST_ENTRIES:,} files; give one part of it at a time.")
                if entry.name.startswith((".", "~$")):
                    continue
                if not entry.is_dir(follow_symlinks=False):
                    yield entry
                elif deep == MOST_FOLDERS_DEEP:
                    reason = (
                        f"more than {MOST_FOLDERS_DEEP} folders deep: not looked into. Move what counts further up."
                    )
                    leave_out(Path(entry.path), reason)
                else:
                    waiting.append((Path(entry.path), deep + 1))


def _refusal(entry: os.DirEntry[str], file: PurePath) -> str | None:
    if entry.is_symlink():
        return "a link; links are not followed: copy the file itself."
    if not entry.is_file(follow_symlinks=False):
        return "no plain file."
    if as_text(Path(file)) != str(file):
        return "a name that is not UTF-8; rename it."
    if plain(str(file)) != str(file):
        return "a name with control characters; rename it."
    return None
