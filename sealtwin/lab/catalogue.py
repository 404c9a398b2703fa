"""Read and write the catalogue of a lab, which lists its trials, their files and all faults, and run its samples."""

import time
from collections import defaultdict
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError, SealtwinError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding
from sealtwin.core.workers import Lost
from sealtwin.lab.files import TRIAL, CatalogueFault, KeptFile, Placed
from sealtwin.lab.tracing import write_trace
from sealtwin.study.estimate import SETUP_S, checked_size
from sealtwin.study.pipeline import run_trial
from sealtwin.study.runner import StudyOptions, launch
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.job import STAGES
from sealtwin.trial.trial_file import load_trial
from validate.readings.words import sample_key
from validate.result import RESULT, TrialResult, read_result

CATALOGUE, TABLE = "catalogue.json", "catalogue.csv"
RECORD = "record.json"  # File in each trial's folder that lists the files and settings from which the trial was made
RUN = "run"  # Folder with the results of a trial's run, in the trial's folder
COLUMNS = (
    "sample", "revision", "state", "date", "operator", "data", "depth_mm", "photo", "photo_sha256", "readings",
    "readings_sha256", "dialect", "remarks", "result", "mean_error_mm", "ingested_utc", "folder", "reason",
)  # fmt: skip
REPORT_S = 4.0  # Time in s to compare a run with its readings and to draw its report, on one core
REMEDY = "Move this file elsewhere, and ingest the same folders again: it is rebuilt from all records and pairing.csv."
OF_RECORD = "Move the folder of this file elsewhere, and ingest the same folders again."
NOT_SOUND = "it has open questions, but its files are no longer in the folder. Ingest them again, or remove its trial."


@dataclass(frozen=True)
class Record:
    name: str
    revision: int  # Number from 1. A trial that was run or edited is kept; the sample's next trial is a new revision
    folder: str
    source: str  # Name of the lab's folder, and a hash of its path
    files: tuple[KeptFile, ...]
    dialect: str | None  # Sentence that says how the sheet of readings was interpreted
    date: str | None
    operator: str | None
    said: Mapping[str, Any]  # Settings of the sample by dotted key
    remarks: tuple[str, ...]  # Remarks on the sheet of readings
    ingested_utc: str
    trial_sha256: str = ""  # SHA-256 hash of trial.toml when it was written
    sound: bool = True  # False if there are open questions, or if writing the trial was interrupted

    @property
    def key(self) -> str:
        """Key of the sample's name. All spellings of the name have the same key."""
        return sample_key(self.name)


@dataclass(frozen=True)
class SourceFile:
    """Entry of catalogue.json for a folder that was ingested."""

    decisions: Placed
    """The user's decisions, by file: the rows of the pairing file that differ from the pairing by names."""
    faults: list[CatalogueFault]


@dataclass
class CatalogueFile:
    """Content of catalogue.json."""

    version: Literal[6] = 6
    pairing: str = ""
    """Hash of the pairing file when the last ingest read or wrote it, or "" if there was none.

    If the hash of the file differs, the user has edited the file."""
    sources: dict[str, SourceFile] = field(default_factory=dict)


class Catalogue:
    """The trials of a lab, read from the record in each trial's folder, and the content of catalogue.json.

    Lock the lab before you change the catalogue, and save the catalogue afterwards. If the process is killed, no file
    is incomplete.
    """

    def __init__(self, lab: Path) -> None:
        """Read the catalogue of a lab. The lab may be empty. Raises InputError if its files cannot be read."""
        self.lab, path = lab, lab / CATALOGUE
        records = (
            replace(record_files.read_record(Record, path, OF_RECORD), folder=path.parent.name)
            for path in lab.glob(f"[!.]*/{RECORD}")
        )
        self.records = sorted(records, key=lambda record: (record.key, record.revision))
        # A photo that was paired anew belongs to its newest sample. The earlier sample has no file of its own.
        owners = dict[tuple[str, str], str]()
        for record in sorted(self.records, key=lambda record: record.ingested_utc):
            owners |= dict.fromkeys(_photos(record), record.key)
        self.latest = {
            record.key: record
            for record in self.records
            if record.sound or record.key in {owners[photo] for photo in _photos(record)}
        }
        """Latest record of each sample, by its key."""

        self.content = record_files.read_record(CatalogueFile, path, REMEDY) if path.is_file() else CatalogueFile()

    @classmethod
    def of(cls, lab: Path) -> "Catalogue":
        """Read the catalogue of a lab. Raises InputError if the folder is not a lab."""
        if not (lab / CATALOGUE).is_file():
            raise InputError(
                f"{lab}: is not a lab, since it has no {CATALOGUE}. Make one with 'sealtwin ingest FOLDER --out {lab}'."
            )
        return cls(lab)

    def faults(self) -> Mapping[str, list[CatalogueFault]]:
        """Return the faults that the last ingest of each folder found, by the key of the sample's name.

        They include a fault for each sample whose files were removed before its questions were answered.
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
        """Store the user's decisions about the files of an ingested folder, and the faults that were found in it."""
        self.content.sources[source] = SourceFile(decisions=decisions, faults=faults)
        files.write_json(self.lab / CATALOGUE, asdict(self.content))


def _photos(record: Record) -> list[tuple[str, str]]:
    """Return the photos of a sample: the name of the lab's folder, and the path in it."""
    return [(record.source, file.original) for file in record.files if file.role == "photo"]


