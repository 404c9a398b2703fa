"""A lab's folder into trials and a catalogue: what is sound is taken in, what is not is named, nothing is guessed."""

import hashlib
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from sealtwin import files
from sealtwin.errors import InputError, as_text
from sealtwin.folder import holding, require_folder
from sealtwin.lab.catalogue import CATALOGUE, Catalogue, Fault, Record
from sealtwin.lab.finding import DEFAULTS, LeftOut, find_files
from sealtwin.lab.keeping import complete, keep, require_lab
from sealtwin.lab.naming import read_names
from sealtwin.lab.notes import Note, read_note
from sealtwin.lab.pairing import Sample, pair, place_files
from sealtwin.lab.pairing_file import PAIRING, pairing_text, read_pairing
from sealtwin.lab.trials import Prepared, gather, prepare
from sealtwin.progress import Progress

WRITTEN_PAIRINGS = "pairing_sha256"
"""Fact of the catalogue: hashes of the pairing file as it was written last. Another one has been edited since."""
OF_ONE = ("name", "date", "photo.file", "photo.mask", "photo.second_photo", "readings.file")
"""What is never true of all samples of a folder."""

Fate = Literal["new", "revised", "unchanged", "failed", "bug"]


@dataclass(frozen=True)
class Outcome:
    """What became of one sample."""

    sample: Sample
    fate: Fate
    faults: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    trial: str | None = None
    """Its folder; in a dry run there is none yet."""
    revision: int | None = None
    dialect: str | None = None


@dataclass(frozen=True)
class Ingested:
    """What became of a lab's folder."""

    lab: Path
    dry_run: bool
    outcomes: tuple[Outcome, ...]
    left_out: tuple[LeftOut, ...]
    faults: tuple[Fault, ...]
    """Of samples, and of files that are of none."""


def ingest(
    folder: Path, lab: Path, progress: Progress, *, pairing: Path | None = None, dry_run: bool = False
) -> Ingested:
    """Take a folder of photos, sheets and notes into ``lab``: a trial's folder for each sample, and a catalogue.

    What is there already is not taken in again; a sample that has changed becomes another trial beside its old one.
    Another ingest into the same lab is waited for. Killed at any moment, the same call completes what was begun.

    Args:
        folder: The lab's own; nothing in it is changed.
        lab: Where trials and catalogue are kept; new, or made by an earlier call.
        progress: Is told how far it is.
        pairing: The pairing file as the user has corrected it; its corrections are remembered for ``folder``.
        dry_run: Look and tell, write nothing.

    Raises:
        InputError: the folder, its lab.toml or the pairing cannot be used at all.
    """
    _refuse_nested(folder, lab)
    folder = folder.resolve()
    found = find_files(folder)
    defaults = _defaults(folder) if found.defaults else Note()
    source = as_text(folder)
    with _catalogue(lab, progress, dry_run) as catalogue:
        named = read_names(found.files, folder.name)
        placed = place_files(named, catalogue.decisions(source) if pairing is None else read_pairing(pairing, named))
        samples = pair(placed)
        if not samples and not any(left.lost for left in found.left_out):
            raise InputError(f"{folder}: no photos, sheets or notes in it.")
        if not dry_run:
            catalogue.state_decisions(source, [item for item in placed if item.by_user])
            _write_pairing(lab, pairing, pairing_text(placed, samples), catalogue)
        progress.start(f"Taking in {len(samples)} samples", len(samples))
        work = _Work(folder, defaults, lab, catalogue, progress, dry_run)
        outcomes = []
        for done, sample in enumerate(samples, start=1):
            outcomes.append(_take_in(sample, work))
            progress.advance(done, sample.name)
        faults = [Fault(outcome.sample.name, sentence) for outcome in outcomes for sentence in outcome.faults]
        faults += [Fault(left.file, f"{left.file}: {left.reason}") for left in found.left_out if left.lost]
        if not dry_run:
            catalogue.state_faults(source, faults)
    return Ingested(lab, dry_run, tuple(outcomes), found.left_out, tuple(faults))


@dataclass(frozen=True)
class _Work:
    """What all samples of one ingest share."""

    folder: Path
    defaults: Note
    lab: Path
    catalogue: Catalogue
    progress: Progress
    dry_run: bool

    @property
    def source(self) -> str:
        return as_text(self.folder)


