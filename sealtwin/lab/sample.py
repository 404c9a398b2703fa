"""A sample of a lab's folder during an ingest: its files and settings, the questions about it, and its trial."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, Literal

from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.lab.catalogue import Record
from sealtwin.lab.files import KeptFile, Role
from sealtwin.lab.notes import Note
from sealtwin.trial.trial_file import Trial
from validate.readings.grid import ReadSheet, SheetFaults
from validate.readings.names import sample_key

PAIRING = "pairing.csv"
SETTINGS = "settings"  # Column of the pairing file for settings of the trial
Fate = Literal["new", "revised", "unchanged", "failed", "bug"]
"""What became of a sample; "failed" if it has questions that its files raise."""


@dataclass
class LabSample:
    """A photo and its files, or files of one name that belong to no photo. It is sound if it has no questions."""

    folder: Path  # The lab's
    name: str
    files: dict[Role, list[PurePath]] = field(default_factory=dict)
    """Files by role. Several of one role but notes are in question. An empty list of readings waits for a sheet."""
    answers: dict[tuple[Role, PurePath], Mapping[str, str]] = field(default_factory=dict)  # Of the pairing file
    questions: dict[str, tuple[set[PurePath], tuple[str, ...]]] = field(default_factory=dict)
    """Files in whose rows a question is, and the columns for its answer, by its sentence."""
    fate: Fate = "failed"
    raw: list[KeptFile] = field(default_factory=list)
    note: Note = field(default_factory=Note)
    remarks: list[str] = field(default_factory=list)
    trial: Trial | None = None  # None if the settings cannot be used
    stand_ins: dict[str, Any] = field(default_factory=dict)  # Of required settings that were not given
    dialect: str | None = None  # Format of the sheet of readings, as a sentence; None if it could not be read
    understood: ReadSheet | None = None  # The sheet of readings as it was understood
    record: Record | None = None  # Of its trial in the lab; None for a new one in a dry run
    trial_folder: Path = Path()  # Folder of its trial in the lab

    @property
    def key(self) -> str:
        return sample_key(self.name)

    def file(self, role: Role) -> PurePath | None:
        """Return the file of a role; None if there is none, or several."""
        files = self.files.get(role, [])
        return files[0] if len(files) == 1 else None

    def ask(self, *about: Doubt | str, file: PurePath | None = None) -> None:
        """Add questions, each to the row of ``file``, else of the file that it names, else of the photo."""
        every = [each for files in self.files.values() for each in files]
        for one in about:
            sentence, columns = (one, (SETTINGS,)) if isinstance(one, str) else (one.in_words("pairing"), one.columns)
            for raw in self.raw:
                sentence = sentence.replace(f"{self.trial_folder / raw.kept_as}", raw.original)
            sentence = sentence.replace(f"{self.folder}/", "")
            begin = sentence.removeprefix(f"{PAIRING}, ")
            named = (each for each in every if begin.startswith((f"{each}:", f"{each},")))
            rows, _ = self.questions.setdefault(sentence, (set(), columns))
            rows.add(file or next(named, every[0]))

    def refuse(self, fault: InputError, file: PurePath | None = None) -> None:
        """Add the questions of an error: those of a sheet, or a sentence of any other one each."""
        if isinstance(fault, SheetFaults):
            self.understood = fault.understood or self.understood
            self.ask(*fault.doubts, file=file)
        else:
            self.ask(*str(fault).splitlines(), file=file)

    @property
    def sheet_in_question(self) -> ReadSheet | None:
        """The sheet of readings as it was understood, if a question is about it."""
        is_asked = any(self.file("readings") in rows for rows, _ in self.questions.values())
        return self.understood if is_asked else None

    @property
    def content(self) -> str:
        """Hash of files and settings, which changes with any of them."""
        parts = [
            sorted(self.note.values.items()),
            [*self.answers.values()],
            [(raw.role, raw.sha256) for raw in self.raw],
        ]
        return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()
