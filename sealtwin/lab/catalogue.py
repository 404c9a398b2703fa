"""The catalogue of a lab: which trials there are, of which files they were made, and what could not be taken in."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Any

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import Result, read_checked, read_record
from sealtwin.core.stage_keys import other_numbers, stage_key
from sealtwin.lab.found_files import TRIAL, Role, Said
from sealtwin.lab.pairing import Decisions
from sealtwin.lab.sample_outcome import KeptFile
from sealtwin.trial.stage_numbers import NUMBERS
from validate.readings.samples import sample_key
from validate.result import RESULT, TrialResult, read_result

CATALOGUE = "catalogue.json"
RECORD = "record.json"  # File in each trial's folder that says of which files and words it was made
RUN = "run"  # Folder beside a trial's files in which the results of its run are looked for
COMPARED = ("mean_error_mm",)  # Figures of a comparison that a lab lists
COLUMNS = (
    "sample", "revision", "state", "date", "operator", "data", "depth_mm", "photo", "photo_sha256", "readings",
    "readings_sha256", "dialect", "result", *COMPARED, "ingested_utc", "folder", "reason",
)  # fmt: skip
VERSION = 3
REMEDY = "Move it away and ingest the same folders again: it is made anew, from the trials' own, and from pairing.csv."
"""Advice for a catalogue that is damaged, or of another version."""


@dataclass(frozen=True)
class Record:
    """One trial, as it was taken in."""

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
    trial_sha256: str = ""  # Hash of trial.toml as it was written

    def file(self, role: Role) -> KeptFile | None:
        return next((file for file in self.files if file.role == role), None)


@dataclass(frozen=True)
class CatalogueFault:
    name: str  # Name of the sample, or of a file that belongs to none
    sentence: str


class SourceFile(Result):
    """One source of a lab in catalogue.json."""

    decisions: tuple[tuple[str, str | None, str | None, str | None, dict[str, Any]], ...]
    faults: tuple[tuple[str, str], ...]


class CatalogueFile(Result):
    """Content of catalogue.json."""

    pairing: str
    uses: dict[str, tuple[str, ...]]
    checked: dict[str, tuple[str, tuple[str, ...]]]
    sources: dict[str, SourceFile]


class Catalogue:
    """A lab's trials, by the record in the folder of each, and what catalogue.json remembers besides.

    Who changes it holds the lab, and saves it; a process that is killed leaves it as before or as after.
    """

    def __init__(self, lab: Path) -> None:
        """Read a lab, which may be empty. Raises InputError where its files cannot be read."""
        self.lab, self.path = lab, lab / CATALOGUE
        self.records = sorted(
            (_read_record(path) for path in lab.glob(f"*/{RECORD}")),
            key=lambda record: (record.sample, record.revision),
        )
        self.pairing = ""  # Hash of the pairing file as it was written last: another one has been edited since
        self.uses: dict[str, list[str]] = {}  # Studies that ranked their runs by readings, by the hash of these
        self.checked: dict[str, tuple[str, list[str]]] = {}
        """State of each trial when it was checked, by its folder, and the sentences on what keeps it from its run."""
        self._sources: dict[str, dict[str, Any]] = {}
        if self.path.is_file():
            self._read()

    @classmethod
    def of(cls, lab: Path) -> "Catalogue":
        """Read a lab's. Raises InputError where there is none."""
        if not is_lab(lab):
            raise InputError(f"{lab}: no lab (it has no {CATALOGUE}). 'sealtwin ingest FOLDER --out {lab}' makes one.")
        return cls(lab)

    def _read(self) -> None:
        try:
            content = files.read_json(self.path)
        except InputError as fault:
            raise InputError(f"{self.path}: no catalogue that can be read ({fault}). {REMEDY}") from fault
        version = content.get("version") if isinstance(content, dict) else None
        if version != VERSION:
            found = f"version = {version!r:.20}; {VERSION} is read"
            raise InputError(f"{self.path}: no catalogue that can be read ({found}). {REMEDY}")
        content = read_checked(CatalogueFile, self.path, REMEDY)
        self.pairing, self._sources = content["pairing"], dict(content["sources"])
        self.uses = {digest: list(names) for digest, names in content["uses"].items()}
        self.checked = {folder: (of, list(told)) for folder, (of, told) in content["checked"].items()}

    def save(self) -> None:
        kept = {"pairing": self.pairing, "uses": self.uses, "checked": self.checked, "sources": self._sources}
        files.write_json(self.path, {"version": VERSION, **kept})

    def of_sample(self, key: str) -> list[Record]:
        """Return the revisions of a sample, in their order."""
        return [record for record in self.records if record.sample == key]

    def faults(self) -> list[CatalogueFault]:
        """Return what the last ingest of every source could not take in."""
        return [CatalogueFault(*fault) for source in self._sources.values() for fault in source["faults"]]

    def unready(self, record: Record) -> list[str]:
        """Return what keeps a trial from its run, or puts its readings in doubt."""
        state, told = self.checked.get(record.folder, ("", []))
        return told if told and state == state_of(self.lab / record.folder) else []

    def decisions(self, source: str) -> Decisions:
        """Return the user's corrections of the pairing of a source, and answers on its sheets."""
        rows = self._sources.get(source, {"decisions": []})["decisions"]
        return {(PurePath(file), part): Said(name, role, answers=said) for file, part, role, name, said in rows}

    def state(self, source: str, decisions: Decisions, faults: Iterable[CatalogueFault]) -> None:
        """State what the user decided on a source, and what could not be taken in from it."""
        rows = [
            [file.as_posix(), part, said.role, said.sample, dict(said.answers)]
            for (file, part), said in decisions.items()
        ]
        told = [[fault.name, fault.sentence] for fault in faults]
        self._sources[source] = {"decisions": rows, "faults": told}


