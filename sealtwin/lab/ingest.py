"""Ingest a lab's folder: make a trial of each sample without faults, keep a catalogue, and report all faults."""

import hashlib
import json
import os
import shutil
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from digitise.image.decoding import PHOTO_SUFFIXES
from sealtwin.core import files
from sealtwin.core.errors import InputError, as_text, naming
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, refuse_foreign, require_folder
from sealtwin.lab.catalogue import CATALOGUE, RECORD, RUN, Catalogue, CatalogueFault, Record, is_lab
from sealtwin.lab.files import (
    DEFAULTS,
    TABLE_SUFFIXES,
    TRIAL,
    LeftOut,
    Placed,
    few,
    find_files,
    folder_of,
    place_of,
)
from sealtwin.lab.notes import Note, read_defaults, read_settings_table
from sealtwin.lab.pairing import pair, pairing_text, read_decisions
from sealtwin.lab.prepare import INPUTS, gather, prepare
from sealtwin.lab.sample import PAIRING, LabSample
from sealtwin.study.photos import OWN
from sealtwin.trial.trial_file import Trial, trial_text

INCOMING = f".incoming.{files.TEMPORARY_MARK}"
"""Folder in which a trial is written first. Ingest deletes it, so its name must be one that no user gives a folder."""


@dataclass(frozen=True)
class Ingested:
    lab: Path
    source: str  # Name of the lab's folder in the catalogue
    dry_run: bool
    samples: list[LabSample]  # And files that belong to no photo
    left_out: list[LeftOut]
    placed: Placed
    decisions: Placed

    @property
    def faults(self) -> list[CatalogueFault]:
        """Faults of samples, of files without a sample, and of files that are lost."""
        faults = [(sample.name, question) for sample in self.samples for question in sample.questions]
        faults += [(each.file, f"{each.file}: {each.reason}") for each in self.left_out if each.lost]
        return [CatalogueFault(*fault) for fault in faults]


def ingest(
    folder: Path, lab: Path, progress: Progress, *, pairing: Path | None = None, dry_run: bool = False
) -> Ingested:
    """Take a folder of photos, sheets and notes into ``lab``: a trial for each sample, and a catalogue.

    A sample that the lab already has is skipped; a changed one becomes a new trial, and its old trial stays. Waits for
    another ingest into the same lab. If the process is killed, repeat the same call to complete the ingest. The user's
    corrections and answers come from ``pairing``, or from the lab's pairing file if it was edited. The catalogue stores
    them for ``folder``.

    Raises InputError if the folder, its lab.toml, a table of settings or the pairing cannot be used.
    """
    _refuse_nested(folder, lab)
    folder, edited = folder.resolve(), lab / PAIRING
    names, left_out = find_files(folder)
    defaults = read_defaults(folder / DEFAULTS)
    way = os.path.relpath(folder, lab.resolve())
    # Without the path of the folder; it does not change if folder and lab are moved together.
    source = f"{as_text(Path(folder.name))} ({hashlib.sha256(os.fsencode(way)).hexdigest()[:8]})"
    named = {file: place for file in names if (place := place_of(file)) is not None}
    decisions = None if pairing is None else read_decisions(pairing, named)
    with _catalogue(lab, progress, dry_run) as catalogue:
        if decisions is None and edited.is_file() and files.sha256(edited) != catalogue.content.pairing:
            decisions = read_decisions(edited, named)
        elif decisions is None:
            decisions = catalogue.decisions(source)
        placed = {file: decisions.get(file, [place]) for file, place in named.items()}
        samples, of_tables = _paired(folder, placed, left_out)
        ingested = Ingested(lab, source, dry_run, samples, left_out, placed, decisions)
        if not samples and not ingested.faults:
            raise InputError(f"{folder}: it contains no photos, sheets or notes; give the folder that does.")
        progress.start(f"Taking in {len(samples)} samples", len(samples))
        for done, sample in enumerate(samples, start=1):
            with _asking(sample, lab, progress):
                gather(sample, defaults, of_tables.get(sample.key, Note()))
                _decide(ingested, catalogue, sample)
            progress.advance(done, sample.name)
        if not dry_run:
            save_questions(ingested, catalogue)
    return ingested


