"""Make the checks that precede a run's first frame, for all trials of a lab. Each photo is traced once."""

import re
import shutil
import tempfile
from collections.abc import Sequence
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
from sealtwin.lab.sample import INPUTS, NEEDED, SampleOutcome
from sealtwin.lab.sheets import doubts_in, questions_of
from sealtwin.study.photos import Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.trial.digitise_stage import tracing_key
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run
from sealtwin.trial.trial_file import Trial, load_trial

PICTURE = re.compile(r" Look at [^\n]+?\.png\.")
WAITING = ".traced"  # Folder in a lab with the tracings of samples that have no trial yet


@dataclass(frozen=True)
class _Check:
    """A sample to trace and check, in a folder with its trial, its files and its run."""

    outcome: SampleOutcome
    folder: Path

    def clean(self, text: str) -> str:
        """Return a text that names the lab's own files instead of their copies."""
        for raw in self.outcome.raw:
            text = text.replace(f"{self.folder / raw.kept_as}", raw.original)
        return text

    def doubts(self) -> Sequence[Doubt]:
        """Return the faults that prevent the run of the traced trial, and doubts about its readings."""
        try:
            trial = load_trial(self.folder / TRIAL)
            with open_folder(self.folder / RUN, create=True) as opened:
                readings = check_run(start_job(trial, self.folder, opened, "cpu", Progress()))
        except InputError as fault:
            return doubts_in(fault)
        return () if readings is None else questions_of(readings)


def check_runs(ingested: Ingested, progress: Progress, jobs: int = 1) -> tuple[Batch, list[CatalogueFault]]:
    """Trace the crack of each sample that has a scale, and check its trial as its run would.

    Each trial in the lab is traced into the folder of its run. A page with all walls, and with the sheets in question,
    is written at the top of the lab. Samples in doubt are traced too, so that all questions are asked together; the lab
    keeps their tracings in a hidden folder until they have trials. A dry run uses tracings of the lab, and keeps none.
    A trial that had no fault is not checked again until it changes. A fault in one sample does not stop the others.
    Raises InputError if the lab has another program's contact sheet.
    """
    lab, dry_run, faults = ingested.lab, ingested.dry_run, list[CatalogueFault]()
    with tempfile.TemporaryDirectory() as scratch, nullcontext() if dry_run else holding(lab, progress.note):
        out, catalogue, tracings = Path(scratch) if dry_run else lab, Catalogue(lab), Tracings(lab)
        waiting = out / WAITING / content_key({"source": ingested.source})[:8]
        checks = dict[str, _Check]()
        for outcome in ingested.outcomes:
            try:
                if (folder := _written(outcome, lab, waiting, dry_run)) is not None:
                    checks[f"{(folder / RUN).relative_to(out).as_posix()}"] = _Check(outcome, folder)
                    tracings.give(folder)
            except InputError as fault:
                faults.append(CatalogueFault(outcome.sample.name, str(fault)))
        planned = [PlannedPhoto(check.folder / TRIAL, run, {}) for run, check in checks.items()]
        # The page shows samples that cannot be traced too: otherwise they would not be missed.
        traced = {check.outcome.sample.key for check in checks.values()}
        missed = [
            BatchRow(f"{outcome.sample.files['photo']}", outcome.sample.name, "failed", reason=f"{outcome.faults[0]}")
            for outcome in ingested.outcomes
            if outcome.faults and "photo" in outcome.sample.files and outcome.sample.key not in traced
        ]
        sheets = {
            f"{outcome.sample.files['readings']}": outcome.understood
            for outcome in ingested.outcomes
            if outcome.faults and outcome.understood is not None and "readings" in outcome.sample.files
        }
        batch = digitise_many(planned, out, _Steps(progress), jobs, missed, locked=True, sheets=sheets)
        progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
        for number, row in enumerate(batch.rows, start=1):
            check = checks[row.folder]
            faults += _checked(check, row, catalogue, dry_run)
            progress.advance(number, row.folder)
        named = [(row, checks[row.folder]) for row in batch.rows]
        rows = [
            replace(row, file=f"{check.outcome.sample.files['photo']}", reason=check.clean(row.reason))
            for row, check in named
        ]
        if not dry_run:
            for path in waiting.glob("*"):
                if f"{(path / RUN).relative_to(out).as_posix()}" not in checks:
                    shutil.rmtree(path)
            with suppress(OSError):  # Unless tracings of this or of another source are left
                waiting.rmdir()
                waiting.parent.rmdir()
            # Do not overwrite edits since the ingest; the next ingest reads them.
            if files.sha256(lab / PAIRING) == catalogue.content.pairing:
                write_pairing(ingested, catalogue)
            catalogue.save()
    return replace(batch, rows=rows), faults


