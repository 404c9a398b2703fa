"""One sample of a lab's folder: taken in, known already, or named with all that is wrong with it."""

import hashlib
import json
import re
import shutil
import traceback
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from sealtwin.core import files
from sealtwin.core.errors import InputError, as_text, naming
from sealtwin.core.progress import Progress
from sealtwin.lab.catalogue import RECORD, Catalogue, Record
from sealtwin.lab.notes import Note
from sealtwin.lab.pairing import SampleFiles
from sealtwin.lab.sample_trials import INPUTS, SampleOutcome, gather, prepare
from sealtwin.trial.trial_file import folder_name, trial_text

INCOMING = f".incoming.{files.TEMPORARY_MARK}"
"""The folder in which a trial is written. It is removed, so its name is none that a user gives."""
TRIAL = "trial.toml"
DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Windows opens a device of that name, and no folder."""


@dataclass(frozen=True)
class Work:
    """Data that all samples of one ingest share."""

    folder: Path
    defaults: Note
    lab: Path
    catalogue: Catalogue
    progress: Progress
    dry_run: bool


def take_in(sample: SampleFiles, work: Work) -> SampleOutcome:
    """Take in a sample. Whatever is wrong with it is its own fault, but for a fault of the disk of the lab."""
    outcome = SampleOutcome(sample)
    try:
        outcome = gather(work.folder, sample, work.defaults)
        _take_in(outcome, work)
    except InputError as fault:
        outcome.faults += str(fault).splitlines()
    except OSError as fault:
        if fault.filename is None or Path(fault.filename).is_relative_to(work.lab):
            raise
        outcome.faults.append(f"{fault.filename}: {fault.strerror}. Make it readable.")
    except Exception as fault:
        # A bug of ours that one sample wakes must not cost the others theirs; it is told of, and ends with code 1.
        work.progress.note(traceback.format_exc())
        last = traceback.extract_tb(fault.__traceback__)[-1]
        place = f"{Path(last.filename).name}, line {last.lineno}"
        report = f"{sample.name}: {type(fault).__name__} in {place}: {fault}. A bug of ours: please report it."
        outcome.fate, outcome.faults = "bug", [report]
    if outcome.faults:
        outcome.remarks, outcome.dialect = [], None
    # Files are named as the lab knows them: from its own folder on, which is absolute here.
    outcome.faults = [fault.replace(f"{work.folder}/", "") for fault in outcome.faults]
    return outcome


def _take_in(outcome: SampleOutcome, work: Work) -> None:
    """Let ``outcome`` say what became of the sample, or what is wrong with it. Raises InputError too."""
    sample = outcome.sample
    before = None if sample.questions else next(reversed(work.catalogue.records(sample.key)), None)
    if before is not None and not outcome.faults:
        kept = (work.lab / before.folder / name for name in (TRIAL, *(file.kept_as for file in before.files)))
        if before.content == outcome.content and all(file.is_file() for file in kept):
            outcome.fate, outcome.trial, outcome.revision = "unchanged", before.folder, before.revision
            outcome.remarks, outcome.dialect = list(before.remarks), before.dialect
            return
        _refuse_namesake(outcome, before, as_text(work.folder))
    if not sample.questions:
        prepare(work.folder, outcome)
    if outcome.faults:
        return
    if not work.dry_run:
        record = keep(outcome, before, work)
        work.catalogue.add(record)
        outcome.trial, outcome.revision = record.folder, record.revision
    outcome.fate = "new" if before is None else "revised"


def _refuse_namesake(outcome: SampleOutcome, before: Record, source: str) -> None:
    """Another folder's sample of the same name is another sample, unless its photo is the same."""
    photo = before.file("photo")
    same_photo = photo is not None and any(raw.sha256 == photo.sha256 for raw in outcome.raw)
    if before.source != source and not same_photo:
        raise InputError(
            f"{outcome.sample.files['photo']}: a sample {before.name} with another photo came from {before.source}; "
            "give this one another name in the pairing file."
        )


def keep(outcome: SampleOutcome, before: Record | None, work: Work) -> Record:
    """Write a trial's folder: its files byte for byte, trial.toml, record.json. ``before`` is the trial so far.

    Raises InputError if a file has changed since it was looked at, or the folder's name is taken by another sample.
    """
    assert outcome.settings is not None, "only what has a trial is kept"
    revision = 1 if before is None else before.revision + 1
    said = {key: entry.value for key, entry in outcome.note.entries.items()}
    record = Record(
        sample=outcome.sample.key,
        name=outcome.sample.name,
        revision=revision,
        folder=_folder(work.lab, outcome, before, revision),
        source=as_text(work.folder),
        content=outcome.content,
        files=tuple(outcome.raw),
        dialect=outcome.dialect,
        date=said.get("date"),
        operator=said.get("operator"),
        said=json.loads(json.dumps(said, default=str)),
        remarks=tuple(outcome.remarks),
        ingested_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        sealtwin=version("sealtwin"),
    )
    incoming, target = work.lab / INCOMING, work.lab / record.folder
    shutil.rmtree(incoming, ignore_errors=True)
    (incoming / INPUTS).mkdir(parents=True)
    for raw in outcome.raw:
        path = work.folder / raw.original
        with naming(path):
            content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() != raw.sha256:
            raise InputError(f"{path}: changed while it was taken in. Give the same command again.")
        files.write_bytes(incoming / raw.kept_as, content)
    files.write_text(incoming / TRIAL, trial_text(outcome.settings))
    files.write_json(incoming / RECORD, asdict(record))
    with naming(target):
        incoming.rename(target)
    return record


def _folder(lab: Path, outcome: SampleOutcome, before: Record | None, revision: int) -> str:
    """Name the trial's folder by the sample; a later revision with its number behind an @, which no other name has."""
    name = folder_name(outcome.sample.name) if before is None else before.folder.partition("@")[0]
    if before is None and DEVICES.fullmatch(name):
        name = f"sample-{name}"
    folder = name if revision == 1 else f"{name}@{revision}"
    if (lab / folder).exists():
        raise InputError(
            f"{outcome.sample.files['photo']}: {lab / folder} is taken by another sample; give this one another name "
            "in the pairing file."
        )
    return folder