def state_of(folder: Path) -> str:
    """Return the key of a trial's check: of its file, which the user may edit, and of its level."""
    looked_at = (path for path in (folder / TRIAL, folder / RUN / "profile.csv") if path.is_file())
    return stage_key({path.name: files.sha256(path) for path in looked_at}, {}, NUMBERS)


def is_lab(folder: Path) -> bool:
    return (folder / CATALOGUE).is_file()


def _read_record(path: Path) -> Record:
    record = read_record(Record, path, "Move its folder away, and ingest the same folders again.")
    return replace(record, folder=path.parent.name)


def latest_trials(lab: Path) -> tuple[list[dict[str, Any]], list[CatalogueFault]]:
    """Return the latest trial of each sample, a dictionary with ``COLUMNS``, and what failed."""
    catalogue = Catalogue.of(lab)
    latest = {record.sample: record for record in catalogue.records}
    return [_row(catalogue, record) for record in latest.values()], catalogue.faults()


def export(lab: Path, out: Path) -> int:
    """Write a CSV with a row for each sample, taken in or not; return how many. Raises InputError if ``out`` exists."""
    if out.exists():
        raise InputError(f"{out}: is there already and is not overwritten; give another name, or move it away.")
    trials, faults = latest_trials(lab)
    rows = [*trials, *({"sample": fault.name, "state": "failed", "reason": fault.sentence} for fault in faults)]
    files.write_sheet(out, COLUMNS, ([row.get(column) for column in COLUMNS] for row in rows))
    return len(rows)


def revisions(lab: Path, sample: str) -> tuple[Catalogue, list[Record], list[CatalogueFault]]:
    """Return all trials of one sample, and what failed. Raises InputError where the lab knows no such sample."""
    catalogue = Catalogue.of(lab)
    records = catalogue.of_sample(sample_key(sample))
    faults = [fault for fault in catalogue.faults() if sample_key(fault.name) == sample_key(sample)]
    if not records and not faults:
        raise InputError(f"{lab}: no sample {sample!r:.80}; 'sealtwin lab list {lab}' names those that there are.")
    return catalogue, records, faults


def read_run(lab: Path, record: Record) -> TrialResult | None:
    """Return the result of the trial's run; None if it has none."""
    folder = lab / record.folder / RUN
    return read_result(folder) if (folder / RESULT).is_file() else None


def progress_of(catalogue: Catalogue, record: Record) -> str:
    """Return in words how far the trial is."""
    result = read_run(catalogue.lab, record)
    if result is not None and result.comparison is not None:
        other = " (other version)" if other_numbers(result.numbers, NUMBERS) else ""
        return f"mean error {result.comparison.mean_error_mm:.2f} mm{other}"
    if catalogue.unready(record):
        return "not sound"
    return "not run" if result is None else f"{', '.join(result.stages) or 'nothing'} done"


def _row(catalogue: Catalogue, record: Record) -> dict[str, Any]:
    photo, readings, result = record.file("photo"), record.file("readings"), read_run(catalogue.lab, record)
    depth, unready = record.said.get("crack.depth_mm"), catalogue.unready(record)
    row = vars(record) | {
        "sample": record.name,
        "state": "not sound" if unready else "taken in",
        "reason": unready[0] + (f" And {len(unready) - 1} more." if len(unready) > 1 else "") if unready else None,
        "data": record.said.get("data", record.said.get("photo.data")),
        "depth_mm": depth if isinstance(depth, int | float) else "along the crack",
        "photo": photo and photo.original,
        "photo_sha256": photo and photo.sha256,
        "readings": readings and readings.original,
        "readings_sha256": readings and readings.sha256,
        "result": progress_of(catalogue, record),
        **{name: result and result.comparison and getattr(result.comparison, name) for name in COMPARED},
    }
    return {column: row.get(column) for column in COLUMNS}