def _written(outcome: SampleOutcome, lab: Path, waiting: Path, dry_run: bool) -> Path | None:
    """Return the folder with the trial of a sample to trace; that of a sample in doubt is written into ``waiting``."""
    if outcome.trial is not None:
        return None if dry_run else lab / outcome.trial
    if outcome.settings is None or SCALE in outcome.stand_ins:
        return None
    folder = waiting / folder_of(outcome.sample.name)
    shutil.rmtree(folder / INPUTS, ignore_errors=True)
    write_trial(outcome, _without_doubts(outcome, outcome.settings), folder)
    # It has the sample's earlier name, which may have changed.
    (folder / RUN / TRIAL).unlink(missing_ok=True)
    return folder


def _checked(check: _Check, row: BatchRow, catalogue: Catalogue, dry_run: bool) -> list[CatalogueFault]:
    """Ask about the faults of a traced trial, and return those that were not known."""
    outcome, state = check.outcome, state_of(check.folder)
    before, doubts, is_taken = len(outcome.faults), list[Doubt](), outcome.trial is not None
    if row.status != "ok":
        place, _, finding = row.reason.partition(": ")
        finding = (PICTURE.sub("", finding) if dry_run else finding).replace(
            CHOICE, f"a 2 in the column crack of {PAIRING}"
        )
        doubts = [Doubt("photo", place, finding, answers={"crack": 2} if CHOICE in row.reason else {})]
    elif DEPTH not in outcome.stand_ins and not (
        is_taken and catalogue.content.checked.get(check.folder.name) == (state, [])
    ):
        doubts = check.doubts()
    outcome.ask(*(replace(one, where=check.clean(one.where), finding=check.clean(one.finding)) for one in doubts))
    sentences = [str(fault) for fault in outcome.faults[before:]]
    if is_taken:
        catalogue.content.checked[check.folder.name] = (state, sentences)
    return [CatalogueFault(outcome.sample.name, sentence) for sentence in sentences]


class _Steps(Progress):
    """Progress without notes: what they say of faults is in the answer, in the names of the lab's own files."""

    def __init__(self, shown: Progress) -> None:
        self.start, self.advance, self.close = shown.start, shown.advance, shown.close


def _without_doubts(outcome: SampleOutcome, trial: Trial) -> Trial:
    """Return the trial of a sample without what is in doubt.

    It has no readings if they cannot be read, upright walls if the depth is missing, and no fill if the tilt is.
    """
    changed: dict[str, Any] = {} if outcome.is_read else {"readings": None, "gate": None}
    if DEPTH in outcome.stand_ins:
        # Upright walls are possible at any depth.
        changed["crack"] = CrackShape(depth_mm=NEEDED[DEPTH].stand_in, tilt="vertical")
    elif "crack.tilt" in outcome.stand_ins and trial.crack is not None:
        changed["crack"] = trial.crack.model_copy(update={"fill": None})
    return trial.model_copy(update=changed)


class Tracings:
    """Finished tracings in a lab, by the key of their photo and settings."""

    def __init__(self, lab: Path) -> None:
        self._lab = lab

    def give(self, trial_folder: Path) -> None:
        """Copy the tracing of a trial's photo into its run folder, if the lab has it and no stage has run there."""
        run = trial_folder / RUN
        with suppress(InputError):  # Reported when the photo is digitised.
            if self._folders and not ((run / MANIFEST).is_file() and look_into(run).manifest["stages"]):
                key = tracing_key(load_trial(trial_folder / TRIAL), trial_folder)
                if (traced := self._folders.get(key)) is not None:
                    with open_folder(run, create=True) as folder:
                        folder.copy_stage("digitise", traced)

    @cached_property
    def _folders(self) -> dict[str, RunFolder]:
        folders: dict[str, RunFolder] = {}
        for path in sorted(
            [*self._lab.glob(f"{WAITING}/*/*/{RUN}/{MANIFEST}"), *self._lab.glob(f"*/{RUN}/{MANIFEST}")]
        ):
            with suppress(InputError):  # Whoever uses that folder reports it.
                folder = look_into(path.parent)
                if (entry := folder.manifest["stages"].get("digitise")) is not None:
                    folders[entry["key"]] = folder
        return folders