def _take_in(sample: Sample, work: _Work) -> Outcome:
    """Whatever is wrong with it, or becomes wrong on the way, is its own; but for a fault of the disk of the lab."""
    prepared = Prepared(sample)
    try:
        prepared = gather(work.folder, sample, work.defaults)
        if (outcome := _taken_in(prepared, work)) is not None:
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
        return Outcome(sample, "bug", (report,))
    return Outcome(sample, "failed", tuple(_from(work.folder, fault) for fault in prepared.faults))


def _taken_in(prepared: Prepared, work: _Work) -> Outcome | None:
    """None where something is wrong with the sample, which ``prepared`` then says. Raises InputError too."""
    sample = prepared.sample
    before = None if sample.questions else work.catalogue.latest(sample.key)
    if before is not None and not prepared.faults:
        if before.content == prepared.content:
            return Outcome(sample, "unchanged", (), before.remarks, before.folder, before.revision, before.dialect)
        _refuse_namesake(prepared, before, work.source)
    if not sample.questions:
        prepare(work.folder, prepared)
    if prepared.faults:
        return None
    fate: Fate = "new" if before is None else "revised"
    if work.dry_run:
        return Outcome(sample, fate, (), tuple(prepared.remarks), dialect=prepared.dialect)
    record = keep(work.lab, work.source, prepared, before)
    work.catalogue.add(record)
    return Outcome(sample, fate, (), record.remarks, record.folder, record.revision, record.dialect)


def _from(folder: Path, sentence: str) -> str:
    """Files as the lab knows them: from its own folder on, which is absolute here."""
    return sentence.replace(f"{folder}/", "")


@contextmanager
def _catalogue(lab: Path, progress: Progress, dry_run: bool) -> Iterator[Catalogue]:
    """The lab's, held against other processes and made whole; only looked at in a dry run."""
    require_folder(lab)
    require_lab(lab)
    if dry_run:
        with Catalogue.unwritten(lab) as catalogue:
            yield catalogue
        return
    with holding(lab, progress.note), Catalogue(lab / CATALOGUE, create=True) as catalogue:
        if completed := complete(lab, catalogue):
            progress.note(f"{lab}: {completed} trials that were in no catalogue are in it now.")
        yield catalogue


def _write_pairing(lab: Path, given: Path | None, text: str, catalogue: Catalogue) -> None:
    """Raises InputError where it was edited, and not given back: the edits would be lost."""
    path = lab / PAIRING
    now = files.sha256(path) if path.is_file() else None
    then = hashlib.sha256(text.encode()).hexdigest()
    known = {None, then, *(catalogue.fact(WRITTEN_PAIRINGS) or "").split()}
    if now not in known and (given is None or given.resolve() != path.resolve()):
        raise InputError(
            f"{path}: edited since it was written. Give it back with --pairing {path}, or delete it if the names of "
            "the files are to decide."
        )
    # Both, since a kill may come before the file is written.
    catalogue.state_fact(WRITTEN_PAIRINGS, f"{now or ''} {then}")
    files.write_text(path, text)


def _defaults(folder: Path) -> Note:
    """What lab.toml says of all samples. Raises InputError where it cannot be used: every sample would fail by it."""
    note = read_note(folder / DEFAULTS)
    misplaced = [key for key in OF_ONE if key in note.entries]
    faults = [
        *note.faults,
        *(f"{folder / DEFAULTS}: {key} is of one sample; put it into its note." for key in misplaced),
    ]
    if faults:
        raise InputError("\n".join(faults))
    return note


def _refuse_nested(folder: Path, lab: Path) -> None:
    inner, outer = folder.resolve(), lab.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise InputError(
            f"{as_text(lab)}: --out and the lab's folder {as_text(folder)} lie one within the other; nothing is "
            "written among a lab's own files: give --out another folder."
        )


def _refuse_namesake(prepared: Prepared, before: Record, source: str) -> None:
    """Another folder's sample of the same name is another sample, unless its photo is the same."""
    photo = before.file("photo")
    same_photo = photo is not None and any(raw.sha256 == photo.sha256 for raw in prepared.raw)
    if before.source != source and not same_photo:
        raise InputError(
            f"{prepared.sample.files['photo']}: a sample {before.name} with another photo came from {before.source}; "
            "give this one another name in the pairing file."
        )
