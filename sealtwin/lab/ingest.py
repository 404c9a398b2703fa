"""A lab's folder into trials and a catalogue: what is sound is taken in, what is not is named, nothing is guessed."""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePath

from sealtwin.errors import InputError, as_text
from sealtwin.lab.catalogue import CATALOGUE, Catalogue, Fault
from sealtwin.lab.finding import DEFAULTS, LeftOut, find_files
from sealtwin.lab.holding import hold_back
from sealtwin.lab.keeping import complete, require_lab
from sealtwin.lab.naming import Said, read_names
from sealtwin.lab.notes import Note, read_note
from sealtwin.lab.pairing import Decisions, pair, place_files
from sealtwin.lab.pairing_file import PAIRING, decided, pairing_text, photographed, read_pairing
from sealtwin.lab.pieces import divide
from sealtwin.lab.tables import faults_of_values
from sealtwin.lab.taking import Outcome, Work, take_in
from sealtwin.lab.twins import twins
from sealtwin.progress import Progress
from sealtwin.store import files
from sealtwin.store.folder import holding, require_folder
from validate.sheets.samples import sample_key

WRITTEN_PAIRINGS = "pairing_sha256"
"""Fact of the catalogue: hashes of the pairing file as it was written last. Another one has been edited since."""
OF_ONE = ("name", "date", "photo.file", "photo.mask", "photo.second_photo", "readings.file")
"""What is never true of all samples of a folder."""


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
    by_name = read_names(found.files, folder.name)
    given = None if pairing is None else _given(pairing, folder, by_name)
    with _catalogue(lab, progress, dry_run) as catalogue:
        decisions = catalogue.decisions(source) if given is None else given
        named = divide(folder, by_name, _photographed(by_name, decisions))
        placed = place_files(named, decisions)
        samples, left_out = hold_back(pair(placed), found.left_out, folder.name)
        if not samples and not any(left.lost for left in found.left_out):
            raise InputError(f"{folder}: no photos, sheets or notes in it.")
        if not dry_run:
            catalogue.state_decisions(source, [item for item in placed if item.by_user])
            _write_pairing(lab, pairing, pairing_text(placed, samples), catalogue)
        progress.start(f"Taking in {len(samples)} samples", len(samples))
        work = Work(folder, defaults, lab, catalogue, progress, dry_run)
        outcomes = []
        for done, sample in enumerate(samples, start=1):
            outcomes.append(take_in(sample, work))
            progress.advance(done, sample.name)
        faults = [Fault(outcome.sample.name, sentence) for outcome in outcomes for sentence in outcome.faults]
        faults += [Fault(left.file, left.sentence) for left in left_out if left.lost]
        remarks = twins(work.sound, catalogue)
        outcomes = [
            replace(outcome, remarks=(*outcome.remarks, *remarks.get(outcome.sample.key, ()))) for outcome in outcomes
        ]
        if not dry_run:
            catalogue.state_faults(source, faults)
    return Ingested(lab, dry_run, tuple(outcomes), found.left_out, tuple(faults))


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
    """What lab.toml says of all samples. Raises InputError, with all its faults, where one would fail every sample."""
    note = read_note(folder / DEFAULTS)
    misplaced = [key for key in OF_ONE if key in note.entries]
    faults = [
        *note.faults,
        *(f"{folder / DEFAULTS}: {key} is of one sample; put it into its note." for key in misplaced),
    ]
    if faults:
        raise InputError("\n".join([*faults, *faults_of_values(note, folder / DEFAULTS)]))
    return note


def _given(pairing: Path, folder: Path, by_name: Mapping[PurePath, Said]) -> Decisions:
    """What the user's pairing file decides. Raises InputError where it cannot be."""
    rows = read_pairing(pairing)
    return decided(rows, divide(folder, by_name, _photographed(by_name) | photographed(rows)))


def _photographed(named: Mapping[PurePath, Said], decisions: Decisions | None = None) -> set[str]:
    """Keys of the samples that have a photo."""
    said = {**named, **{file: said for (file, _), said in (decisions or {}).items()}}
    return {sample_key(said.sample) for said in said.values() if said.role == "photo"}


def _refuse_nested(folder: Path, lab: Path) -> None:
    inner, outer = folder.resolve(), lab.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise InputError(
            f"{as_text(lab)}: --out and the lab's folder {as_text(folder)} lie one within the other; nothing is "
            "written among a lab's own files: give --out another folder."
        )
