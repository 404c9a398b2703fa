"""The catalogue of a lab: which trials there are, of which files they were made, and what could not be taken in."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path, PurePath
from typing import Any, Self

from sealtwin.errors import InputError
from sealtwin.lab.naming import Role, Said
from sealtwin.lab.pairing import Decisions, Placed
from sealtwin.store import files
from sealtwin.store.database import Database

CATALOGUE = "catalogue.sqlite"
RECORD = "record.json"
"""In each trial's folder what its row says: without its catalogue a lab is still whole."""
VERSION = 2
TABLES = """
CREATE TABLE IF NOT EXISTS trials (
    sample TEXT NOT NULL,       -- key of its name
    revision INTEGER NOT NULL,
    folder TEXT NOT NULL UNIQUE,
    record TEXT NOT NULL,       -- JSON
    PRIMARY KEY (sample, revision)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS files (
    folder TEXT NOT NULL, role TEXT NOT NULL, original TEXT NOT NULL, kept_as TEXT NOT NULL, sha256 TEXT NOT NULL,
    size_bytes INTEGER NOT NULL,
    PRIMARY KEY (folder, role)
) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS by_hash ON files (sha256);
CREATE TABLE IF NOT EXISTS faults (
    source TEXT NOT NULL,       -- the lab's folder, as it was when it was last taken in
    name TEXT NOT NULL,         -- of the sample, or of a file
    sentence TEXT NOT NULL
);
CREATE TABLE IF NOT EXISTS decisions (
    source TEXT NOT NULL, file TEXT NOT NULL,
    part TEXT NOT NULL,         -- of a file that several samples share; empty: all of it
    role TEXT NOT NULL, sample TEXT NOT NULL,
    PRIMARY KEY (source, file, part)
) WITHOUT ROWID;
"""


@dataclass(frozen=True)
class KeptFile:
    role: str
    original: str
    """Where it lay, relative to the source."""
    kept_as: str
    """In the trial's folder, byte for byte."""
    sha256: str
    size_bytes: int


@dataclass(frozen=True)
class Record:
    """One trial of the catalogue, as it was taken in."""

    sample: str
    """Key of its name: equal for all spellings."""
    name: str
    revision: int
    """From 1; a sample of which a file or a word has changed becomes another trial, and the old one stays."""
    folder: str
    source: str
    """The lab's folder."""
    content: str
    """Hash of what was measured and of what was said about it."""
    files: tuple[KeptFile, ...]
    dialect: str | None
    """Of the sheet of readings, in a sentence."""
    date: str | None
    operator: str | None
    said: Mapping[str, Any]
    """All that notes said, by dotted key."""
    remarks: tuple[str, ...]
    ingested_utc: str
    sealtwin: str
    """The version that took it in."""

    def file(self, role: Role) -> KeptFile | None:
        return next((file for file in self.files if file.role == role), None)


@dataclass(frozen=True)
class Fault:
    name: str
    """Of the sample, or of a file that is of none."""
    sentence: str


class Catalogue(Database):
    """An open catalogue; short waits for other processes, nothing lost to them."""

    called = "catalogue"
    remedy = (
        "Move it away and ingest the same folders again: it is made anew, from the trials' own. A pairing that you had "
        "corrected must be given once more."
    )

    def __init__(self, path: Path, *, create: bool = False) -> None:
        # One plain file, that can be copied while nobody writes: a catalogue is asked seldom.
        super().__init__(path, TABLES, VERSION, create=create, readers_wait=True)

    @classmethod
    def of(cls, lab: Path) -> Self:
        """Raises InputError where there is none."""
        if not is_there(lab):
            raise InputError(f"{lab}: no lab (it has no {CATALOGUE}). 'sealtwin ingest FOLDER --out {lab}' makes one.")
        return cls(lab / CATALOGUE)

    @classmethod
    def unwritten(cls, lab: Path) -> Self:
        """The lab's for whoever only looks; an empty one in memory where there is none."""
        return cls.of(lab) if is_there(lab) else cls(Path(":memory:"), create=True)

    def records(self, sample: str | None = None) -> list[Record]:
        """All trials, or those of one sample, in the order of samples and revisions."""
        rows = self._rows(
            "SELECT record FROM trials WHERE sample = coalesce(?, sample) ORDER BY sample, revision", [sample]
        )
        with files.understood(self.path):
            return [read_record(json.loads(row[0])) for row in rows]

    def latest(self, sample: str) -> Record | None:
        return next(reversed(self.records(sample)), None)

    def folders(self) -> set[str]:
        return {row[0] for row in self._rows("SELECT folder FROM trials")}

    def add(self, record: Record) -> None:
        """Its folder is there, whole; from now on it counts."""
        with self._told(), self._transaction():
            self._base.execute(
                "INSERT INTO trials VALUES (?, ?, ?, ?)",
                [record.sample, record.revision, record.folder, json.dumps(asdict(record))],
            )
            self._base.executemany(
                "INSERT INTO files VALUES (?, ?, ?, ?, ?, ?)",
                [
                    (record.folder, file.role, file.original, file.kept_as, file.sha256, file.size_bytes)
                    for file in record.files
                ],
            )

    def faults(self, source: str | None = None) -> list[Fault]:
        """What the last ingest of a source, or of each, could not take in."""
        rows = self._rows(
            "SELECT name, sentence FROM faults WHERE source = coalesce(?, source) ORDER BY rowid", [source]
        )
        return [Fault(*row) for row in rows]

    def state_faults(self, source: str, faults: Iterable[Fault]) -> None:
        """In place of what was said of the source before."""
        with self._told(), self._transaction():
            self._base.execute("DELETE FROM faults WHERE source = ?", [source])
            self._base.executemany(
                "INSERT INTO faults VALUES (?, ?, ?)", [(source, fault.name, fault.sentence) for fault in faults]
            )

    def holders(self, sha256: str) -> dict[str, str]:
        """Keys of the samples that have a file of these bytes, and what it was called."""
        rows = self._rows(
            "SELECT sample, original FROM files JOIN trials USING (folder) WHERE sha256 = ? ORDER BY sample, revision",
            [sha256],
        )
        return dict(rows)

    def decisions(self, source: str) -> Decisions:
        """How the user has corrected the pairing of a source."""
        rows = self._rows("SELECT file, part, role, sample FROM decisions WHERE source = ?", [source])
        return {(PurePath(file), part): Said(sample, role) for file, part, role, sample in rows}

    def state_decisions(self, source: str, decided: Sequence[Placed]) -> None:
        with self._told(), self._transaction():
            self._base.execute("DELETE FROM decisions WHERE source = ?", [source])
            self._base.executemany(
                "INSERT INTO decisions VALUES (?, ?, ?, ?, ?)",
                [
                    (source, item.piece.file.as_posix(), item.piece.part_name, item.role, item.sample)
                    for item in decided
                ],
            )


def is_there(lab: Path) -> bool:
    """Of no bytes it is none: its making was cut short."""
    path = lab / CATALOGUE
    return path.is_file() and path.stat().st_size > 0


def read_record(content: Mapping[str, Any]) -> Record:
    """From what ``asdict`` made of it. Raises KeyError, TypeError where it is none."""
    kept = tuple(KeptFile(**file) for file in content["files"])
    return Record(**{**content, "files": kept, "remarks": tuple(content["remarks"])})
