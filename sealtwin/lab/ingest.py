"""A lab's folder into trials and a catalogue: what is sound is taken in, what is not is named, nothing is guessed."""

import hashlib
import json
import os
import re
import shutil
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path, PurePath

from sealtwin.core import files
from sealtwin.core.errors import InputError, as_text, naming
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, refuse_foreign, require_folder
from sealtwin.lab.catalogue import CATALOGUE, RECORD, Catalogue, CatalogueFault, Record, read_record, remark_twins
from sealtwin.lab.found_files import DEFAULTS, TRIAL, LeftOut, Piece, Said, divide, find_files, read_names
from sealtwin.lab.notes import Note, read_note
from sealtwin.lab.pairing import (
    PAIRING,
    Answers,
    Decisions,
    PairingRow,
    SampleFiles,
    answers_of,
    decided,
    files_by_cell,
    hold_back,
    pair,
    pairing_text,
    place_files,
    read_pairing,
)
from sealtwin.lab.sample_trials import INPUTS, SampleOutcome, gather, prepare
from sealtwin.photos.batch import OWN
from sealtwin.trial.trial_file import folder_name, trial_text
from validate.readings.samples import sample_key

INCOMING = f".incoming.{files.TEMPORARY_MARK}"
"""The folder in which a trial is written. It is removed, so its name is none that a user gives."""
DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Windows opens a device of that name, and no folder."""
WRITTEN_PAIRINGS = "pairing_sha256"
"""Fact of the catalogue: hashes of the pairing file as it was written last. Another one has been edited since."""
OF_ONE = ("name", "date", "photo.file", "photo.mask", "photo.second_photo", "readings.file", "readings.as_written")
"""Keys that cannot hold for all samples of a folder."""


@dataclass(frozen=True)
class Ingested:
    """Result of the ingest of a lab's folder."""

    lab: Path
    dry_run: bool
    outcomes: tuple[SampleOutcome, ...]
    left_out: tuple[LeftOut, ...]
    faults: tuple[CatalogueFault, ...]  # Faults of samples, and of files that belong to none


def ingest(
    folder: Path, lab: Path, progress: Progress, *, pairing: Path | None = None, dry_run: bool = False
) -> Ingested:
    """Take a folder of photos, sheets and notes into ``lab``: a trial's folder for each sample, and a catalogue.

    What is there already is not taken in again; a sample that has changed becomes another trial beside its old one.
    Another ingest into the same lab is waited for. Killed at any moment, the same call completes what was begun.
    The lab's pairing file, where it was edited, or ``pairing`` in its place, holds the user's corrections and answers,
    which are remembered for ``folder``.

    Raises InputError if the folder, its lab.toml or the pairing cannot be used at all.
    """
    _refuse_nested(folder, lab)
    folder = folder.resolve()
    found, left_out = find_files(folder)
    defaults = _defaults(folder)
    source = _name_of_source(folder, lab)
    by_name = read_names(found, folder.name)

    def said_in(path: Path) -> tuple[Decisions, Answers]:
        rows = read_pairing(path)
        named = divide(folder, by_name, _photographed([*by_name.values(), *rows]))
        return decided(rows, named), answers_of(rows, files_by_cell(found))

    given = None if pairing is None else said_in(pairing)
    with _catalogue(lab, progress, dry_run) as catalogue:
        if not dry_run:
            catalogue.rename_source(as_text(folder), source)
        if given is None and _is_edited(lab / PAIRING, catalogue):
            given = said_in(lab / PAIRING)
        decisions, answers = given or (catalogue.decisions(source), catalogue.answers(source))
        by_user = {file: said for (file, _), said in decisions.items()}
        named = divide(folder, by_name, _photographed({**by_name, **by_user}.values()))
        placed = place_files(named, decisions)
        samples, of_none = hold_back(pair(placed), left_out, folder.name)
        if not samples and not any(left.lost for left in left_out):
            raise InputError(f"{folder}: no photos, sheets or notes in it.")
        if not dry_run:
            catalogue.state_decisions(source, decisions, answers)
        progress.start(f"Taking in {len(samples)} samples", len(samples))
        outcomes = []
        for done, sample in enumerate(samples, start=1):
            sheet = sample.files.get("readings", PurePath()).as_posix(), str(sample.part or "")
            outcomes.append(
                take_in(sample, folder, defaults, answers.get(sheet, {}), lab, catalogue, progress, dry_run)
            )
            progress.advance(done, sample.name)
        faults = [CatalogueFault(outcome.sample.name, sentence) for outcome in outcomes for sentence in outcome.faults]
        faults += [CatalogueFault(left.file, left.sentence) for left in of_none if left.lost]
        remark_twins([outcome for outcome in outcomes if not outcome.faults], catalogue)
        if not dry_run:
            catalogue.state_faults(source, faults)
            about = {
                Piece(file, outcome.sample.part if file == outcome.sample.files.get("readings") else None): question
                for outcome in outcomes
                for file, question in outcome.asked.items()
            }
            _write_pairing(lab, pairing_text(placed, samples, answers, about), catalogue)
    return Ingested(lab, dry_run, tuple(outcomes), tuple(left_out), tuple(faults))


