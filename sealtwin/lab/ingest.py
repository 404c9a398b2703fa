"""Ingest a lab's folder: make a trial of each sample without faults, keep a catalogue, and report all faults."""

import hashlib
import json
import os
import shutil
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path, PurePath

from sealtwin.core import files
from sealtwin.core.errors import InputError, as_text, naming
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, refuse_foreign, require_folder
from sealtwin.lab.catalogue import CATALOGUE, RECORD, RUN, Catalogue, CatalogueFault, Record, is_lab
from sealtwin.lab.file_owners import Decisions, place_files, with_owners
from sealtwin.lab.file_parts import Piece, beside_ranges, in_roles, with_parts
from sealtwin.lab.found_files import (
    DEFAULTS,
    NOT_READ,
    TABLES,
    TRIAL,
    FilePlace,
    LeftOut,
    find_files,
    read_name,
    read_names,
)
from sealtwin.lab.notes import Note, lines_of_readings, read_defaults
from sealtwin.lab.pairing import (
    PAIRING,
    SampleFiles,
    awaiting,
    decided,
    naming_others,
    pair,
    pairing_text,
    read_pairing,
)
from sealtwin.lab.sample_outcome import INPUTS, SampleOutcome
from sealtwin.lab.sample_trials import gather, look_at_sheets, prepare
from sealtwin.study.photos import OWN
from sealtwin.trial.trial_file import Trial, folder_name, trial_text
from validate.readings.header_words import sample_key

INCOMING = f".incoming.{files.TEMPORARY_MARK}"
"""Folder in which a trial is written first. Ingest deletes it, so its name must be one that no user gives a folder."""


@dataclass(frozen=True)
class Ingested:
    lab: Path
    source: str  # Name of the lab's folder in the catalogue
    dry_run: bool
    outcomes: tuple[SampleOutcome, ...]
    left_out: tuple[LeftOut, ...]
    faults: tuple[CatalogueFault, ...]  # Faults of samples, and of files without a sample
    placed: Mapping[Piece, FilePlace]


def ingest(
    folder: Path, lab: Path, progress: Progress, *, pairing: Path | None = None, dry_run: bool = False
) -> Ingested:
    """Take a folder of photos, sheets and notes into ``lab``: a trial for each sample, and a catalogue.

    A sample that the lab already has is skipped; a changed one becomes a new trial, and its old trial stays. Waits for
    another ingest into the same lab. If the process is killed, repeat the same call to complete the ingest. The user's
    corrections and replies come from ``pairing``, or from the lab's pairing file if it was edited. The catalogue stores
    them for ``folder``.

    Raises InputError if the folder, its lab.toml or the pairing cannot be used.
    """
    _refuse_nested(folder, lab)
    folder = folder.resolve()
    names, left_out = find_files(folder)
    defaults = read_defaults(folder / DEFAULTS)
    source = _name_of_source(folder, lab)
    by_name = read_names(names, folder.name)
    by_name |= _unread_sheets(folder, left_out, by_name)
    left_out = [each for each in left_out if PurePath(each.file) not in by_name]

    def pieces(by_user: Mapping[str, tuple[str, str]]) -> dict[Piece, FilePlace]:
        """Return the pieces by their names, with the user's role and sample of each photo."""
        places = {file.as_posix(): (place.role, place.sample) for file, place in by_name.items()}
        photos = [sample for role, sample in {**places, **by_user}.values() if role == "photo"]
        return in_roles(folder, with_owners(by_name, photos))

    def decisions_in(path: Path) -> Decisions:
        rows = read_pairing(path)
        reasons = {each.file: each.reason for each in left_out}
        return decided(rows, pieces({row.file: (row.role, row.sample) for row in rows}), reasons)

    given = None if pairing is None else decisions_in(pairing)
    with _catalogue(lab, progress, dry_run) as catalogue:
        if given is None and (lab / PAIRING).is_file() and files.sha256(lab / PAIRING) != catalogue.content.pairing:
            given = decisions_in(lab / PAIRING)
        decisions = catalogue.decisions(source) if given is None else given
        named = pieces({file.as_posix(): (place.role, place.sample) for (file, _), place in decisions.items()})
        placed = place_files(with_parts(folder, named, decisions), decisions)
        placed |= beside_ranges(folder, named, decisions)
        samples = naming_others(folder, pair(placed))
        texts = {text for sample in samples for text in sample.texts}
        for piece, place in placed.items():
            if place.role == "text" and piece.file not in texts:
                left_out.append(_text_alone(folder, piece.file))
        lost = [each for each in left_out if each.lost]
        for each in lost:
            samples = _awaiting_lost(samples, each, placed)
        if not samples and not lost:
            raise InputError(f"{folder}: it contains no photos, sheets or notes; give the folder that does.")
        progress.start(f"Taking in {len(samples)} samples", len(samples))
        intake, outcomes = SampleIntake(folder, source, defaults, catalogue, dry_run), list[SampleOutcome]()
        for done, sample in enumerate(samples, start=1):
            outcomes.append(intake.take_in(sample, progress))
            progress.advance(done, sample.name)
        faults = [CatalogueFault(outcome.sample.name, sentence) for outcome in outcomes for sentence in outcome.faults]
        faults += [CatalogueFault(each.file, each.sentence) for each in lost]
        ingested = Ingested(lab, source, dry_run, tuple(outcomes), tuple(left_out), tuple(faults), placed)
        if not dry_run:
            write_pairing(ingested, catalogue)
            catalogue.state(source, decisions, faults)
            catalogue.save()
    return ingested


