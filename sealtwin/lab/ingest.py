"""Ingest a lab's folder: make a trial of each sample, keep a catalogue, trace the trials, and report all faults."""

import hashlib
import os
import shutil
import traceback
from collections import defaultdict
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path, PurePath

from sealtwin.core import files
from sealtwin.core.doubts import Doubt, Location
from sealtwin.core.errors import InputError, as_text, naming, present
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, open_folder, refuse_foreign
from sealtwin.lab.catalogue import CATALOGUE, RECORD, RUN, TABLE, Catalogue, Record, write_table
from sealtwin.lab.files import PAIRING, TRIAL, CatalogueFault, Placed, find_files, pairing_text, read_decisions
from sealtwin.lab.sample import Fate, LabSample, gather, pair, prepare, read_sheets
from sealtwin.lab.sample_settings import DATE, DEPTH, OPERATOR, SCALE, SampleSettings, is_setting, read_defaults
from sealtwin.lab.tracing import PlannedTrace, TracedRow, trace_all
from sealtwin.study.pipeline import check_run
from sealtwin.study.study_folder import PROFILE
from sealtwin.trial.job import start_job
from sealtwin.trial.trial_file import Trial, folder_name, load_trial, trial_text
from validate.units import counted

INCOMING = f".incoming.{files.TEMPORARY_MARK}"  # Temporary folder in which a new trial is written
OWNED = {PAIRING, TABLE}  # Files at the top of a lab whose catalogue may not have been written


@dataclass
class Ingested:
    lab: Path
    source: str  # Name of the lab's folder in the catalogue
    dry_run: bool
    samples: list[LabSample]  # Samples, followed by files that belong to no photo
    unused: list[CatalogueFault]  # Files that are not used
    lost: list[CatalogueFault]  # Files that cannot be read, but may contain data of the lab
    placed: Placed
    decisions: Placed
    traced: list[TracedRow] = field(default_factory=list)  # Results of tracing

    @property
    def faults(self) -> list[CatalogueFault]:
        """Faults of samples, of files without a sample, and of lost files."""
        faults = [
            CatalogueFault(sample.name, sentence, question.is_fault)
            for sample in self.samples
            for sentence, question in sample.questions.items()
        ]
        return [*faults, *self.lost]


def ingest(folder: Path, lab: Path, progress: Progress, *, dry_run: bool = False, jobs: int = 0) -> Ingested:
    """Make a trial in ``lab`` for each sample in a folder of photos and sheets, and update the catalogue.

    An unchanged sample of the lab is skipped. The trial of a changed sample is written again. If that trial was run or
    edited, it is kept, and the new one gets a new revision. If the pairing file was edited, the user's corrections and
    answers are read from it, and the catalogue stores them for ``folder``. ``jobs`` processes trace and check the
    trials; with 0, this step is left out.

    Waits until other ingests into the same lab have ended. If the process is killed, repeat the call to complete the
    ingest. Raises InputError if the folder, its lab.toml or the pairing file cannot be used.
    """
    _require_usable(folder, lab)
    folder = folder.resolve()
    named, unused, lost = find_files(folder)
    defaults = read_defaults(folder)
    way = os.path.relpath(folder, lab.resolve())
    # The name does not contain the folder's path, so it does not change if folder and lab are moved together.
    source = f"{as_text(Path(folder.name))} ({hashlib.sha256(os.fsencode(way)).hexdigest()[:8]})"
    with nullcontext() if dry_run else holding(lab, progress.note):
        catalogue = Catalogue(lab)
        digest, earlier = _pairing_sha256(lab), catalogue.content.sources.get(source)
        is_edited = digest not in ("", catalogue.content.pairing)
        decisions = (
            read_decisions(lab / PAIRING, named, is_setting) if is_edited else earlier.decisions if earlier else {}
        )
        catalogue.content.pairing = digest
        placed = {file: decisions.get(file, [entry]) for file, entry in named.items()}
        samples = pair(folder, placed, [fault.name for fault in lost])
        ingested = Ingested(lab, source, dry_run, samples, unused, lost, placed, decisions)
        if not samples and not ingested.faults:
            raise InputError(f"{folder}: has no photos or sheets. Give the folder that contains them.")
        progress.start(f"Taking in {counted(len(samples), 'sample')}", len(samples))
        for done, sample in enumerate(samples, start=1):
            _take_in(ingested, catalogue, sample, defaults, progress)
            progress.advance(done, sample.name)
        if not dry_run:
            _save(ingested, catalogue)
        if jobs:
            _trace(ingested, progress, jobs)
            _save(ingested, catalogue)
        if not dry_run:
            write_table(lab)
    return ingested


