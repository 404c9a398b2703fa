"""One sample of a lab's folder: taken in, known already, or named with all that is wrong with it."""

import hashlib
import json
import re
import shutil
import traceback
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from sealtwin.core import files
from sealtwin.core.errors import InputError, as_text, naming
from sealtwin.core.progress import Progress
from sealtwin.lab.catalogue import RECORD, Catalogue, Record
from sealtwin.lab.notes import Note
from sealtwin.lab.pairing import SampleFiles
from sealtwin.lab.sample_trials import INPUTS, Prepared, gather, prepare
from sealtwin.trial.trial_file import folder_name, trial_text

INCOMING = f".incoming.{files.TEMPORARY_MARK}"
"""The folder in which a trial is written. It is removed, so its name is none that a user gives."""
TRIAL = "trial.toml"
DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Windows opens a device of that name, and no folder."""
Fate = Literal["new", "revised", "unchanged", "failed", "bug"]


@dataclass(frozen=True)
class SampleOutcome:
    """Result of one sample."""

    sample: SampleFiles
    fate: Fate
    faults: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    trial: str | None = None  # Its folder; in a dry run there is none yet
    revision: int | None = None
    dialect: str | None = None


@dataclass(frozen=True)
class Work:
    """Data that all samples of one ingest share."""

    folder: Path
    defaults: Note
    lab: Path
    catalogue: Catalogue
    progress: Progress
    dry_run: bool
    sound: list[Prepared] = field(default_factory=list)  # Samples in which nothing was wrong, as they are taken in


def take_in(sample: SampleFiles, work: Work) -> SampleOutcome:
    """Take in a sample. Whatever is wrong with it is its own fault, but for a fault of the disk of the lab."""
    prepared = Prepared(sample)
    try:
        prepared = gather(work.folder, sample, work.defaults)
        if (outcome := _taken_in(prepared, work)) is not None:
            work.sound.append(prepared)
            return outcome
    except InputError as fault:
        prepared.faults += str(fault).splitlines()
    except OSError as fault:
        if fault.filename is None or Path(fault.filename).is_relative_to(work.lab):
            raise
        prepared.faults.append(f"{fault.filename}: {fault.strerror}. Make it readable.")
    except Exception as fault:
        # A bug of ours that one sample wakes must not cost the others theirs; it is told of, and ends with code 1.
        work.progress.note(traceback.format_exc())
        last = traceback.extract_tb(fault.__traceback__)[-1]
        place = f"{Path(last.filename).name}, line {last.lineno}"
        report = f"{sample.name}: {type(fault).__name__} in {place}: {fault}. A bug of ours: please report it."
        return SampleOutcome(sample, "bug", (report,))
    # Files are named as the lab knows them: from its own folder on, which is absolute here.
    return SampleOutcome(sample, "failed", tuple(fault.replace(f"{work.folder}/", "") for fault in prepared.faults))


def _taken_in(prepared: Prepared, work: Work) -> SampleOutcome | None:
    """Return None where something is wrong with the sample, which ``prepared`` then says. Raises InputError too."""
    sample = prepared.sample
    before = None if sample.questions else next(reversed(work.catalogue.records(sample.key)), None)
    if before is not None and not prepared.faults:
        kept = (work.lab / before.folder / name for name in (TRIAL, *(file.kept_as for file in before.files)))
        if before.content == prepared.content and all(file.is_file() for file in kept):
            return _outcome("unchanged", sample, before)
        _refuse_namesake(prepared, before, as_text(work.folder))
    if not sample.questions:
        prepare(work.folder, prepared)
    if prepared.faults:
        return None
    fate: Fate = "new" if before is None else "revised"
    if work.dry_run:
        return SampleOutcome(sample, fate, (), tuple(prepared.remarks), dialect=prepared.dialect)
    record = keep(prepared, before, work)
    work.catalogue.add(record)
    return _outcome(fate, sample, record)


def _outcome(fate: Fate, sample: SampleFiles, record: Record) -> SampleOutcome:
    return SampleOutcome(sample, fate, (), record.remarks, record.folder, record.revision, record.dialect)


def _refuse_namesake(prepared: Prepared, before: Record, source: str) -> None:
    """Another folder's sample of the same name is another sample, unless its photo is the same."""
    photo = before.file("photo")
    same_photo = photo is not None and any(raw.sha256 == photo.sha256 for raw in prepared.raw)
    if before.source != source and not same_photo:
        raise InputError(
            f"{prepared.sample.files['photo']}: a sample {before.name} with another photo came from {before.source}; "
            "give this one another name in the pairing file."
        )


def keep(prepared: Prepared, before: Record | None, work: Work) -> Record:
    """Write a trial's folder: its files byte for byte, trial.toml, record.json. ``before`` is the trial so far.

    Raises InputError if a file has changed since it was looked at, or the folder's name is taken by another sample.
    """
    assert prepared.trial is not None, "only what has a trial is kept"
    revision = 1 if before is None else before.revision + 1
    said = {key: entry.value for key, entry in prepared.note.entries.items()}
    record = Record(
        sample=prepared.sample.key,
        name=prepared.sample.name,
        revision=revision,
        folder=_folder(work.lab, prepared, before, revision),
        source=as_text(work.folder),
        content=prepared.content,
        files=tuple(prepared.raw),
        dialect=prepared.dialect,
        date=said.get("date"),
        operator=said.get("operator"),
        said=json.loads(json.dumps(said, default=str)),
        remarks=tuple(prepared.remarks),
        ingested_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        sealtwin=version("sealtwin"),
    )
    incoming, target = work.lab / INCOMING, work.lab / record.folder
    shutil.rmtree(incoming, ignore_errors=True)
    (incoming / INPUTS).mkdir(parents=True)
    for raw in prepared.raw:
        path = work.folder / raw.original
        with naming(path):
            content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() != raw.sha256:
            raise InputError(f"{path}: changed while it was taken in. Give the same command again.")
        files.write_bytes(incoming / raw.kept_as, content)
    files.write_text(incoming / TRIAL, trial_text(prepared.trial))
    files.write_json(incoming / RECORD, asdict(record))
    with naming(target):
        incoming.rename(target)
    return record


def _folder(lab: Path, prepared: Prepared, before: Record | None, revision: int) -> str:
    """Name the trial's folder by the sample; a later revision with its number behind an @, which no other name has."""
    name = folder_name(prepared.sample.name) if before is None else before.folder.partition("@")[0]
    if before is None and DEVICES.fullmatch(name):
        name = f"sample-{name}"
    folder = name if revision == 1 else f"{name}@{revision}"
    if (lab / folder).exists():
        raise InputError(
            f"{prepared.sample.files['photo']}: {lab / folder} is taken by another sample; give this one another name "
            "in the pairing file."
        )
    return folder