def _awaiting_lost(samples: list[SampleFiles], lost: LeftOut, placed: Mapping[Piece, FilePlace]) -> list[SampleFiles]:
    """Return the samples; those without readings wait for a file that is not read if it may be their sheet."""
    file = PurePath(lost.file)
    place = placed.get(Piece(file)) or read_name(file)
    if place is None or not (lost.may_be_readings or place.role in TABLES or place.likely):
        return samples
    place = with_owners({file: replace(place, role="readings")}, [one.name for one in samples])[file]
    return awaiting(samples, place, lost.sentence)


def _unread_sheets(
    folder: Path, left_out: Sequence[LeftOut], by_name: Mapping[PurePath, FilePlace]
) -> dict[PurePath, FilePlace]:
    """Return files under other endings, as texts, that have lines of readings and the name of a photo's sample."""
    photos = [place.sample for place in by_name.values() if place.role == "photo"]
    named = dict[PurePath, FilePlace]()
    for file in (PurePath(each.file) for each in left_out if each.reason == NOT_READ):
        place = read_name(file.with_suffix(".txt"))
        if place is not None and not (folder / file).is_symlink():
            named[file] = replace(place, role="text")
    keys = set(map(sample_key, photos))
    return {
        file: place
        for file, place in with_owners(named, photos).items()
        if (place.likely or sample_key(place.sample) in keys) and lines_of_readings(folder / file)
    }


def _text_alone(folder: Path, file: PurePath) -> LeftOut:
    """Return a text whose name matches no sample as a file that is not used. It counts as lost if it has numbers."""
    is_link, note = (folder / file).is_symlink(), Note()
    lines, unread = (0, "") if is_link else (lines_of_readings(folder / file), note.read(folder / file))
    hint, remedy = ", ".join(filter(None, [*note.entries, *note.faults, unread])), ""
    if lines:
        remedy = (
            f", but {lines} of its lines may be readings. If they are, write its sample and the role readings into its "
            "row; if not, the role ignore"
        )
    elif hint:
        remedy = (
            f"; not read: {hint}. Write settings into the rows of its samples in {PAIRING}; then give this the role "
            "ignore"
        )
    return LeftOut(f"{file}", f"its name matches no sample{remedy}.", lost=bool(remedy), may_be_readings=lines > 0)