def _require_usable(folder: Path, lab: Path) -> None:
    """Raise InputError if ``folder`` or ``lab`` is inside the other one, or if ``lab`` has files of other programs."""
    inner, outer = folder.resolve(), lab.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise InputError(
            f"{as_text(lab)}: --out must not be inside the lab's folder {as_text(folder)} and must not contain it, so "
            "that your files are not changed. Give another folder as --out."
        )
    if lab.is_dir() and not (lab / CATALOGUE).is_file():
        # Hidden files belong to the system, or to another process that has just started in this folder.
        shown = [path for path in lab.iterdir() if not (path.name in OWNED or path.name.startswith("."))]
        refuse_foreign(lab, "ingest", sorted(path.name for path in shown if not (path / RECORD).is_file()))


def _save(ingested: Ingested, catalogue: Catalogue) -> None:
    """Write the catalogue, and the pairing file with each question in the row of its file.

    If the user has edited the pairing file in the meantime, it is not changed. The next ingest reads it.
    """
    path = catalogue.lab / PAIRING
    if _pairing_sha256(catalogue.lab) == catalogue.content.pairing:
        questions = defaultdict[tuple[PurePath, str], list[str]](list)
        for sample in ingested.samples:
            for sentence, question in sample.questions.items():
                for file in question.rows:
                    questions[file, sample.key].append(sentence)
        asked = set[str]().union(*(sample.columns for sample in ingested.samples))
        files.write_text(path, pairing_text(ingested.placed, questions, asked))
        catalogue.content.pairing = files.sha256(path)
    catalogue.save(ingested.source, ingested.decisions, ingested.faults)


def _pairing_sha256(lab: Path) -> str:
    """Return the hash of the pairing file, or "" if there is none."""
    return files.sha256(lab / PAIRING) if (lab / PAIRING).is_file() else ""


def _take_in(
    ingested: Ingested, catalogue: Catalogue, sample: LabSample, defaults: SampleSettings, progress: Progress
) -> None:
    """Read the files of a sample and write its trial.

    Errors become questions about the sample, and the other samples are still read. An error of the disk with the lab is
    raised.
    """
    try:
        gather(sample, defaults)
        prepare(sample)
        if sample.trial is not None:
            keep(ingested, catalogue, sample, sample.trial)
    except InputError as fault:
        sample.refuse(fault)
    except OSError as fault:
        path = Path(fault.filename or "")
        if not path.is_relative_to(sample.folder):
            raise
        sample.fault(f"{fault.strerror}. Make it readable.", file=path.relative_to(sample.folder))
    except Exception as fault:
        # A bug in one sample must not stop the others. The command then ends with exit code 1.
        progress.note(traceback.format_exc())
        sample.fate, sample.questions = "bug", {}
        sample.fault(f"{type(fault).__name__}: {fault}. This is a bug; please report it.")


def keep(ingested: Ingested, catalogue: Catalogue, sample: LabSample, trial: Trial) -> None:
    """Write the trial of a sample, unless the lab already has it, and set the sample's record and fate.

    The trial replaces the sample's latest trial. If that trial was run or edited, it is kept, and the new one is
    written to another folder as a new revision. Raises InputError if another sample has the same name or folder, and
    the same errors as ``_write``.
    """
    lab, latest, name, revision = ingested.lab, catalogue.latest.get(sample.key), folder_name(sample.name), 1
    fate: Fate = "new"
    if latest is not None:
        # A sample with the same name from another folder is a different sample, unless its photo is the same.
        photos = {raw.sha256 for raw in (*sample.raw, *latest.files) if raw.role == "photo"}
        if len(photos) > 1 and latest.source != ingested.source:
            raise InputError(
                f"the lab already has a sample {latest.name} with another photo, from {latest.source}. Give this "
                "sample another name in the pairing file."
            )
        name, revision, home = latest.folder, latest.revision, lab / latest.folder
        written = {TRIAL: latest.trial_sha256} | {file.kept_as: file.sha256 for file in latest.files}
        present = {name: files.sha256(home / name) for name in written if (home / name).is_file()}
        is_same = (latest.said, latest.files) == (sample.said, tuple(sample.raw)) and (latest.sound or sample.questions)
        fate = "unchanged" if is_same and len(present) == len(written) else "revised"
        is_edited = not present.items() <= written.items()
        if is_edited or (home / RUN / PROFILE).exists():
            # The revision number follows an @. The names of samples never contain an @.
            revision += 1
            name = f"{name.partition('@')[0]}@{revision}"
    sample.record = latest
    if fate != "unchanged" and not ingested.dry_run:
        if name != (latest and latest.folder) and (lab / name).exists():
            raise InputError(
                f"the folder {lab / name} already exists. Give this sample another name in the pairing file."
            )
        sample.record = _write(ingested, sample, trial, name, revision)
    sample.fate = "failed" if sample.questions else fate


