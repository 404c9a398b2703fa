"""The catalogue of a lab: its trials, their original files, and the faults of its ingests."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import Result, read_record
from sealtwin.core.stage_keys import other_numbers
from sealtwin.lab.files import KeptFile, Placed
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
VERSION: Literal[5] = 5
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
    trial_sha256: str = ""  # Of trial.toml as it was written


@dataclass(frozen=True)
class CatalogueFault:
    name: str  # Name of the sample, or of a file that belongs to none
    sentence: str


class SourceFile(Result):
    """A lab's folder in catalogue.json."""

    decisions: Placed
    """The user's decisions, by file: the rows of the pairing file that differ from what the names give."""
    faults: list[CatalogueFault]


class CatalogueFile(Result):
    """Content of catalogue.json."""

    model_config = ConfigDict(frozen=False)

    version: Literal[5]
    pairing: str
    """Hash of the pairing file as the last ingest wrote it. If the file has another hash, the user has edited it."""
    sources: dict[str, SourceFile]


class Catalogue:
    """The trials of a lab, read from the record in each trial's folder, and the content of catalogue.json.

    Lock the lab before a change, and save the catalogue after it. A killed process never leaves an incomplete file.
    """

    def __init__(self, lab: Path) -> None:
        """Read a lab, which may be empty. Raises InputError if its files cannot be read."""
        self.lab, self.path = lab, lab / CATALOGUE
        records = sorted(map(_read_record, lab.glob(f"*/{RECORD}")), key=lambda each: (each.sample, each.revision))
        self._trials = defaultdict[str, list[Record]](list)  # By sample; the latest is last
        for record in records:
            self._trials[record.sample].append(record)
        self.content = CatalogueFile(version=VERSION, pairing="", sources={})
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

    @property
    def records(self) -> list[Record]:
        return [record for trials in self._trials.values() for record in trials]

    @property
    def latest(self) -> list[Record]:
        """The latest trial of each sample."""
        return [trials[-1] for trials in self._trials.values()]

    def of_sample(self, key: str) -> list[Record]:
        return self._trials.get(key, [])

    def faults(self) -> dict[str, list[CatalogueFault]]:
        """Return the faults of the last ingest of each source, by the key of the sample's name."""
        by_sample = defaultdict[str, list[CatalogueFault]](list)
        for fault in (fault for source in self.content.sources.values() for fault in source.faults):
            by_sample[sample_key(fault.name)].append(fault)
        return by_sample

    def decisions(self, source: str) -> Placed:
        """Return the user's decisions on the files of a source."""
        kept = self.content.sources.get(source)
        return kept.decisions if kept else {}

    def save(self, source: str, decisions: Placed, faults: list[CatalogueFault]) -> None:
        """Store the user's decisions on the files of a source, and the faults that its ingest found."""
        self.content.sources[source] = SourceFile(decisions=decisions, faults=faults)
        files.write_json(self.path, self.content.model_dump(mode="json"))


def is_lab(folder: Path) -> bool:
    return (folder / CATALOGUE).is_file()


def _read_record(path: Path) -> Record:
    record = read_record(Record, path, "Move its folder away, and ingest the same folders again.")
    return replace(record, folder=path.parent.name)


def latest_trials(lab: Path) -> tuple[list[dict[str, Any]], list[CatalogueFault]]:
    """Return the latest trial of each sample as a row of ``COLUMNS``, and the faults of the lab's last ingests."""
    catalogue = Catalogue.of(lab)
    faults = catalogue.faults()
    rows = [_row(lab, record, faults.get(record.sample, [])) for record in catalogue.latest]
    return rows, [fault for each in faults.values() for fault in each]


def export(lab: Path, out: Path) -> int:
    """Write a CSV with a row for each sample's latest trial and for each fault, and return the number of rows.

    Raises InputError if ``out`` exists.
    """
    if out.exists():
        raise InputError(f"{out}: already exists and is not overwritten; give another name, or move it away.")
    rows, faults = latest_trials(lab)
    rows += [{"sample": fault.name, "state": "failed", "reason": fault.sentence} for fault in faults]
    files.write_sheet(out, COLUMNS, ([row.get(column) for column in COLUMNS] for row in rows))
    return len(rows)


def read_run(lab: Path, record: Record) -> TrialResult | None:
    """Return the result of the trial's run, or None if there is none yet."""
    folder = lab / record.folder / RUN
    return read_result(folder) if (folder / RESULT).is_file() else None


def progress_of(lab: Path, record: Record) -> str:
    """Return the state of a trial's run in words."""
    result = read_run(lab, record)
    if result is None:
        return "not run"
    if result.comparison is None:
        return f"{', '.join(result.stages) or 'nothing'} done"
    other = " (other version)" if other_numbers(result.numbers, NUMBERS) else ""
    return f"mean error {result.comparison.mean_error_mm:.2f} mm{other}"


def _row(lab: Path, record: Record, faults: Sequence[CatalogueFault]) -> dict[str, Any]:
    result, depth = read_run(lab, record), record.said.get("crack.depth_mm")
    row = {**vars(record), "sample": record.name, "data": record.said.get("photo.data")}
    for file in record.files:
        row |= {file.role: file.original, f"{file.role}_sha256": file.sha256}
    row["depth_mm"] = depth if isinstance(depth, int | float) else "along the crack"
    row["mean_error_mm"] = result and result.comparison and result.comparison.mean_error_mm
    row["result"] = "not sound" if faults and row["mean_error_mm"] is None else progress_of(lab, record)
    row["state"] = "not sound" if faults else "taken in"
    row["reason"] = " ".join(fault.sentence for fault in faults) or None
    return {column: row.get(column) for column in COLUMNS}