def _name_of_source(folder: Path, lab: Path) -> str:
    """Name a lab's folder without its path, which would tell of homes; it lasts if both are moved together."""
    way = os.path.relpath(folder, lab.resolve())
    return f"{as_text(Path(folder.name))} ({hashlib.sha256(os.fsencode(way)).hexdigest()[:8]})"


@contextmanager
def _catalogue(lab: Path, progress: Progress, dry_run: bool) -> Iterator[Catalogue]:
    """Open the lab's catalogue, held against other processes and made whole; only looked at in a dry run."""
    require_folder(lab)
    _require_lab(lab)
    if dry_run:
        with Catalogue.of(lab, or_empty=True) as catalogue:
            yield catalogue
        return
    with holding(lab, progress.note), Catalogue(lab / CATALOGUE, create=True) as catalogue:
        if completed := _complete(lab, catalogue):
            progress.note(f"{lab}: {completed} trials that were in no catalogue are in it now.")
        yield catalogue


def _require_lab(lab: Path) -> None:
    """Raise InputError where ``lab`` holds what no ingest wrote: it must not be mixed up with it."""
    if not lab.is_dir() or (lab / CATALOGUE).is_file():
        return
    # Another process may be at its very first steps here; what is hidden is its, or the system's.
    own = {PAIRING, CATALOGUE, f"{CATALOGUE}-journal", *OWN}
    shown = [entry for entry in lab.iterdir() if not entry.name.startswith(".") and entry.name not in own]
    refuse_foreign(lab, "ingest", sorted(entry.name for entry in shown if not (entry / RECORD).is_file()))


def _complete(lab: Path, catalogue: Catalogue) -> int:
    """Take up trials whose row was not written: their process was killed, or the catalogue is new. Returns how many.

    Whoever calls holds the lab, so that no other process is between the two.
    """
    shutil.rmtree(lab / INCOMING, ignore_errors=True)
    known = {record.folder for record in catalogue.records()}
    records = []
    for path in lab.glob(f"*/{RECORD}"):
        if path.parent.name not in known:
            content = files.read_json(path)
            with files.understood(path):
                records.append(replace(read_record(content), folder=path.parent.name))
    for record in sorted(records, key=lambda record: (record.sample, record.revision)):
        catalogue.add(record)
    return len(records)


def _is_edited(path: Path, catalogue: Catalogue) -> bool:
    """Return whether a lab's pairing is not as it was written; with a new catalogue it counts as edited."""
    return path.is_file() and files.sha256(path) not in (catalogue.fact(WRITTEN_PAIRINGS) or "").split()


def _write_pairing(lab: Path, text: str, catalogue: Catalogue) -> None:
    path = lab / PAIRING
    now = files.sha256(path) if path.is_file() else ""
    # Both, since a kill may come before the file is written.
    catalogue.state_fact(WRITTEN_PAIRINGS, f"{now} {hashlib.sha256(text.encode()).hexdigest()}")
    files.write_text(path, text)


def _defaults(folder: Path) -> Note:
    """Read lab.toml, if there is one. Raises InputError with all its faults, since one would fail every sample."""
    path = folder / DEFAULTS
    if path.is_symlink() or not path.is_file():
        return Note()
    note = read_note(path)
    faults = [f"{path}: {key} is of one sample; put it into its note." for key in OF_ONE if key in note.entries]
    if faults := [*note.faults, *faults]:
        raise InputError("\n".join(faults))
    return note


def _photographed(said: Iterable[Said | PairingRow]) -> set[str]:
    """Return the keys of the samples that have a photo."""
    return {sample_key(each.sample) for each in said if each.role == "photo"}


def _refuse_nested(folder: Path, lab: Path) -> None:
    inner, outer = folder.resolve(), lab.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise InputError(
            f"{as_text(lab)}: --out and the lab's folder {as_text(folder)} lie one within the other; nothing is "
            "written among a lab's own files: give --out another folder."
        )


