"""The catalogue of a lab: which trials there are, of which files they were made, and what could not be taken in."""

import json
import sqlite3
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path, PurePath
from typing import Any, Self

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.lab.found_files import Piece, Role, Said, few
from sealtwin.lab.pairing import Answers, Decisions
from sealtwin.lab.sample_trials import KeptFile, SampleOutcome
from validate.readings.samples import sample_key

CATALOGUE = "catalogue.sqlite"
RECORD = "record.json"
"""Name of the file in each trial's folder that repeats its row, so that a lab is whole without its catalogue."""
RUN = "run"  # Folder beside a trial's files in which the results of its run are looked for
LOOKED_AT: Mapping[Role, str] = {"photo": "photo", "readings": "table of readings"}  # Files that are each of one sample
COLUMNS = (
    "sample", "revision", "state", "date", "operator", "data", "depth_mm", "photo", "photo_sha256", "readings",
    "readings_sha256", "dialect", "result", "mean_error_mm", "ingested_utc", "folder", "reason",
)  # fmt: skip
VERSION = "2"
TABLES = """
CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS trials (
    sample TEXT NOT NULL,       -- key of its name
    revision INTEGER NOT NULL,
    folder TEXT NOT NULL UNIQUE,
    record TEXT NOT NULL,       -- JSON
    PRIMARY KEY (sample, revision)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS faults (
    source TEXT NOT NULL,       -- name of the lab's folder, with a hash of its place beside the lab
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
USES = """
CREATE TABLE IF NOT EXISTS uses (
    readings TEXT NOT NULL,     -- hash of their values
    what TEXT NOT NULL,         -- the study that ranked its runs by them
    PRIMARY KEY (readings, what)
) WITHOUT ROWID;
"""
"""Table that a catalogue has from its first such study on."""
WAIT_S = 60.0  # Longest wait for another process to finish its write, which takes milliseconds on most disks
REMEDY = "Move it away and ingest the same folders again: it is made anew, from the trials' own, and from pairing.csv."
"""Advice for a catalogue that is damaged, or of another version."""


@dataclass(frozen=True)
class Record:
    """One trial of the catalogue, as it was taken in."""

    sample: str  # Key of its name: equal for all spellings
    name: str
    revision: int  # Number from 1; a sample whose file or note has changed becomes a new trial, and the old one is kept
    folder: str
    source: str  # Name of the lab's folder, with a hash of its place
    content: str  # Hash of what was measured and of what was said about it
    files: tuple[KeptFile, ...]
    dialect: str | None  # Dialect of the sheet of readings, as a sentence
    date: str | None
    operator: str | None
    said: Mapping[str, Any]  # All that notes said, by dotted key
    remarks: tuple[str, ...]
    ingested_utc: str
    sealtwin: str  # The version that took it in

    def file(self, role: Role) -> KeptFile | None:
        return next((file for file in self.files if file.role == role), None)


@dataclass(frozen=True)
class CatalogueFault:
    name: str  # Name of the sample, or of a file that belongs to none
    sentence: str


class Catalogue:
    """An open SQLite file. A process that is killed leaves it as before a change or as after it."""

    def __init__(self, path: Path, *, create: bool = False) -> None:
        """Open ``path``, or make it if ``create`` is True.

        Raises InputError if it cannot be read or written, or if its tables are of another version.
        """
        self.path = path
        with self._faults():
            self._base = sqlite3.connect(path, timeout=WAIT_S, isolation_level=None)
        try:
            if create:
                with self._faults():
                    self._base.executescript(TABLES)
                self._rows("INSERT OR IGNORE INTO facts VALUES ('version', ?)", [VERSION])
            if self.fact("version") != VERSION:
                raise InputError(f"{path}: written by another version. {REMEDY}")
        except BaseException:
            # Ctrl-C too: no caller has this connection to close it.
            self._base.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._base.close()

    @classmethod
    def of(cls, lab: Path, *, or_empty: bool = False) -> Self:
        """Open a lab's; where there is none, raise InputError, or with ``or_empty`` open an empty one in memory."""
        path = lab / CATALOGUE
        # A file of no bytes is one whose creation was interrupted.
        if path.is_file() and path.stat().st_size > 0:
            return cls(path)
        if or_empty:
            return cls(Path(":memory:"), create=True)
        raise InputError(f"{lab}: no lab (it has no {CATALOGUE}). 'sealtwin ingest FOLDER --out {lab}' makes one.")

    def records(self, sample: str | None = None) -> list[Record]:
        """Return all trials, or those of one sample, in the order of samples and revisions."""
        rows = self._rows(
            "SELECT record FROM trials WHERE sample = coalesce(?, sample) ORDER BY sample, revision", [sample]
        )
        with files.understood(self.path):
            return [read_record(json.loads(row[0])) for row in rows]

    def add(self, record: Record) -> None:
        """Let a trial count from now on; its folder is there, whole."""
        row = [record.sample, record.revision, record.folder, json.dumps(asdict(record))]
        self._rows("INSERT INTO trials VALUES (?, ?, ?, ?)", row)

    def faults(self) -> list[CatalogueFault]:
        """Return the faults of the last ingest of every source."""
        return [CatalogueFault(*row) for row in self._rows("SELECT name, sentence FROM faults ORDER BY rowid")]

    def state_faults(self, source: str, faults: Iterable[CatalogueFault]) -> None:
        self._replace("faults", source, [(fault.name, fault.sentence) for fault in faults])

    def decisions(self, source: str) -> Decisions:
        """Return the user's corrections of the pairing of a source."""
        rows = self._rows("SELECT file, part, role, sample FROM decisions WHERE source = ?", [source])
        return {(PurePath(file), part): Said(sample, role) for file, part, role, sample in rows}

    def answers(self, source: str) -> Answers:
        """Return the user's answers on the sheets of a source."""
        said = json.loads(self.fact(f"answers {source}") or "[]")
        return {(file, part): answers for file, part, answers in said}

    def state_decisions(self, source: str, decided: Decisions, answers: Answers) -> None:
        rows = [(file.as_posix(), part, said.role, said.sample) for (file, part), said in decided.items()]
        self._replace("decisions", source, rows)
        listed = [[file, part, dict(said)] for (file, part), said in answers.items()]
        self.state_fact(f"answers {source}", json.dumps(listed))

    def rename_source(self, path: str, name: str) -> None:
        """Give a source its name in place of its path, which earlier versions kept."""
        for table in ("faults", "decisions"):
            self._rows(f"UPDATE {table} SET source = ? WHERE source = ?", [name, path])

    def uses(self, digest: str) -> list[str]:
        """Return the studies that ranked their runs by readings with that hash."""
        if not self._rows("SELECT name FROM sqlite_master WHERE name = 'uses'"):
            return []
        return [row[0] for row in self._rows("SELECT what FROM uses WHERE readings = ? ORDER BY what", [digest])]

    def note_use(self, digest: str, what: str) -> None:
        self._rows(USES)
        self._rows("INSERT OR IGNORE INTO uses VALUES (?, ?)", [digest, what])

    def fact(self, name: str) -> str | None:
        rows = self._rows("SELECT value FROM facts WHERE name = ?", [name])
        return rows[0][0] if rows else None

    def state_fact(self, name: str, value: str) -> None:
        self._rows("INSERT OR REPLACE INTO facts VALUES (?, ?)", [name, value])

    def _rows(self, statement: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        with self._faults():
            return self._base.execute(statement, values).fetchall()

    def _replace(self, table: str, source: str, rows: Sequence[tuple[str, ...]]) -> None:
        """Replace the rows of a source, all of them or none. Raises InputError if they cannot be written."""
        # As a context, a connection commits or, at Ctrl-C too, rolls back.
        with self._faults(), self._base:
            self._base.execute("BEGIN IMMEDIATE")
            self._base.execute(f"DELETE FROM {table} WHERE source = ?", [source])
            for row in rows:
                places = ", ".join("?" * (1 + len(row)))
                self._base.execute(f"INSERT INTO {table} VALUES ({places})", [source, *row])

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Raise an InputError for a fault of disk or file, which the user can mend."""
        try:
            yield
        except (sqlite3.IntegrityError, sqlite3.ProgrammingError):
            raise
        except sqlite3.DatabaseError as fault:
            # Without a table or a column it is a sound database, and another program's.
            if isinstance(fault, sqlite3.OperationalError) and not str(fault).startswith("no such"):
                raise InputError(
                    f"{self.path}: {fault}. The folder must be writable, not full, and on a disk of this machine; then "
                    "give the same command again."
                ) from fault
            raise InputError(f"{self.path}: no catalogue that can be read ({fault}). {REMEDY}") from fault


def read_record(content: Mapping[str, Any]) -> Record:
    """Make a record from its dictionary. Raises KeyError or TypeError where it is none."""
    kept = tuple(KeptFile(**file) for file in content["files"])
    return Record(**{**content, "files": kept, "remarks": tuple(content["remarks"])})


def remark_twins(sound: Sequence[SampleOutcome], catalogue: Catalogue) -> None:
    """Add a remark to samples with files that are identical to those of another sample, here or in the lab."""
    holders: dict[str, dict[str, str]] = defaultdict(dict)
    for record in catalogue.records():
        for file in record.files:
            holders[file.sha256][record.sample] = f"{file.original} of {record.sample}"
    for each in sound:
        for raw in each.raw:
            if raw.role == "text":
                continue
            part = each.sample.part if raw.role == "readings" else None
            holders[each.hashes[raw.role]][each.sample.key] = str(Piece(PurePath(raw.original), part))
    for each in sound:
        for role, what in LOOKED_AT.items():
            alike = holders[each.hashes.get(role, "")]
            if len(alike) > 1:
                where = few([name for _, name in sorted(alike.items())])
                each.remarks.append(f"one {what} in {len(alike)} samples: {where}. Is each of its own?")


def latest_trials(lab: Path) -> tuple[list[dict[str, Any]], list[CatalogueFault]]:
    """Return the latest trial of each sample, a dictionary with ``COLUMNS``, and what failed."""
    with Catalogue.of(lab) as catalogue:
        latest = {record.sample: record for record in catalogue.records()}
        return [_row(lab, record) for record in latest.values()], catalogue.faults()


def revisions(lab: Path, sample: str) -> tuple[list[Record], list[CatalogueFault]]:
    """Return all trials of one sample, and what failed. Raises InputError where the lab knows no such sample."""
    with Catalogue.of(lab) as catalogue:
        records = catalogue.records(sample_key(sample))
        faults = [fault for fault in catalogue.faults() if sample_key(fault.name) == sample_key(sample)]
    if not records and not faults:
        raise InputError(f"{lab}: no sample {sample!r:.80}; 'sealtwin lab list {lab}' names those that there are.")
    return records, faults


def export(lab: Path, out: Path) -> int:
    """Write a CSV with a row for each sample, taken in or not; return how many. Raises InputError if ``out`` exists."""
    if out.exists():
        raise InputError(f"{out}: is there already and is not overwritten; give another name, or move it away.")
    trials, faults = latest_trials(lab)
    failed = [{"sample": fault.name, "state": "failed", "reason": fault.sentence} for fault in faults]
    rows: Sequence[dict[str, Any]] = [*trials, *failed]
    files.write_sheet(out, COLUMNS, ([row.get(column) for column in COLUMNS] for row in rows))
    return len(rows)


def read_run(lab: Path, record: Record) -> dict[str, Any] | None:
    """Return the result of the trial's run; None where it has none."""
    path = lab / record.folder / RUN / "run.json"
    if not path.is_file():
        return None
    with files.understood(path):
        return dict(files.read_json(path))


def progress_of(lab: Path, record: Record) -> str:
    """Return in words how far the trial is."""
    result = read_run(lab, record)
    if not (lab / record.folder).is_dir():
        return "its folder is gone"
    if result is None:
        return "not run"
    if "mean_error_mm" in result:
        return f"mean error {result['mean_error_mm']:.2f} mm"
    return f"{', '.join(result.get('stages', ())) or 'nothing'} done"


def _row(lab: Path, record: Record) -> dict[str, Any]:
    photo, readings, result = record.file("photo"), record.file("readings"), read_run(lab, record)
    depth = record.said.get("crack.depth_mm")
    row = vars(record) | {
        "sample": record.name,
        "state": "taken in",
        "data": record.said.get("data", record.said.get("photo.data")),
        "depth_mm": depth if isinstance(depth, int | float) else "along the crack",
        "photo": photo and photo.original,
        "photo_sha256": photo and photo.sha256,
        "readings": readings and readings.original,
        "readings_sha256": readings and readings.sha256,
        "result": progress_of(lab, record),
        "mean_error_mm": result and result.get("mean_error_mm"),
    }
    return {column: row.get(column) for column in COLUMNS}
