"""The catalogue of a lab: its trials, their original files, and the faults of its ingests."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Any, Literal

from pydantic import ConfigDict

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import Result, read_record
from sealtwin.core.stage_keys import other_numbers, stage_key
from sealtwin.lab.files import TRIAL, FilePlace
from sealtwin.lab.pairing import Placed
from sealtwin.lab.sample import KeptFile
from sealtwin.trial.stage_numbers import NUMBERS
from validate.readings.names import sample_key
from validate.result import RESULT, TrialResult, read_result

CATALOGUE = "catalogue.json"
RECORD = "record.json"  # File in each trial's folder: the files and words that it was made of
RUN = "run"  # Folder beside a trial's files with the results of its run
COLUMNS = (
    "sample", "revision", "state", "date", "operator", "data", "depth_mm", "photo", "photo_sha256", "readings",
    "readings_sha256", "dialect", "result", "mean_error_mm", "ingested_utc", "folder", "reason",
)  # fmt: skip
VERSION: Literal[4] = 4
REMEDY = "Move it away and ingest the same folders again, which rebuilds it from the trials' records and pairing.csv."


@dataclass(frozen=True)
class Record:
    sample: str  # Key of its name: equal for all spellings
    name: str
    revision: int  # From 1; a changed file or note makes a new trial, and the old one stays
    folder: str
    source: str  # Name of the lab's folder, with a hash of its place
    content: str  # Hash of files and notes
    files: tuple[KeptFile, ...]
    dialect: str | None  # Dialect of the sheet of readings, as a sentence
    date: str | None
    operator: str | None
    said: Mapping[str, Any]  # Settings in its notes, by dotted key
    remarks: tuple[str, ...]
    ingested_utc: str
    sealtwin: str  # The version that took it in
    trial_sha256: str = ""  # Of trial.toml as it was written


@dataclass(frozen=True)
class CatalogueFault:
    name: str  # Name of the sample, or of a file that belongs to none
    sentence: str


class SourceFile(Result):
    """A lab's folder in catalogue.json."""

    decisions: dict[str, list[FilePlace]]
    """The user's decisions, by file: the rows of the pairing file that differ from what the names give."""
    faults: list[CatalogueFault]


class CatalogueFile(Result):
    """Content of catalogue.json."""

    model_config = ConfigDict(frozen=False)

    version: Literal[4]
    pairing: str
    """Hash of the pairing file as the last ingest wrote it. If the file has another hash, the user has edited it."""
    checked: dict[str, tuple[str, list[str]]]
    """State of each trial when it was checked and the faults that prevent its run, by the trial's folder."""
    sources: dict[str, SourceFile]


class Catalogue:
    """The trials of a lab, read from the record in each trial's folder, and the content of catalogue.json.

    Lock the lab before a change, and save the catalogue after it. A killed process never leaves an incomplete file.
    """

    def __init__(self, lab: Path) -> None:
        """Read a lab, which may be empty. Raises InputError if its files cannot be read."""
        self.lab, self.path = lab, lab / CATALOGUE
        records = sorted(map(_read_record, lab.glob(f"*/{RECORD}")), key=lambda each: (each.sample, each.revision))
        self._trials: dict[str, dict[str, Record]] = {}  # By sample, then by folder
        for record in records:
            self.put(record)
        self.content = CatalogueFile(version=VERSION, pairing="", checked={}, sources={})
        if self.path.is_file():
            self.content = read_record(CatalogueFile, self.path, REMEDY)

    @classmethod
    def of(cls, lab: Path) -> "Catalogue":
        """Read the catalogue of a lab. Raises InputError if the folder is not a lab."""
        if not is_lab(lab):
            raise InputError(
                f"{lab}: is not a lab, since it has no {CATALOGUE}. Make one with 'sealtwin ingest FOLDER --out {lab}'."
            )
        return cls(lab)

    def save(self) -> None:
        files.write_json(self.path, self.content.model_dump())

    @property
    def records(self) -> list[Record]:
        return [record for trials in self._trials.values() for record in trials.values()]

    def of_sample(self, key: str) -> list[Record]:
        return [*self._trials.get(key, {}).values()]

    def put(self, record: Record) -> None:
        """Add a sample's latest trial, or replace it."""
        self._trials.setdefault(record.sample, {})[record.folder] = record

    def faults(self) -> list[CatalogueFault]:
        """Return the faults of the last ingest of each source."""
        return [fault for source in self.content.sources.values() for fault in source.faults]

    def unready(self, record: Record) -> list[str]:
        """Return the faults that prevent a trial's run and the doubts about its readings.

        Empty if the trial was not checked or has changed since.
        """
        state, sentences = self.content.checked.get(record.folder, ("", []))
        return sentences if sentences and state == state_of(self.lab / record.folder) else []

    def decisions(self, source: str) -> Placed:
        """Return the user's decisions on the files of a source."""
        kept = self.content.sources.get(source)
        return {PurePath(file): places for file, places in kept.decisions.items()} if kept else {}

    def state(self, source: str, decisions: Placed, faults: list[CatalogueFault]) -> None:
        """Store the user's decisions on the files of a source, and the faults that its ingest found."""
        by_file = {file.as_posix(): places for file, places in decisions.items()}
        self.content.sources[source] = SourceFile(decisions=by_file, faults=faults)