def write_pairing(ingested: Ingested, catalogue: Catalogue) -> None:
    """Write the pairing file, with each question in the row of the file that it is about.

    The pairing file then counts as not edited by the user.
    """
    about = {
        Piece(file, outcome.sample.part if file == outcome.sample.files.get("readings") else None): " ".join(questions)
        for outcome in ingested.outcomes
        for file, questions in outcome.asked.items()
    }
    about |= {
        piece: " ".join(questions) for outcome in ingested.outcomes for piece, questions in outcome.of_sheets.items()
    }
    about |= {
        piece: each.sentence
        for each in ingested.left_out
        if each.lost and (piece := Piece(PurePath(each.file))) in ingested.placed
    }
    samples = [outcome.sample for outcome in ingested.outcomes]
    files.write_text(catalogue.lab / PAIRING, pairing_text(ingested.placed, samples, about))
    catalogue.content.pairing = files.sha256(catalogue.lab / PAIRING)


def _name_of_source(folder: Path, lab: Path) -> str:
    """Return a name of a lab's folder without its path; it does not change if folder and lab are moved together."""
    way = os.path.relpath(folder, lab.resolve())
    return f"{as_text(Path(folder.name))} ({hashlib.sha256(os.fsencode(way)).hexdigest()[:8]})"


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


