"""Trials in a lab's folder: each appears whole or not at all, and none is ever changed again."""

import contextlib
import hashlib
import json
import os
import re
import shutil
from dataclasses import asdict, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from sealtwin.errors import InputError, naming
from sealtwin.lab.catalogue import CATALOGUE, RECORD, Catalogue, KeptFile, Record, read_record
from sealtwin.lab.pairing_file import PAIRING
from sealtwin.lab.prepared import INPUTS, Prepared, RawFile
from sealtwin.photos.batch import OWN as CONTACT_SHEET
from sealtwin.store import files
from sealtwin.trials.trial import Trial, folder_name, trial_text

INCOMING = ".incoming"
"""Where a trial lies while it is written."""
TRIAL = "trial.toml"
DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Windows opens a device of that name, and no folder."""
CHUNK_BYTES = 1 << 20


def require_lab(lab: Path) -> None:
    """Raises InputError where ``lab`` holds what no ingest wrote: it must not be mixed up with it."""
    if not lab.is_dir() or (lab / CATALOGUE).is_file():
        return
    # Another process may be at its very first steps here; what is hidden is its, or the system's.
    own = {PAIRING, CATALOGUE, f"{CATALOGUE}-journal", *CONTACT_SHEET}
    shown = [entry for entry in lab.iterdir() if not entry.name.startswith(".") and entry.name not in own]
    foreign = [entry.name for entry in shown if not (entry / RECORD).is_file()]
    if foreign:
        raise InputError(
            f"{lab}: holds files that no ingest wrote ({', '.join(sorted(foreign)[:3])}); give --out another folder."
        )


def complete(lab: Path, catalogue: Catalogue) -> int:
    """Take up trials whose row was not written: their process was killed, or the catalogue is new. Returns how many.

    Whoever calls holds the lab, so that no other process is between the two.
    """
    shutil.rmtree(lab / INCOMING, ignore_errors=True)
    known = catalogue.folders()
    strays = sorted(path for path in lab.glob(f"*/{RECORD}") if path.parent.name not in known)
    records = []
    for path in strays:
        content = files.read_json(path)
        with files.understood(path):
            records.append(replace(read_record(content), folder=path.parent.name))
    for record in sorted(records, key=lambda record: (record.sample, record.revision)):
        catalogue.add(record)
    return len(records)


def keep(lab: Path, source: str, prepared: Prepared, before: Record | None) -> Record:
    """Write a trial's folder: its files byte for byte, trial.toml, record.json.

    Args:
        lab: The folder of all trials.
        source: The lab's own folder.
        prepared: A sample with a trial.
        before: The sample's trial so far.

    Raises:
        InputError: a file has changed since it was looked at, or the folder's name is taken by another sample.
    """
    revision = 1 if before is None else before.revision + 1
    record = Record(
        sample=prepared.sample.key,
        name=prepared.sample.name,
        revision=revision,
        folder=_folder(lab, prepared, before, revision),
        source=source,
        content=prepared.content,
        files=tuple(KeptFile(raw.role, raw.original, raw.kept_as, raw.sha256, raw.size_bytes) for raw in prepared.raw),
        dialect=prepared.dialect,
        date=prepared.said("date"),
        operator=prepared.said("operator"),
        said=json.loads(json.dumps({key: entry.value for key, entry in prepared.note.entries.items()}, default=str)),
        remarks=tuple(prepared.remarks),
        ingested_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        sealtwin=version("sealtwin"),
    )
    put_in_place(lab, record, prepared)
    return record


def put_in_place(lab: Path, record: Record, prepared: Prepared) -> None:
    """Write the folder of ``record`` beside its place, and move it there. Raises InputError as ``copy_raw``."""
    assert prepared.trial is not None, "only what has a trial is kept"
    incoming = lab / INCOMING
    shutil.rmtree(incoming, ignore_errors=True)
    (incoming / INPUTS).mkdir(parents=True)
    for raw in prepared.raw:
        copy_raw(raw, incoming / raw.kept_as)
    _write(incoming, prepared.trial, record)
    with naming(lab / record.folder):
        incoming.rename(lab / record.folder)
        _sync(lab)


def copy_raw(raw: RawFile, target: Path) -> None:
    """Byte for byte, and the bytes that were looked at. Raises InputError where they are others by now."""
    digest = hashlib.sha256()
    with naming(raw.path):
        source = os.open(raw.path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(source, "rb") as reader, naming(target), target.open("wb") as writer:
        while chunk := reader.read(CHUNK_BYTES):
            digest.update(chunk)
            writer.write(chunk)
        writer.flush()
        os.fsync(writer.fileno())
    if digest.hexdigest() != raw.sha256:
        raise InputError(f"{raw.path}: changed while it was taken in. Give the same command again.")


def _folder(lab: Path, prepared: Prepared, before: Record | None, revision: int) -> str:
    """The sample's name; of a later revision with its number behind an @, which no name of a folder has."""
    name = _openable(folder_name(prepared.sample.name)) if before is None else before.folder.partition("@")[0]
    folder = name if revision == 1 else f"{name}@{revision}"
    if (lab / folder).exists():
        raise InputError(
            f"{prepared.sample.files['photo']}: {lab / folder} is taken by another sample; give this one another name "
            "in the pairing file."
        )
    return folder


def _openable(name: str) -> str:
    return f"sample-{name}" if DEVICES.fullmatch(name) else name


def _write(incoming: Path, trial: Trial, record: Record) -> None:
    files.write_text(incoming / TRIAL, trial_text(trial))
    files.write_json(incoming / RECORD, asdict(record))
    _sync(incoming / INPUTS)
    _sync(incoming)


def _sync(folder: Path) -> None:
    """What lies in ``folder`` is on the disk; where a system cannot say so, it sees to that itself."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