def _paired(folder: Path, placed: Placed, left_out: list[LeftOut]) -> tuple[list[LabSample], Mapping[str, Note]]:
    """Return the samples, the files without a photo, and the settings in tables by sample."""
    photos = {place.key for places in placed.values() for place in places if place.role == "photo"}
    lost = [each.file for each in left_out if each.lost and Path(each.file).suffix.lower() not in PHOTO_SUFFIXES]
    rest, of_tables = dict(placed), dict[str, Note]()
    for file, (first, *_) in placed.items():
        if first.role not in ("readings", "note") or first.key in photos or file.suffix.lower() not in TABLE_SUFFIXES:
            continue
        if (table := read_settings_table(folder / file)) is not None:
            rest.pop(file)
            placed[file] = [replace(first, sample="", role="note")]
            of_tables |= {key: of_tables.get(key, Note()).beside(note) for key, note in table.items()}
            if lacking := few(sorted(table.keys() - photos)):
                reason = f"has rows of {lacking}, but no such photos; add them, or set its role to ignore."
                left_out.append(LeftOut(f"{file}", reason, lost=True))
    return pair(folder, rest, lost), of_tables


def save_questions(ingested: Ingested, catalogue: Catalogue, *, edited: bool = False) -> None:
    """Write the catalogue, and the pairing file with each question in the row of the file that it is about.

    The pairing file then counts as not edited by the user; one that is ``edited`` is left as it is.
    """
    if not edited:
        files.write_text(catalogue.lab / PAIRING, pairing_text(ingested.placed, ingested.samples))
        catalogue.content.pairing = files.sha256(catalogue.lab / PAIRING)
    catalogue.save(ingested.source, ingested.decisions, ingested.faults)


@contextmanager
def _catalogue(lab: Path, progress: Progress, dry_run: bool) -> Iterator[Catalogue]:
    """Read the lab's catalogue and lock it against other processes, except in a dry run.

    Raises InputError if ``lab`` has files that no ingest wrote.
    """
    require_folder(lab)
    if lab.is_dir() and not is_lab(lab):
        # Hidden files are the system's, or those of another process that has just begun here.
        shown = [entry for entry in lab.iterdir() if not entry.name.startswith(".")]
        foreign = [e for e in shown if e.name not in {PAIRING, CATALOGUE, *OWN} and not (e / RECORD).is_file()]
        refuse_foreign(lab, "ingest", sorted(entry.name for entry in foreign))
    if dry_run:
        yield Catalogue(lab)
        return
    with holding(lab, progress.note):
        # A killed process leaves an incomplete trial.
        shutil.rmtree(lab / INCOMING, ignore_errors=True)
        yield Catalogue(lab)


def _refuse_nested(folder: Path, lab: Path) -> None:
    inner, outer = folder.resolve(), lab.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise InputError(
            f"{as_text(lab)}: --out must be neither inside nor around the lab's folder {as_text(folder)}, so that the "
            "lab's own files stay untouched; give --out another folder."
        )


@contextmanager
def _asking(sample: LabSample, lab: Path, progress: Progress) -> Iterator[None]:
    """Make questions of a sample's errors, which stop no other sample; a failure of the lab's own disk is raised."""
    try:
        yield
    except InputError as fault:
        sample.ask(*str(fault).splitlines())
    except OSError as fault:
        if fault.filename is None or Path(fault.filename).is_relative_to(lab):
            raise
        sample.ask(f"{fault.filename}: {fault.strerror}. Make it readable.")
    except Exception as fault:
        # A bug in one sample must not stop the others; the command ends with code 1.
        progress.note(traceback.format_exc())
        sample.fate, sample.questions = "bug", {}
        sample.ask(f"{sample.name}: {type(fault).__name__}: {fault}. A bug: please report it.")