@dataclass(frozen=True)
class SampleIntake:
    """Takes samples of a lab's folder into the catalogue, one at a time."""

    folder: Path
    source: str  # Name of the folder in the catalogue
    defaults: Note  # Content of its lab.toml
    catalogue: Catalogue
    dry_run: bool

    def take_in(self, sample: SampleFiles, progress: Progress) -> SampleOutcome:
        """Take in a sample. Its faults do not stop other samples; a failure of the lab's own disk is raised."""
        outcome = SampleOutcome(sample)
        try:
            outcome = gather(self.folder, sample, self.defaults)
            look_at_sheets(self.folder, outcome, self.defaults)
            self._decide(outcome)
        except InputError as fault:
            outcome.faults += str(fault).splitlines()
        except OSError as fault:
            if fault.filename is None or Path(fault.filename).is_relative_to(self.catalogue.lab):
                raise
            outcome.faults.append(f"{fault.filename}: {fault.strerror}. Make it readable.")
        except Exception as fault:
            # A bug in one sample must not stop the others; the command ends with code 1.
            progress.note(traceback.format_exc())
            last = traceback.extract_tb(fault.__traceback__)[-1]
            place = f"{Path(last.filename).name}, line {last.lineno}"
            report = f"{sample.name}: {type(fault).__name__} in {place}: {fault}. A bug: please report it."
            outcome.fate, outcome.faults = "bug", [report]
        # Messages name files relative to the lab's folder, which is absolute here.
        outcome.faults = [fault.replace(f"{self.folder}/", "") for fault in outcome.faults]
        outcome.remarks = [remark.replace(f"{self.folder}/", "") for remark in outcome.remarks]
        for piece, faults in outcome.of_sheets.items():
            outcome.of_sheets[piece] = [fault.replace(f"{self.folder}/", "") for fault in faults]
        if outcome.fate != "bug" and not sample.questions:
            outcome.ask(outcome.faults)
        return outcome

    def _decide(self, outcome: SampleOutcome) -> None:
        """Set the fate of the sample, or its faults. Raises InputError for a fault that stops it."""
        sample, lab = outcome.sample, self.catalogue.lab
        before = None if sample.questions else next(reversed(self.catalogue.of_sample(sample.key)), None)
        if before is not None and not outcome.faults:
            if before.content == outcome.content and _is_whole(lab / before.folder, before):
                outcome.fate, outcome.trial, outcome.revision = "unchanged", before.folder, before.revision
                outcome.remarks, outcome.dialect = list(before.remarks), before.dialect
                return
            # A sample of the same name from another folder is another sample, unless its photo is the same.
            photo = before.file("photo")
            same_photo = photo is not None and outcome.hashes.get("photo") == photo.sha256
            if not same_photo and before.source not in (self.source, as_text(self.folder)):
                raise InputError(
                    f"{sample.files['photo']}: a sample {before.name} with another photo came from {before.source}; "
                    "give this one another name in the pairing file."
                )
        if not sample.questions:
            prepare(self.folder, outcome)
        if outcome.faults or outcome.settings is None:
            return
        if not self.dry_run:
            record = self.keep(outcome, outcome.settings, before)
            others = [one for one in self.catalogue.records if one.folder != record.folder]
            self.catalogue.records = [*others, record]
            outcome.trial, outcome.revision = record.folder, record.revision
        outcome.fate = "new" if before is None else "revised"

    def keep(self, outcome: SampleOutcome, trial: Trial, before: Record | None) -> Record:
        """Write a trial's folder: unchanged copies of its files, trial.toml, record.json.

        ``before`` is the sample's latest trial. If it was neither run nor edited and its files are the same, it is
        written again with the new settings and keeps its revision. Raises InputError if a file has changed since it was
        read, or if another sample has the folder's name.
        """
        lab, sample, text = self.catalogue.lab, outcome.sample, trial_text(trial)
        settings = {key: entry.value for key, entry in outcome.note.entries.items()}
        name, revision, answered = folder_name(sample.name), 1, False
        if before is not None:
            answered = before.files == tuple(outcome.raw) and _is_as_written(lab / before.folder, before)
            # The number of a later revision follows an @, which no sample's name contains.
            later = f"{before.folder.partition('@')[0]}@{before.revision + 1}"
            name, revision = (before.folder, before.revision) if answered else (later, before.revision + 1)
        if (lab / name).exists() and not answered:
            raise InputError(
                f"{sample.files['photo']}: the folder {lab / name} exists already; give this sample another name "
                "in the pairing file."
            )
        record = Record(
            sample=sample.key,
            name=sample.name,
            revision=revision,
            folder=name,
            source=self.source,
            content=outcome.content,
            files=tuple(outcome.raw),
            dialect=outcome.dialect,
            date=settings.get("date"),
            operator=settings.get("operator"),
            said=json.loads(json.dumps(settings, default=str)),
            remarks=tuple(outcome.remarks),
            ingested_utc=datetime.now(UTC).isoformat(timespec="seconds"),
            sealtwin=version("sealtwin"),
            trial_sha256=hashlib.sha256(text.encode()).hexdigest(),
        )
        if answered:
            files.write_text(lab / name / TRIAL, text)
            files.write_json(lab / name / RECORD, asdict(record))
            return record
        incoming = lab / INCOMING
        shutil.rmtree(incoming, ignore_errors=True)
        write_trial(outcome, trial, self.folder, incoming)
        files.write_json(incoming / RECORD, asdict(record))
        with naming(lab / name):
            incoming.rename(lab / name)
        return record


def _is_whole(folder: Path, record: Record) -> bool:
    return all((folder / name).is_file() for name in (TRIAL, *(file.kept_as for file in record.files)))


def _is_as_written(folder: Path, record: Record) -> bool:
    """Return True if a trial was neither edited nor run, and has all its files."""
    is_run = (folder / RUN / "profile.csv").exists()
    return _is_whole(folder, record) and not is_run and files.sha256(folder / TRIAL) == record.trial_sha256


def write_trial(outcome: SampleOutcome, trial: Trial, source: Path, folder: Path) -> None:
    """Write copies of a sample's files, and its trial.toml, into ``folder``.

    Raises InputError if a file has changed since it was hashed.
    """
    (folder / INPUTS).mkdir(parents=True)
    for raw in outcome.raw:
        path = source / raw.original
        content = read_bytes(path)
        if hashlib.sha256(content).hexdigest() != raw.sha256:
            raise InputError(f"{path}: the file changed during the ingest. Repeat the command.")
        files.write_bytes(folder / raw.kept_as, content)
    files.write_text(folder / TRIAL, trial_text(trial))
