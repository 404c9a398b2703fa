"""Ingest a lab's folder: make a trial of each sample, keep a catalogue, trace the trials, and report all faults."""

import hashlib
import os
import traceback
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from digitise.settings import CHOICE
from sealtwin.core import files
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError, as_text
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import foreign_names, holding, open_folder, refuse_foreign, require_folder
from sealtwin.lab.catalogue import CATALOGUE, RECORD, RUN, Catalogue, CatalogueFault, Record
from sealtwin.lab.files import DEFAULTS, TABLE_SUFFIXES, TRIAL, LeftOut, Placed, find_files, folder_of
from sealtwin.lab.notes import DATE, DEPTH, OPERATOR, SCALE, Note, read_defaults, read_settings_table
from sealtwin.lab.pairing import pair, pairing_text, read_decisions
from sealtwin.lab.sample import PAIRING, LabSample, gather, prepare
from sealtwin.study.photos import OWN, Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.study.study_folder import PROFILE
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run
from sealtwin.trial.trial_file import Trial, trial_text
from validate.readings.grid import listed

OWNED = {PAIRING, *OWN}  # Files that an ingest writes at the top of a lab


@dataclass
class Ingested:
    lab: Path
    source: str  # Name of the lab's folder in the catalogue
    dry_run: bool
    samples: list[LabSample]  # And files that belong to no photo
    left_out: list[LeftOut]
    placed: Placed
    decisions: Placed
    traced: Batch | None = None  # None if nothing was to be traced

    @property
    def faults(self) -> list[CatalogueFault]:
        """Faults of samples, of files without a sample, and of files that are lost."""
        faults = [(sample.name, question) for sample in self.samples for question in sample.questions]
        faults += [(each.file, f"{each.file}: {each.reason}") for each in self.left_out if each.lost]
        return [CatalogueFault(*fault) for fault in faults]


def ingest(
    folder: Path, lab: Path, progress: Progress, *, pairing: Path | None = None, dry_run: bool = False, jobs: int = 0
) -> Ingested:
    """Take a folder of photos, sheets and notes into ``lab``: a trial for each sample, and a catalogue.

    A sample that the lab already has is skipped; the trial of a changed one is written again, or stays beside a new
    revision if it was run or edited. Waits for another ingest into the same lab. If the process is killed, repeat the
    same call to complete the ingest. The user's corrections and answers come from ``pairing``, or from the lab's
    pairing file if it was edited. The catalogue stores them for ``folder``. The trials are traced and checked by
    ``jobs`` processes; 0 leaves that out.

    Raises InputError if the folder, its lab.toml, a table of settings or the pairing cannot be used.
    """
    _require_usable(folder, lab)
    folder = folder.resolve()
    named, left_out = find_files(folder)
    defaults = read_defaults(folder / DEFAULTS)
    way = os.path.relpath(folder, lab.resolve())
    # Without the path of the folder; it does not change if folder and lab are moved together.
    source = f"{as_text(Path(folder.name))} ({hashlib.sha256(os.fsencode(way)).hexdigest()[:8]})"
    decisions = None if pairing is None else read_decisions(pairing, named)
    with nullcontext() if dry_run else holding(lab, progress.note):
        catalogue = Catalogue(lab)
        digest, known = _pairing_sha256(lab), catalogue.content.sources.get(source)
        if decisions is None and digest not in ("", catalogue.content.pairing):
            decisions = read_decisions(lab / PAIRING, named)
        elif decisions is None:
            decisions = known.decisions if known else {}
        catalogue.content.pairing = digest
        placed = {file: decisions.get(file, [place]) for file, place in named.items()}
        samples, of_tables = _paired(folder, placed, left_out)
        ingested = Ingested(lab, source, dry_run, samples, left_out, placed, decisions)
        if not samples and not ingested.faults:
            raise InputError(f"{folder}: it contains no photos, sheets or notes; give the folder that does.")
        progress.start(f"Taking in {len(samples)} samples", len(samples))
        for done, sample in enumerate(samples, start=1):
            _take_in(ingested, catalogue, sample, defaults, of_tables.get(sample.key, Note()), progress)
            progress.advance(done, sample.name)
        if not dry_run:
            _save(ingested, catalogue)
        if jobs:
            _trace(ingested, progress, jobs)
            _save(ingested, catalogue)
    return ingested


def _require_usable(folder: Path, lab: Path) -> None:
    """Raise InputError if ``lab`` is not outside the lab's folder, or has files that no ingest wrote."""
    inner, outer = folder.resolve(), lab.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise InputError(
            f"{as_text(lab)}: --out must be neither inside nor around the lab's folder {as_text(folder)}, so that the "
            "lab's own files stay untouched; give --out another folder."
        )
    require_folder(lab)
    if lab.is_dir() and not (lab / CATALOGUE).is_file():
        foreign = [
            path.name for path in lab.iterdir() if path.name not in {PAIRING, *OWN} and not (path / RECORD).is_file()
        ]
        # Hidden files are the system's, or those of another process that has just begun here.
        refuse_foreign(lab, "ingest", sorted(name for name in foreign if not name.startswith(".")))


