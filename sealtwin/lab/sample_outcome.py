"""One sample during an ingest: its files, its note, its faults and its fate."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from textwrap import shorten
from typing import Any, Literal

from sealtwin.core.records import ReadColumn
from sealtwin.lab.file_parts import Piece
from sealtwin.lab.found_files import Role
from sealtwin.lab.notes import Note
from sealtwin.lab.pairing import PAIRING, SampleFiles
from sealtwin.trial.trial_file import Trial

INPUTS = Path("inputs")
LONGEST_QUESTION = 900  # Letters of a cell of the pairing file


@dataclass(frozen=True)
class KeptFile:
    """A file of the lab, and its copy in a trial's folder."""

    role: Role
    original: str  # Path in the lab's folder
    kept_as: str  # Path of the identical copy in the trial's folder
    sha256: str
    size_bytes: int


@dataclass
class SampleOutcome:
    """A sample and the result of its ingest; only a sample without faults becomes a trial."""

    sample: SampleFiles
    fate: Literal["new", "revised", "unchanged", "failed", "bug"] = "failed"
    raw: list[KeptFile] = field(default_factory=list)
    note: Note = field(default_factory=Note)
    unread: list[str] = field(default_factory=list)  # Quotations from its note and texts that the user has answered
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    settings: Trial | None = None  # None if they cannot be used
    stand_ins: frozenset[str] = frozenset()  # Required settings that were not given and have a stand-in
    dialect: str | None = None  # Dialect of the sheet of readings, as a sentence
    columns: dict[Role, tuple[ReadColumn, ...]] = field(default_factory=dict)  # Of its sheets, as they were read
    asked: dict[PurePath, list[str]] = field(default_factory=dict)  # Questions for the pairing file, by file
    of_sheets: dict[Piece, list[str]] = field(default_factory=dict)  # Questions about readings that may be its own
    trial: str | None = None  # Folder of its trial; in a dry run there is none yet
    revision: int | None = None

    def ask(self, sentences: Iterable[str]) -> None:
        """Add each sentence to the questions about the file that it begins with, otherwise to those about the photo.

        A question about an answer begins with the pairing file, and a question about a file of another sample has its
        own row.
        """
        sample = self.sample
        for sentence in sentences:
            begin = sentence.removeprefix(f"{PAIRING}, ")
            file = next((one for one in (*sample.files.values(), *sample.texts) if begin.startswith(str(one))), None)
            if file is None and sentence in sample.awaits:
                continue
            questions = self.asked.setdefault(file or sample.files["photo"], [])
            if (cell := shorten(sentence, LONGEST_QUESTION, placeholder="...")) not in questions:
                questions.append(cell)

    @property
    def hashes(self) -> dict[Role, str]:
        """Hashes of the files by role; for a shared sheet, the hash of this sample's part."""
        part = self.sample.part
        return {
            raw.role: part.sha256 if part and raw.role == "readings" else raw.sha256
            for raw in self.raw
            if raw.role != "text"
        }

    @property
    def content(self) -> str:
        """Hash of files and settings, which changes with any of them."""
        settings: dict[str, Any] = {key: entry.value for key, entry in sorted(self.note.entries.items())}
        if of_fill := self.sample.answers.get("fill"):
            settings["of_fill"] = dict(of_fill)
        settings |= {"unread": self.unread} if self.unread else {}
        return hashlib.sha256(json.dumps([settings, self.hashes], sort_keys=True, default=str).encode()).hexdigest()


def kept_as(role: str, file: PurePath) -> str:
    """Return the name of a file's copy in the trial's folder: its role, since two files of a lab may share a name."""
    return (INPUTS / f"{role}{file.suffix.lower()}").as_posix()


def note_of(outcome: SampleOutcome) -> str:
    """Return the path of the sample's note, or a path for a new note if it has none."""
    files = outcome.sample.files
    note, photo = files.get("note"), files.get("photo", PurePath("NAME"))
    return str(note or photo.with_name(f"{photo.stem}_notes.toml"))
