"""Make the checks that precede a run's first frame, for all trials of a lab. Each photo is traced once."""

import re
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from digitise.settings import CHOICE, CrackShape
from sealtwin.core import files
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import MANIFEST, RunFolder, holding, look_into, open_folder
from sealtwin.core.stage_keys import content_key
from sealtwin.lab.catalogue import RUN, Catalogue, CatalogueFault, state_of
from sealtwin.lab.files import TRIAL, folder_of
from sealtwin.lab.ingest import Ingested, write_pairing, write_trial
from sealtwin.lab.notes import DEPTH, SCALE
from sealtwin.lab.pairing import PAIRING
from sealtwin.lab.sample import NEEDED, SampleOutcome
from sealtwin.lab.sheets import doubts_in, questions_of
from sealtwin.study.photos import Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.trial.digitise_stage import tracing_key
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run
from sealtwin.trial.trial_file import Trial, load_trial
from validate.readings.grid import ReadSheet

PICTURE = re.compile(r" Look at [^\n]+?\.png\.")
WAITING = ".traced"  # Folder in a lab with the tracings of samples that have no trial yet


@dataclass(frozen=True)
class _Check:
    """A sample to trace and check."""

    outcome: SampleOutcome
    source: Path  # Folder with its trial and its files
    run: str  # Run folder, in the folder of the batch


def check_runs(ingested: Ingested, progress: Progress, jobs: int = 1) -> tuple[Batch, list[CatalogueFault]]:
    """Trace the crack of each sample that has a scale, and check its trial as its run would.

    Each trial in the lab is traced into the folder of its run. A contact sheet of all trials is written at the top of
    the lab. Samples in doubt are traced too, so that all questions are asked together; the lab keeps their tracings in
    a hidden folder until they have trials. A dry run uses tracings of the lab, and keeps none. A fault in one sample
    does not stop the others. Raises InputError if the lab has another program's contact sheet.
    """
    lab, dry_run = ingested.lab, ingested.dry_run
    with tempfile.TemporaryDirectory() as scratch, nullcontext() if dry_run else holding(lab, progress.note):
        waiting = Path(scratch, "traced") if dry_run else waiting_folder(lab, ingested.source)
        tracings, faults, doubtful = Tracings(lab), list[CatalogueFault](), list[_Check]()
        for outcome in ingested.outcomes:
            if outcome.trial is not None or outcome.settings is None or SCALE in outcome.stand_ins:
                continue
            name = folder_of(outcome.sample.name)
            check = _Check(outcome, Path(scratch, name), name)
            try:
                write_trial(outcome, _without_doubts(outcome, outcome.settings), check.source)
                doubtful.append(check)
            except InputError as fault:
                faults.append(CatalogueFault(outcome.sample.name, str(fault)))
        for check in doubtful:
            # It has the sample's earlier name, which may have changed.
            (waiting / check.run / TRIAL).unlink(missing_ok=True)
        shown = _LabNames(progress, doubtful, Path(scratch), pictures=not dry_run)
        batch, more = _checked(waiting, doubtful, tracings, shown, jobs)
        faults += more
        if dry_run:
            rows = [replace(row, file=shown.clean(row.file), reason=shown.clean(row.reason)) for row in batch.rows]
            return replace(batch, rows=rows), faults
        # The page shows samples that failed too: otherwise they would not be missed.
        missed = [
            BatchRow(
                str(outcome.sample.files["photo"]),
                outcome.sample.name,
                "failed",
                reason=" ".join(map(str, outcome.faults)),
            )
            for outcome in ingested.outcomes
            if outcome.trial is None and "photo" in outcome.sample.files
        ]
        taken = [
            _Check(outcome, lab / outcome.trial, f"{outcome.trial}/{RUN}")
            for outcome in ingested.outcomes
            if outcome.trial is not None
        ]
        catalogue = Catalogue(lab)
        shown = _LabNames(progress, taken, Path(scratch))
        sheets = {
            f"{outcome.sample.files['readings']}": outcome.understood
            for outcome in ingested.outcomes
            if outcome.faults and outcome.understood is not None and "readings" in outcome.sample.files
        }
        batch, more = _checked(lab, taken, tracings, shown, jobs, missed, catalogue, sheets)
        _remove_unused(waiting, doubtful)
        # Do not overwrite edits since the ingest; the next ingest reads them.
        if files.sha256(lab / PAIRING) == catalogue.content.pairing:
            write_pairing(ingested, catalogue)
        catalogue.save()
    return batch, [*faults, *more]


def _remove_unused(waiting: Path, doubtful: Sequence[_Check]) -> None:
    """Remove the tracings of samples that are no longer in doubt: their run folders have copies."""
    used = {check.run for check in doubtful}
    for path in waiting.iterdir() if waiting.is_dir() else ():
        if path.is_dir() and path.name not in used:
            shutil.rmtree(path)
    if waiting.is_dir() and not used:
        shutil.rmtree(waiting)
        with suppress(OSError):
            waiting.parent.rmdir()  # Unless it has tracings of another source