def _paired(folder: Path, placed: Placed, left_out: list[LeftOut]) -> tuple[list[LabSample], Mapping[str, Note]]:
    """Return the samples, the files without a photo, and the settings in tables by sample."""
    photos = {place.key for places in placed.values() for place in places if place.role == "photo"}
    lost = [each.file for each in left_out if each.lost]
    rest, of_tables = dict(placed), dict[str, Note]()
    for file, (first, *_) in placed.items():
        is_candidate = first.role in ("readings", "note") and file.suffix.lower() in TABLE_SUFFIXES
        if not is_candidate or first.key in photos or not (keys := read_settings_table(folder / file, of_tables)):
            continue
        del rest[file]
        placed[file] = [replace(first, role="note")]
        if lacking := listed(sorted(keys - photos)):
            reason = f"has rows of {lacking}, but no such photos; add them, or set its role to ignore."
            left_out.append(LeftOut(f"{file}", reason, lost=True))
    return pair(folder, rest, lost), of_tables


def _save(ingested: Ingested, catalogue: Catalogue) -> None:
    """Write the catalogue, and the pairing file with each question in the row of the file that it is about.

    A pairing file that the user has edited since it was read or written is left as it is; the next ingest reads it.
    """
    path = catalogue.lab / PAIRING
    if _pairing_sha256(catalogue.lab) == catalogue.content.pairing:
        files.write_text(path, pairing_text(ingested.placed, ingested.samples))
        catalogue.content.pairing = files.sha256(path)
    catalogue.save(ingested.source, ingested.decisions, ingested.faults)


def _pairing_sha256(lab: Path) -> str:
    """Return the hash of the pairing file, or "" without one."""
    return files.sha256(lab / PAIRING) if (lab / PAIRING).is_file() else ""


def _take_in(
    ingested: Ingested, catalogue: Catalogue, sample: LabSample, defaults: Note, own: Note, progress: Progress
) -> None:
    """Read the files of a sample and write its trial, unless the lab has it already. Without questions it has a fate.

    Its errors become its questions and stop no other sample; a failure of the lab's own disk is raised.
    """
    lab, latest = catalogue.lab, catalogue.latest.get(sample.key)
    try:
        gather(sample, defaults, own)
        prepare(sample)
        if sample.trial is not None:
            if latest is not None:
                _require_same_sample(sample, latest, ingested.source)
            is_same = latest is not None and _is_up_to_date(lab, latest, sample)
            sample.record = latest
            if not (is_same or ingested.dry_run):
                sample.record = keep(ingested, sample, sample.trial, latest)
            if not sample.questions:
                sample.fate = "unchanged" if is_same else "new" if latest is None else "revised"
    except InputError as fault:
        sample.refuse(fault)
    except OSError as fault:
        if fault.filename is None or Path(fault.filename).is_relative_to(lab):
            raise
        sample.ask(f"{fault.filename}: {fault.strerror}. Make it readable.")
    except Exception as fault:
        # A bug in one sample must not stop the others; the command ends with code 1.
        progress.note(traceback.format_exc())
        sample.fate, sample.questions = "bug", {}
        sample.ask(f"{sample.name}: {type(fault).__name__}: {fault}. A bug: please report it.")


def _require_same_sample(sample: LabSample, latest: Record, source: str) -> None:
    """Raise InputError if the trial with the sample's name has another photo and came from another folder."""
    photos = {raw.sha256 for raw in (*sample.raw, *latest.files) if raw.role == "photo"}
    if len(photos) > 1 and latest.source != source:
        raise InputError(
            f"{sample.files['photo'][0]}: a sample {latest.name} with another photo came from {latest.source}; "
            "give this one another name in the pairing file."
        )


def _is_up_to_date(lab: Path, latest: Record, sample: LabSample) -> bool:
    """Return whether a trial has all its files, is made of the sample's files and settings, and is sound if it can."""
    is_same = (latest.said, latest.files) == (sample.said, tuple(sample.raw))
    return is_same and (latest.sound or bool(sample.questions)) and all(path.is_file() for path in _hashes(lab, latest))


def _hashes(lab: Path, record: Record) -> dict[Path, str]:
    """Return the hashes of a trial's files as they were written."""
    files_of = {TRIAL: record.trial_sha256} | {file.kept_as: file.sha256 for file in record.files}
    return {lab / record.folder / name: digest for name, digest in files_of.items()}