def _write(ingested: Ingested, sample: LabSample, trial: Trial, name: str, revision: int) -> Record:
    """Write a trial's folder with copies of the files, trial.toml and record.json. Returns the record.

    Raises InputError if a file has changed since it was read.
    """
    text, settings = trial_text(trial.content), sample.said
    home, incoming = ingested.lab / name, ingested.lab / INCOMING
    shutil.rmtree(incoming, ignore_errors=True)
    folder = home if home.is_dir() else incoming
    record = Record(
        name=sample.name,
        revision=revision,
        folder=name,
        source=ingested.source,
        files=tuple(sample.raw),
        dialect=sample.dialect,
        date=settings.get(DATE),
        operator=settings.get(OPERATOR),
        said=settings,
        remarks=tuple(sample.remarks),
        ingested_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        trial_sha256=hashlib.sha256(text.encode()).hexdigest(),
        sound=not sample.questions,
    )
    # If the process is killed, the trial is not sound. 'sealtwin lab' leaves it out; the next ingest completes it.
    files.write_json(folder / RECORD, asdict(replace(record, sound=False)))
    for raw in sample.raw:
        content = read_bytes(sample.folder / raw.original)
        if hashlib.sha256(content).hexdigest() != raw.sha256:
            raise InputError(f"{raw.original} changed during the ingest. Repeat the command.")
        files.write_if_new(folder / raw.kept_as, content)
    files.write_text(folder / TRIAL, text)
    files.write_json(folder / RECORD, asdict(record))
    with naming(home):
        folder.rename(home)
    return record


def _trace(ingested: Ingested, progress: Progress, jobs: int) -> None:
    """Trace each trial in its run folder, check it as its run would, and add questions about faults.

    Samples with questions are traced too, so that all questions are asked together. A fault in one sample does not stop
    the others. Also writes a page with all traced walls and the doubtful sheets to the top of the lab.
    """
    lab, traced, planned = ingested.lab, dict[str, LabSample](), list[PlannedTrace]()
    for sample in ingested.samples:
        if sample.record is not None:
            sample.trial_folder, run = lab / sample.record.folder, f"{sample.record.folder}/{RUN}"
            traced[run] = sample
            planned.append(PlannedTrace(sample.trial_folder / TRIAL, run, _omitted(sample)))
    sheets = {f"{sample.file('readings')}": sheet for sample in ingested.samples if (sheet := sample.sheet_in_question)}
    ingested.traced = trace_all(planned, lab, progress, jobs, sheets)
    progress.start(f"Checking {len(ingested.traced)} trials", len(ingested.traced))
    for number, row in enumerate(ingested.traced, start=1):
        sample = traced[row.folder]
        _check(sample, row)
        # Some remarks, as those on a scan, need the traced crack.
        record = replace(present(sample.record, "record"), remarks=tuple(sample.remarks))
        if record != sample.record:
            files.write_json(sample.trial_folder / RECORD, asdict(record))
        progress.advance(number, row.folder)


def _omitted(sample: LabSample) -> dict[str, None]:
    """Return the settings that must be removed from a trial before it is traced.

    These are readings that could not be read, and a fill if it is in question or depth and tilt are unknown.
    """
    omitted = {"readings", "gate"} if sample.dialect is None and "scan" not in sample.files else set[str]()
    is_open = sample.is_in_question("fill") or sample.stand_ins.keys() & {DEPTH, "crack.tilt"}
    return dict.fromkeys(omitted | {"crack.fill"} if is_open else omitted)


def _check(sample: LabSample, row: TracedRow) -> None:
    """Add questions about faults that prevent the run of a traced trial, and about doubtful readings."""
    if row.status == "asked":
        sample.ask(Doubt("crack", Location(sample.files["photo"][0]), row.reason, answers={"crack": None}))
        return
    if SCALE in sample.stand_ins:
        return  # Walls and lengths wait for the scale
    if row.sample is None:
        sample.fault(row.reason)
        return
    if sample.dialect is None:
        read_sheets(sample, row.sample.length_mm)
    if DEPTH not in sample.stand_ins:
        home = sample.trial_folder
        try:
            with open_folder(home / RUN, create=True) as opened:
                trial = load_trial(home / TRIAL, _omitted(sample))
                readings = check_run(start_job(trial, home, opened, "cpu", Progress()))
            if readings is not None:
                sample.ask(*readings.questions)
                sample.dialect = readings.dialect
        except InputError as fault:
            sample.refuse(fault)