def write_table(lab: Path) -> None:
    """Write catalogue.csv, with a row for the latest trial of each sample and for each fault of the last ingests."""
    catalogue, rows = Catalogue.of(lab), list[dict[str, Any]]()
    faults = catalogue.faults()
    for key, record in catalogue.latest.items():
        reasons = [fault.sentence for fault in faults.get(key, ())]
        depth = record.said.get("crack.depth_mm")
        row = {
            **vars(record),
            "sample": record.name,
            "remarks": len(record.remarks),
            "state": "asked" if reasons else "taken in",
            "data": record.said.get("photo.data"),
            "depth_mm": "along the crack" if isinstance(depth, list) else depth,
            "reason": " ".join(reasons) or None,
        }
        if (result := read_run(lab, record)) is not None:
            error_mm = result.comparison and result.comparison.mean_error_mm
            row |= {"result": f"{', '.join(result.stages) or 'nothing'} done", "mean_error_mm": error_mm}
        for file in record.files:
            row |= {file.role: file.original, f"{file.role}_sha256": file.sha256}
        rows.append(row)
    for fault in (fault for faults_of_file in faults.values() for fault in faults_of_file):
        rows.append({"sample": fault.name, "state": "failed" if fault.is_fault else "asked", "reason": fault.sentence})
    files.write_sheet(lab / TABLE, COLUMNS, ([row.get(column) for column in COLUMNS] for row in rows))


def read_run(lab: Path, record: Record) -> TrialResult | None:
    """Return the result of a trial's run, or None if the trial was not run."""
    folder = lab / record.folder / RUN
    return read_result(folder) if (folder / RESULT).is_file() else None


@dataclass(frozen=True)
class SampleRun:
    """Result of running one sample."""

    name: str
    state: Literal["done", "up to date", "failed", "left out"]
    folder: str | None = None  # Name of the trial's folder in the lab
    mean_error_mm: float | None = None  # None without readings
    passed: bool | None = None  # True if the gate is passed. None if the trial has no gate
    report: str | None = None
    reason: str | None = None  # Reason why the sample failed or was left out
    warnings: tuple[str, ...] = ()
    bug: bool = False
    wall_s: float = 0.0


def run_samples(lab: Path, options: StudyOptions, progress: Progress) -> list[SampleRun]:
    """Run the latest trial of each sound sample, write the table, and return the results of all samples.

    Finished runs are not computed again. Samples with open questions are left out. If one run fails, the others
    continue. Raises InputError if the folder is not a lab.
    """
    catalogue = Catalogue.of(lab)
    faults = catalogue.faults()
    results = [
        SampleRun(sample_faults[0].name, "left out", reason=" ".join(fault.sentence for fault in sample_faults))
        for sample_faults in faults.values()
    ]
    records = {record.folder: record for key, record in catalogue.latest.items() if key not in faults}

    def keep(run: StudyRun, result: SampleRun | Lost) -> StudyRun:
        if isinstance(result, Lost):
            result = SampleRun(records[run.key].name, "failed", run.key, reason=f"{result.reason}. Give fewer --jobs.")
        results.append(result)
        return replace(run, state="failed" if result.state == "failed" else "done", wall_s=result.wall_s)

    runs = [
        StudyRun(number, key, {}, {}, key, key, _work_s(lab, record))
        for number, (key, record) in enumerate(records.items(), start=1)
    ]
    work = run_in_worker, lambda group: (lab, records[group[0].key], options.device), keep
    launch(runs, options, "Running", progress, work)
    with holding(lab, progress.note):
        write_table(lab)
    return sorted(results, key=lambda result: sample_key(result.name))


def run_in_worker(lab: Path, record: Record, device: str) -> list[SampleRun]:
    """Run one sample in its folder. Returns a list with one entry."""
    began, progress, folder = time.monotonic(), Progress(), lab / record.folder
    result = SampleRun(record.name, "failed", record.folder)
    try:
        trial = load_trial(folder / TRIAL)
        finished = run_trial(trial, folder / TRIAL, folder / RUN, STAGES, device, progress)
    except (SealtwinError, OSError) as fault:
        result = replace(result, reason=f"{fault}")
    except Exception as fault:
        # A bug in one run must not stop the others. The command then ends with exit code 1.
        reason = f"{type(fault).__name__}: {fault}. This is a bug; please report {write_trace(folder / RUN)}."
        result = replace(result, reason=reason, bug=True)
    else:
        comparison = finished.result.comparison
        result = replace(
            result,
            state="done" if finished.redone else "up to date",
            mean_error_mm=comparison and comparison.mean_error_mm,
            passed=comparison and comparison.passed,
            report=finished.result.report,
            warnings=tuple(warning.text for warning in progress.warned),
        )
    return [replace(result, wall_s=time.monotonic() - began)]


def _work_s(lab: Path, record: Record) -> float:
    """Return the estimated computing time of a run in s.

    The time is short if the run is finished, or if its files have a fault, which the worker process reports.
    """
    folder = lab / record.folder
    with suppress(InputError, OSError):
        result = read_run(lab, record)
        if result is None or set(STAGES) - set(result.stages):
            trial = load_trial(folder / TRIAL).loaded(folder)
            return checked_size(trial.pour(record_files.read_sample(folder / RUN)))[0].work_s + REPORT_S
    return SETUP_S
