"""One sample's files and words as they were found, before anybody looks into them."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from digitise.settings import LARGEST_FILE_BYTES
from sealtwin.lab.keys import OF_READINGS
from sealtwin.lab.naming import Role
from sealtwin.lab.notes import Note, read_note
from sealtwin.lab.pairing import LONGEST_NAME, Sample
from sealtwin.store import files
from sealtwin.trials.job import LARGEST_SHEET_BYTES
from sealtwin.trials.trial import Trial

INPUTS = Path("inputs")
PICTURES: Mapping[Role, str] = {"photo": "photo.file", "second_photo": "photo.second_photo", "mask": "photo.mask"}
"""Settings that name a file."""


@dataclass(frozen=True)
class RawFile:
    """A file of the lab's, and how it is kept."""

    role: Role
    path: Path
    original: str
    """Where it lay, relative to the lab's folder."""
    sha256: str
    size_bytes: int

    @property
    def kept_as(self) -> str:
        return kept_as(self.role, self.path)


@dataclass
class Prepared:
    """What a sample is found to be; a trial only where nothing is wrong with it."""

    sample: Sample
    raw: list[RawFile] = field(default_factory=list)
    note: Note = field(default_factory=Note)
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    trial: Trial | None = None
    dialect: str | None = None
    """Of the sheet of readings, in a sentence."""

    @property
    def content(self) -> str:
        """Hash of what was measured and of what was said about it: equal where nothing has changed."""
        said = {key: entry.value for key, entry in sorted(self.note.entries.items())}
        hashes = {raw.role: raw.sha256 for raw in self.raw}
        if self.sample.part is not None and "readings" in hashes:
            # Of a sheet that others share, only what is this sample's.
            hashes["readings"] = self.sample.part.sha256
        return hashlib.sha256(json.dumps([said, hashes], sort_keys=True, default=str).encode()).hexdigest()

    def said(self, key: str) -> str | None:
        entry = self.note.entries.get(key)
        return None if entry is None else str(entry.value)


def kept_as(role: Role, file: PurePath) -> str:
    """In the trial's folder, by its role: a lab's names may be anything, and two of one folder alike."""
    return (INPUTS / f"{role}{file.suffix.lower()}").as_posix()


def gather(folder: Path, sample: Sample, defaults: Note) -> Prepared:
    """A sample's notes, and the hashes of its files; their content is not looked at yet."""
    prepared = Prepared(sample, faults=[*sample.questions, *sample.lost])
    if sample.questions:
        return prepared
    if len(sample.name) > LONGEST_NAME:
        prepared.faults.append(f"{sample.name[:20]}...: a name of {len(sample.name)} letters; at most {LONGEST_NAME}.")
    for role, file in sorted(sample.files.items()):
        path = folder / file
        limit = LARGEST_FILE_BYTES if role in PICTURES else LARGEST_SHEET_BYTES
        size = path.stat().st_size
        if size > limit:
            prepared.faults.append(
                f"{path}: {size / 1e6:,.0f} MB; at most {limit / 1e6:,.0f} MB of such a file are read."
            )
        else:
            prepared.raw.append(RawFile(role, path, file.as_posix(), files.sha256(path), size))
    own = next((read_note(raw.path) for raw in prepared.raw if raw.role == "note"), Note())
    if "readings" in sample.files:
        prepared.note = own.over(defaults)
    else:
        prepared.note = own.over(defaults.without_readings())
        of_readings = sorted(key for key in own.entries if key.startswith(OF_READINGS))
        prepared.faults += [
            f"{own.entries[key].origin}: {key} of a sample without readings; add its sheet, or leave {key} out."
            for key in of_readings
        ]
    prepared.faults += own.faults
    prepared.remarks += prepared.note.remarks
    return prepared