def keep(ingested: Ingested, sample: LabSample, trial: Trial, latest: Record | None) -> Record:
    """Write a trial, copies of its files, trial.toml and record.json, and return its record.

    The ``latest`` trial of the sample is written again, unless it was run or edited: then it stays, and the sample gets
    a new revision in another folder. Raises InputError if a file has changed since it was read, or if the folder has
    other files.
    """
    lab, text, said = ingested.lab, trial_text(trial), sample.said
    name, revision = folder_of(sample.name), 1
    if latest is not None:
        name, revision = latest.folder, latest.revision
        hashes = _hashes(lab, latest).items()
        is_edited = any(path.is_file() and files.sha256(path) != sha256 for path, sha256 in hashes)
        if is_edited or (lab / name / RUN / PROFILE).exists():
            # The number of a later revision follows an @, which no sample's name contains.
            revision += 1
            name = f"{name.partition('@')[0]}@{revision}"
    folder = lab / name
    if (latest is None or revision > latest.revision) and folder.is_dir() and foreign_names(folder):
        raise InputError(
            f"{sample.files['photo'][0]}: the folder {folder} exists already; give this sample another name in the "
            "pairing file."
        )
    record = Record(
        name=sample.name,
        revision=revision,
        folder=name,
        source=ingested.source,
        files=tuple(sample.raw),
        dialect=sample.dialect,
        date=said.get(DATE),
        operator=said.get(OPERATOR),
        said=said,
        remarks=tuple(sample.remarks),
        ingested_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        trial_sha256=hashlib.sha256(text.encode()).hexdigest(),
        sound=not sample.questions,
    )
    # If the process is killed, the trial is not complete: 'lab run' leaves it out, and the next ingest completes it.
    files.write_json(folder / RECORD, asdict(replace(record, sound=False)))
    for raw in sample.raw:
        content = read_bytes(sample.folder / raw.original)
        if hashlib.sha256(content).hexdigest() != raw.sha256:
            raise InputError(f"{raw.original}: the file changed during the ingest. Repeat the command.")
        files.write_if_new(folder / raw.kept_as, content)
    files.write_text(folder / TRIAL, text)
    files.write_json(folder / RECORD, asdict(record))
    return record


def _trace(ingested: Ingested, progress: Progress, jobs: int) -> None:
    """Trace each trial with a scale in the folder of its run, check it as its run would, and ask about the faults.

    A page with all walls, and with the sheets in question, is written at the top of the lab. Samples with questions are
    traced too, so that all questions are asked together. A fault in one sample does not stop the others. Raises
    InputError if the lab has another program's contact sheet.
    """
    lab, traced = ingested.lab, dict[str, tuple[LabSample, PlannedPhoto]]()
    for sample in ingested.samples:
        if sample.record is not None and SCALE not in sample.stand_ins:
            sample.trial_folder = lab / sample.record.folder
            # Without readings that cannot be read, and without a fill in walls that nobody has described.
            changed: dict[str, Any] = {"readings": None, "gate": None} if sample.dialect is None else {}
            if sample.stand_ins.keys() & {DEPTH, "crack.tilt"}:
                changed["crack.fill"] = None
            run = f"{sample.record.folder}/{RUN}"
            traced[run] = sample, PlannedPhoto(sample.trial_folder / TRIAL, run, changed)
    sheets = {f"{each.file('readings')}": sheet for each in ingested.samples if (sheet := each.sheet_in_question)}
    planned = [photo for _, photo in traced.values()]
    batch = ingested.traced = digitise_many(planned, lab, _Steps(progress), jobs, locked=True, sheets=sheets)
    progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
    for number, row in enumerate(batch.rows, start=1):
        _check(*traced[row.folder], row)
        progress.advance(number, row.folder)


def _check(sample: LabSample, photo: PlannedPhoto, row: BatchRow) -> None:
    """Ask about the faults that prevent the run of the traced trial, and doubts about its readings."""
    if row.status != "ok":
        where, _, finding = row.reason.partition(": ")
        answers = {"crack": 2} if CHOICE in finding else {}
        sample.ask(Doubt("photo", where, finding.replace(CHOICE, "a 2 in the column crack"), answers=answers))
    elif DEPTH not in sample.stand_ins:
        try:
            with open_folder(sample.trial_folder / RUN, create=True) as opened:
                readings = check_run(start_job(photo.trial(), sample.trial_folder, opened, "cpu", Progress()))
            sample.ask(*(() if readings is None else readings.questions))
        except InputError as fault:
            sample.refuse(fault)


class _Steps(Progress):
    """Progress without notes: what they say of faults is in the answer, in the names of the lab's own files."""

    def __init__(self, shown: Progress) -> None:
        self.start, self.advance, self.close = shown.start, shown.advance, shown.close