class _LabNames(Progress):
    """Progress of trials. Its texts name the lab's own files instead of their copies.

    Without ``pictures`` they name no pictures, because these are deleted with the folder ``scratch``.
    """

    def __init__(self, shown: Progress, checks: Iterable[_Check], scratch: Path, *, pictures: bool = True) -> None:
        self._shown, self._scratch, self._pictures = shown, scratch, pictures
        self.start, self.advance, self.close = shown.start, shown.advance, shown.close
        self._names = {f"{one.source / raw.kept_as}": raw.original for one in checks for raw in one.outcome.raw}

    def clean(self, sentence: str) -> str:
        sentence = sentence if self._pictures else PICTURE.sub("", sentence)
        for path, original in self._names.items():
            sentence = sentence.replace(path, original)
        return sentence.replace(f"{self._scratch}/", "")

    def note(self, text: str) -> None:
        self._shown.note(self.clean(text))

    def warn(self, text: str) -> None:
        self._shown.warn(self.clean(text))


def _without_doubts(outcome: SampleOutcome, trial: Trial) -> Trial:
    """Return the trial of a sample without what is in doubt.

    It has no readings if they cannot be read, upright walls if the depth is missing, and no fill if the tilt is.
    """
    changed: dict[str, Any] = {} if outcome.is_read else dict.fromkeys(("readings", "gate"))
    if DEPTH in outcome.stand_ins:
        # Upright walls are possible at any depth.
        changed["crack"] = CrackShape(depth_mm=NEEDED[DEPTH].stand_in, tilt="vertical")
    elif "crack.tilt" in outcome.stand_ins and trial.crack is not None:
        changed["crack"] = trial.crack.model_copy(update={"fill": None})
    return trial.model_copy(update=changed)


def _checked(
    out: Path,
    checks: Sequence[_Check],
    tracings: "Tracings",
    progress: _LabNames,
    jobs: int,
    missed: Sequence[BatchRow] = (),
    catalogue: Catalogue | None = None,
    sheets: Mapping[str, ReadSheet] | None = None,
) -> tuple[Batch, list[CatalogueFault]]:
    """Trace and check trials with run folders in ``out``, and ask about their faults.

    A lab's ``catalogue`` stores the faults. A trial that had none is not checked again until it changes.
    """
    if not checks and catalogue is None:
        return Batch(out), []
    for check in checks:
        with suppress(InputError):  # Reported when the photo is digitised.
            tracings.give(check.source, out / check.run)
    planned = [PlannedPhoto(check.source / TRIAL, check.run, {}) for check in checks]
    batch = digitise_many(planned, out, progress, jobs, missed, locked=True, sheets=sheets)
    by_run = {one.run: one for one in checks}
    progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
    faults = list[CatalogueFault]()
    for number, row in enumerate(batch.rows, start=1):
        check = by_run[row.folder]
        outcome, folder, state = check.outcome, check.source.name, state_of(check.source)
        before, doubts = len(outcome.faults), list[Doubt]()
        if row.status != "ok":
            place, _, finding = row.reason.replace(CHOICE, f"a 2 in the column crack of {PAIRING}").partition(": ")
            doubts = [Doubt("photo", place, finding, answers={"crack": 2} if CHOICE in row.reason else {})]
        elif DEPTH not in outcome.stand_ins and (
            catalogue is None or catalogue.content.checked.get(folder) != (state, [])
        ):
            doubts = _doubts_of(check.source, out / check.run)
        clean = progress.clean
        outcome.ask(*(replace(one, where=clean(one.where), finding=clean(one.finding)) for one in doubts))
        sentences = [str(fault) for fault in outcome.faults[before:]]
        if catalogue is not None:
            catalogue.content.checked[folder] = (state, sentences)
        faults += [CatalogueFault(outcome.sample.name, sentence) for sentence in sentences]
        progress.advance(number, row.folder)
    return batch, faults


def _doubts_of(source: Path, run: Path) -> Sequence[Doubt]:
    """Return the faults that prevent the run of a traced trial, and doubts about its readings."""
    trial = load_trial(source / TRIAL)
    try:
        with open_folder(run, create=True) as opened:
            readings = check_run(start_job(trial, source, opened, "cpu", Progress()))
    except InputError as fault:
        return doubts_in(fault)
    return () if readings is None else questions_of(readings)


def waiting_folder(lab: Path, source: str) -> Path:
    """Return the folder for tracings of samples in doubt. Each source has its own, since names may be the same."""
    return lab / WAITING / content_key({"source": source})[:8]


class Tracings:
    """Finished tracings in a lab, by the key of their photo and settings."""

    def __init__(self, lab: Path) -> None:
        self._lab = lab

    def give(self, trial_folder: Path, run: Path) -> None:
        """Copy the tracing of a trial's photo into its run folder, if the lab has it and no stage has run there.

        Raises InputError if the trial cannot be read, or the run folder cannot be used.
        """
        if not self._folders or ((run / MANIFEST).is_file() and look_into(run).manifest["stages"]):
            return
        key = tracing_key(load_trial(trial_folder / TRIAL), trial_folder)
        if (traced := self._folders.get(key)) is not None:
            with open_folder(run, create=True) as folder:
                folder.copy_stage("digitise", traced)

    @cached_property
    def _folders(self) -> dict[str, RunFolder]:
        folders: dict[str, RunFolder] = {}
        for path in sorted([*self._lab.glob(f"{WAITING}/*/*/{MANIFEST}"), *self._lab.glob(f"*/{RUN}/{MANIFEST}")]):
            try:
                folder = look_into(path.parent)
            except InputError:
                continue  # Whoever uses that folder reports it.
            if (entry := folder.manifest["stages"].get("digitise")) is not None:
                folders[entry["key"]] = folder
        return folders