def take_in(
    sample: SampleFiles,
    folder: Path,
    defaults: Note,
    answers: Mapping[str, str],
    lab: Path,
    catalogue: Catalogue,
    progress: Progress,
    dry_run: bool,
) -> SampleOutcome:
    """Take in a sample. Whatever is wrong with it is its own fault, but for a fault of the disk of the lab."""
    outcome = SampleOutcome(sample)
    try:
        outcome = gather(folder, sample, defaults, answers)
        _take_in(outcome, folder, lab, catalogue, dry_run)
    except InputError as fault:
        outcome.faults += str(fault).splitlines()
    except OSError as fault:
        if fault.filename is None or Path(fault.filename).is_relative_to(lab):
            raise
        outcome.faults.append(f"{fault.filename}: {fault.strerror}. Make it readable.")
    except Exception as fault:
        # A bug of ours that one sample wakes must not cost the others theirs; it is told of, and ends with code 1.
        progress.note(traceback.format_exc())
        last = traceback.extract_tb(fault.__traceback__)[-1]
        place = f"{Path(last.filename).name}, line {last.lineno}"
        report = f"{sample.name}: {type(fault).__name__} in {place}: {fault}. A bug of ours: please report it."
        outcome.fate, outcome.faults = "bug", [report]
    if outcome.faults:
        outcome.remarks, outcome.dialect = [], None
    # Files are named as the lab knows them: from its own folder on, which is absolute here.
    outcome.faults = [fault.replace(f"{folder}/", "") for fault in outcome.faults]
    outcome.asked = {file: question.replace(f"{folder}/", "") for file, question in outcome.asked.items()}
    return outcome


def _take_in(outcome: SampleOutcome, folder: Path, lab: Path, catalogue: Catalogue, dry_run: bool) -> None:
    """Let ``outcome`` say what became of the sample, or what is wrong with it. Raises InputError too."""
    sample = outcome.sample
    before = None if sample.questions else next(reversed(catalogue.records(sample.key)), None)
    if before is not None and not outcome.faults:
        kept = (lab / before.folder / name for name in (TRIAL, *(file.kept_as for file in before.files)))
        if before.content == outcome.content and all(file.is_file() for file in kept):
            outcome.fate, outcome.trial, outcome.revision = "unchanged", before.folder, before.revision
            outcome.remarks, outcome.dialect = list(before.remarks), before.dialect
            return
        _refuse_namesake(outcome, before, (_name_of_source(folder, lab), as_text(folder)))
    if not sample.questions:
        prepare(folder, outcome)
    if outcome.faults:
        return
    if not dry_run:
        record = keep(outcome, before, folder, lab)
        catalogue.add(record)
        outcome.trial, outcome.revision = record.folder, record.revision
    outcome.fate = "new" if before is None else "revised"


def _refuse_namesake(outcome: SampleOutcome, before: Record, sources: Sequence[str]) -> None:
    """Another folder's sample of the same name is another sample, unless its photo is the same.

    ``sources`` are the folder's names: that of today, and the path that earlier versions kept.
    """
    photo = before.file("photo")
    same_photo = photo is not None and any(raw.sha256 == photo.sha256 for raw in outcome.raw)
    if before.source not in sources and not same_photo:
        raise InputError(
            f"{outcome.sample.files['photo']}: a sample {before.name} with another photo came from {before.source}; "
            "give this one another name in the pairing file."
        )


def keep(outcome: SampleOutcome, before: Record | None, source: Path, lab: Path) -> Record:
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
        folder=_folder(lab, outcome, before, revision),
        source=_name_of_source(source, lab),
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
    incoming, target = lab / INCOMING, lab / record.folder
    shutil.rmtree(incoming, ignore_errors=True)
    write_trial(outcome, source, incoming)
    files.write_json(incoming / RECORD, asdict(record))
    with naming(target):
        incoming.rename(target)
    return record


def write_trial(outcome: SampleOutcome, source: Path, folder: Path) -> None:
    """Write a sound sample's files byte for byte, and its trial.toml. Raises InputError as ``keep``."""
    assert outcome.settings is not None, "only what is sound has a trial"
    (folder / INPUTS).mkdir(parents=True)
    for raw in outcome.raw:
        path = source / raw.original
        with naming(path):
            content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() != raw.sha256:
            raise InputError(f"{path}: changed while it was taken in. Give the same command again.")
        files.write_bytes(folder / raw.kept_as, content)
    files.write_text(folder / TRIAL, trial_text(outcome.settings))


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
