"""The catalogue of a lab: its trials, their original files, and the faults of its ingests."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import read_record
from sealtwin.lab.files import KeptFile, Placed
from validate.readings.words import sample_key
from validate.result import RESULT, TrialResult, read_result

CATALOGUE = "catalogue.json"
RECORD = "record.json"  # File in each trial's folder: the files and words that it was made of
RUN = "run"  # Folder beside a trial's files with the results of its run
COLUMNS = (
    "sample", "revision", "state", "date", "operator", "data", "depth_mm", "photo", "photo_sha256", "readings",
    "readings_sha256", "dialect", "result", "mean_error_mm", "ingested_utc", "folder", "reason",
)  # fmt: skip
REMEDY = "Move it away and ingest the same folders again, which rebuilds it from the trials' records and pairing.csv."
OF_RECORD = "Move its folder away, and ingest the same folders again."
NOT_SOUND = "it has open questions, and its files are not in the lab's folder. Ingest them, or move its trial away."


@dataclass(frozen=True)
class Record:
    name: str
    revision: int  # From 1; a trial that was run or edited stays, and its sample's next one is a new revision
    folder: str
    source: str  # Name of the lab's folder, with a hash of its place
    files: tuple[KeptFile, ...]
    dialect: str | None  # Dialect of the sheet of readings, as a sentence
    date: str | None
    operator: str | None
    said: Mapping[str, Any]  # Settings in its notes, by dotted key
    remarks: tuple[str, ...]
    ingested_utc: str
    trial_sha256: str = ""  # Of trial.toml as it was written
    sound: bool = True  # False if files or settings are in question, or if writing it was interrupted

    @property
    def key(self) -> str:
        """Key of its sample's name, which is equal for all spellings."""
        return sample_key(self.name)


@dataclass(frozen=True)
class CatalogueFault:
    name: str  # Name of the sample, or of a file that belongs to none
    sentence: str
    can_be_confirmed: bool = False  # True for a doubt about readings


@dataclass(frozen=True)
class SourceFile:
    """A lab's folder in catalogue.json."""

    decisions: Placed
    """The user's decisions, by file: the rows of the pairing file that differ from what the names give."""
    faults: list[CatalogueFault]


@dataclass
class CatalogueFile:
    """Content of catalogue.json."""

    version: Literal[6] = 6
    pairing: str = ""
    """Hash of the pairing file as the last ingest read or wrote it, or "" without one. A file with another hash was
    edited by the user."""
    sources: dict[str, SourceFile] = field(default_factory=dict)


class Catalogue:
    """The trials of a lab, read from the record in each trial's folder, and the content of catalogue.json.

    Lock the lab before a change, and save the catalogue after it. A killed process never leaves an incomplete file.
    """

    def __init__(self, lab: Path) -> None:
        """Read a lab, which may be empty. Raises InputError if its files cannot be read."""
        self.lab, path = lab, lab / CATALOGUE
        records = (
            replace(read_record(Record, path, OF_RECORD), folder=path.parent.name)
            for path in lab.glob(f"[!.]*/{RECORD}")
        )
        self.records = sorted(records, key=lambda record: (record.key, record.revision))
        self.latest = {record.key: record for record in self.records}  # By the key of the sample
        self.content = read_record(CatalogueFile, path, REMEDY) if path.is_file() else CatalogueFile()

    @classmethod
    def of(cls, lab: Path) -> "Catalogue":
        """Read the catalogue of a lab. Raises InputError if the folder is not a lab."""
        if not (lab / CATALOGUE).is_file():
            raise InputError(
                f"{lab}: is not a lab, since it has no {CATALOGUE}. Make one with 'sealtwin ingest FOLDER --out {lab}'."
            )
        return cls(lab)

    def faults(self) -> Mapping[str, list[CatalogueFault]]:
        """Return the faults of the last ingest of each source, by the key of the sample's name.

        A sample whose files were removed before its questions were answered has a fault too.
        """
        by_sample = defaultdict[str, list[CatalogueFault]](list)
        for source in self.content.sources.values():
            for fault in source.faults:
                by_sample[sample_key(fault.name)].append(fault)
        for key, record in self.latest.items():
            if not (record.sound or key in by_sample):
                by_sample[key] = [CatalogueFault(record.name, NOT_SOUND)]
        return by_sample

    def save(self, source: str, decisions: Placed, faults: list[CatalogueFault]) -> None:
        """Store the user's decisions on the files of a source, and the faults that its ingest found."""
        self.content.sources[source] = SourceFile(decisions=decisions, faults=faults)
        files.write_json(self.lab / CATALOGUE, asdict(self.content))


def latest_trials(lab: Path) -> tuple[list[dict[str, Any]], list[CatalogueFault]]:
    """Return the latest trial of each sample as a row of ``COLUMNS``, and the faults of the lab's last ingests."""
    catalogue, rows = Catalogue.of(lab), list[dict[str, Any]]()
    faults = catalogue.faults()
    for key, record in catalogue.latest.items():
        result, reasons = read_run(lab, record), [fault.sentence for fault in faults.get(key, ())]
        depth = record.said.get("crack.depth_mm")
        row = {
            **vars(record),
            "sample": record.name,
            "state": "not sound" if reasons else "taken in",
            "data": record.said.get("photo.data"),
            "depth_mm": "along the crack" if isinstance(depth, list) else depth,
            "result": "not sound" if reasons else progress_of(result),
            "mean_error_mm": result and result.comparison and result.comparison.mean_error_mm,
            "reason": " ".join(reasons) or None,
        }
        for file in record.files:
            row |= {file.role: file.original, f"{file.role}_sha256": file.sha256}
        rows.append({column: row.get(column) for column in COLUMNS})
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


def progress_of(result: TrialResult | None) -> str:
    """Return the state of a trial's run in words."""
    if result is None:
        return "not run"
    if result.comparison is None:
        return f"{', '.join(result.stages) or 'nothing'} done"
    return f"mean error {result.comparison.mean_error_mm:.2f} mm"