def state_of(folder: Path) -> str:
    """Return a key that changes with the trial file, which the user may edit, and with the simulated level."""
    looked_at = (path for path in (folder / TRIAL, folder / RUN / "profile.csv") if path.is_file())
    return stage_key({path.name: files.sha256(path) for path in looked_at}, {}, NUMBERS)


def is_lab(folder: Path) -> bool:
    return (folder / CATALOGUE).is_file()


def _read_record(path: Path) -> Record:
    record = read_record(Record, path, "Move its folder away, and ingest the same folders again.")
    return replace(record, folder=path.parent.name)


def latest_trials(lab: Path) -> tuple[list[dict[str, Any]], list[CatalogueFault]]:
    """Return the latest trial of each sample as a row of ``COLUMNS``, and the faults of the lab's last ingests."""
    catalogue = Catalogue.of(lab)
    latest = {record.sample: record for record in catalogue.records}
    return [_row(catalogue, record) for record in latest.values()], catalogue.faults()


def export(lab: Path, out: Path) -> int:
    """Write a CSV with a row for each sample's latest trial and for each fault, and return the number of rows.

    Raises InputError if ``out`` exists.
    """
    if out.exists():
        raise InputError(f"{out}: already exists and is not overwritten; give another name, or move it away.")
    trials, faults = latest_trials(lab)
    rows = [*trials, *({"sample": fault.name, "state": "failed", "reason": fault.sentence} for fault in faults)]
    files.write_sheet(out, COLUMNS, ([row.get(column) for column in COLUMNS] for row in rows))
    return len(rows)


def revisions(lab: Path, sample: str) -> tuple[Catalogue, list[Record], list[CatalogueFault]]:
    """Return the lab's catalogue, all trials of a sample and its faults. Raises InputError for an unknown sample."""
    catalogue = Catalogue.of(lab)
    records = catalogue.of_sample(sample_key(sample))
    faults = [fault for fault in catalogue.faults() if sample_key(fault.name) == sample_key(sample)]
    if not records and not faults:
        raise InputError(f"{lab}: has no sample {sample!r:.80}. List its samples with 'sealtwin lab list {lab}'.")
    return catalogue, records, faults


def read_run(lab: Path, record: Record) -> TrialResult | None:
    """Return the result of the trial's run, or None if there is none yet."""
    folder = lab / record.folder / RUN
    return read_result(folder) if (folder / RESULT).is_file() else None


def progress_of(catalogue: Catalogue, record: Record) -> str:
    """Return the state of a trial in words."""
    result = read_run(catalogue.lab, record)
    if result is not None and result.comparison is not None:
        other = " (other version)" if other_numbers(result.numbers, NUMBERS) else ""
        return f"mean error {result.comparison.mean_error_mm:.2f} mm{other}"
    if catalogue.unready(record):
        return "not sound"
    return "not run" if result is None else f"{', '.join(result.stages) or 'nothing'} done"


def _row(catalogue: Catalogue, record: Record) -> dict[str, Any]:
    result, unready = read_run(catalogue.lab, record), catalogue.unready(record)
    row = {**vars(record), "sample": record.name, "state": "taken in", "data": record.said.get("photo.data")}
    for file in record.files:
        row |= {file.role: file.original, f"{file.role}_sha256": file.sha256}
    depth = record.said.get("crack.depth_mm")
    row["depth_mm"] = depth if isinstance(depth, int | float) else "along the crack"
    row["result"] = progress_of(catalogue, record)
    row["mean_error_mm"] = result and result.comparison and result.comparison.mean_error_mm
    if unready:
        more = f" And {len(unready) - 1} more." if len(unready) > 1 else ""
        row |= {"state": "not sound", "reason": unready[0] + more}
    return {column: row.get(column) for column in COLUMNS}