def _decide(ingested: Ingested, catalogue: Catalogue, sample: LabSample) -> None:
    """Set the fate of the sample, or its questions. Raises InputError for a fault that stops it."""
    before = catalogue.of_sample(sample.key)[-1:]
    for record in before if not sample.questions else ():
        if record.content == sample.content and _is_whole(catalogue.lab, record):
            sample.fate, sample.record = "unchanged", record
            sample.remarks, sample.dialect = [*record.remarks], record.dialect
            return
        # A sample of the same name from another folder is another sample, unless its photo is the same.
        photos = {raw.sha256 for raw in (*sample.raw, *record.files) if raw.role == "photo"}
        if len(photos) > 1 and record.source != ingested.source:
            raise InputError(
                f"{sample.files['photo'][0]}: a sample {record.name} with another photo came from {record.source}; "
                "give this one another name in the pairing file."
            )
    prepare(sample)
    if not sample.questions and sample.trial is not None:
        if not ingested.dry_run:
            keep(ingested, catalogue, sample, sample.trial, *before)
        sample.fate = "revised" if before else "new"


def _is_whole(lab: Path, record: Record) -> bool:
    names = (TRIAL, *(file.kept_as for file in record.files))
    return all((lab / record.folder / name).is_file() for name in names)


def keep(
    ingested: Ingested, catalogue: Catalogue, sample: LabSample, trial: Trial, before: Record | None = None
) -> None:
    """Write a trial's folder, unchanged copies of its files, trial.toml, record.json, and add it to the catalogue.

    ``before`` is the sample's latest trial. If it was neither run nor edited and its files are the same, it is written
    again with the new settings and keeps its revision. Raises InputError if a file has changed since it was read, or if
    another sample has the folder's name.
    """
    lab, text = catalogue.lab, trial_text(trial)
    name, revision, answered = folder_of(sample.name), 1, False
    if before is not None:
        latest = lab / before.folder
        answered = before.files == tuple(sample.raw) and _is_whole(lab, before)
        answered = answered and files.sha256(latest / TRIAL) == before.trial_sha256
        answered = answered and not (latest / RUN / "profile.csv").exists()
        # The number of a later revision follows an @, which no sample's name contains.
        revision = before.revision + (not answered)
        name = before.folder if answered else f"{before.folder.partition('@')[0]}@{revision}"
    if (lab / name).exists() and not answered:
        raise InputError(
            f"{sample.files['photo'][0]}: the folder {lab / name} exists already; give this sample another name "
            "in the pairing file."
        )
    settings = {key: entry.value for key, entry in sample.note.entries.items()}
    record = Record(
        sample=sample.key,
        name=sample.name,
        revision=revision,
        folder=name,
        source=ingested.source,
        content=sample.content,
        files=tuple(sample.raw),
        dialect=sample.dialect,
        date=settings.get("date"),
        operator=settings.get("operator"),
        said=json.loads(json.dumps(settings, default=str)),
        remarks=tuple(sample.remarks),
        ingested_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        trial_sha256=hashlib.sha256(text.encode()).hexdigest(),
    )
    folder = lab / name if answered else lab / INCOMING
    if answered:
        files.write_text(folder / TRIAL, text)
    else:
        shutil.rmtree(folder, ignore_errors=True)
        write_trial(sample, trial, folder)
    files.write_json(folder / RECORD, asdict(record))
    if not answered:
        with naming(lab / name):
            folder.rename(lab / name)
    sample.record = record


def write_trial(sample: LabSample, trial: Trial, folder: Path) -> None:
    """Write copies of a sample's files, and its trial.toml, into ``folder``.

    Raises InputError if a file has changed since it was hashed.
    """
    (folder / INPUTS).mkdir(parents=True)
    for raw in sample.raw:
        path = sample.folder / raw.original
        content = read_bytes(path)
        if hashlib.sha256(content).hexdigest() != raw.sha256:
            raise InputError(f"{path}: the file changed during the ingest. Repeat the command.")
        files.write_bytes(folder / raw.kept_as, content)
    files.write_text(folder / TRIAL, trial_text(trial))
