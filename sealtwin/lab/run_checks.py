"""Make the checks that precede a run's first frame, for all trials of a lab. Each photo is traced once."""

import re
import shutil
import tempfile
from collections.abc import Iterable
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from digitise.settings import CHOICE, CrackShape
from sealtwin.core import files
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import MANIFEST, holding, look_into, open_folder
from sealtwin.core.stage_keys import content_key
from sealtwin.lab.catalogue import RUN, Catalogue, state_of
from sealtwin.lab.files import TRIAL, folder_of
from sealtwin.lab.ingest import Ingested, write_pairing, write_trial
from sealtwin.lab.notes import DEPTH, SCALE
from sealtwin.lab.pairing import PAIRING
from sealtwin.lab.sample import INPUTS, NEEDED, SampleOutcome
from sealtwin.lab.sheets import doubts_in
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

    def doubts(self) -> list[Doubt]:
        """Return the faults that prevent the run of the traced trial, and doubts about its readings."""
        try:
            trial = load_trial(self.folder / TRIAL)
            with open_folder(self.folder / RUN, create=True) as opened:
                readings = check_run(start_job(trial, self.folder, opened, "cpu", Progress()))
        except InputError as fault:
            return [*doubts_in(fault)]
        return [] if readings is None else [*readings.questions]


def check_runs(ingested: Ingested, progress: Progress, jobs: int = 1) -> Batch:
    """Trace the crack of each sample that has a scale, and check its trial as its run would; ask about the faults.

    Each trial in the lab is traced into the folder of its run. A page with all walls, and with the sheets in question,
    is written at the top of the lab. Samples in doubt are traced too, so that all questions are asked together; the lab
    keeps their tracings in a hidden folder until they have trials. A dry run uses tracings of the lab, and keeps none.
    A trial that had no fault is not checked again until it changes. A fault in one sample does not stop the others.
    Raises InputError if the lab has another program's contact sheet.
    """
    lab, dry_run, outcomes = ingested.lab, ingested.dry_run, ingested.outcomes
    place, checks = Path(WAITING, content_key({"source": ingested.source})[:8]), dict[str, _Check]()
    with tempfile.TemporaryDirectory() as scratch, nullcontext() if dry_run else holding(lab, progress.note):
        out, catalogue = Path(scratch) if dry_run else lab, Catalogue(lab)
        for outcome in outcomes:
            try:
                if (folder := _written(outcome, lab, out / place, dry_run)) is not None:
                    checks[(folder / RUN).relative_to(out).as_posix()] = _Check(outcome, folder)
                    before = [lab / record.folder for record in catalogue.of_sample(outcome.sample.key)]
                    _reuse(folder, [lab / place / folder.name, *before])
            except InputError as fault:
                outcome.ask(f"{fault}")
        planned = [PlannedPhoto(check.folder / TRIAL, run, {}) for run, check in checks.items()]
        sheets = {f"{one.sample.file('readings')}": sheet for one in outcomes if (sheet := one.sheet_in_question)}
        batch = digitise_many(planned, out, _Steps(progress), jobs, locked=True, sheets=sheets)
        progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
        for number, row in enumerate(batch.rows, start=1):
            _ask(checks[row.folder], row, catalogue, dry_run)
            progress.advance(number, row.folder)
        if not dry_run:
            for path in (lab / place).glob("*"):
                if (path / RUN).relative_to(lab).as_posix() not in checks:
                    shutil.rmtree(path)
            with suppress(OSError):  # Unless tracings of this or of another source are left
                (lab / place).rmdir()
                (lab / WAITING).rmdir()
            # Do not overwrite edits since the ingest; the next ingest reads them.
            if files.sha256(lab / PAIRING) == catalogue.content.pairing:
                write_pairing(ingested, catalogue)
            catalogue.save()
    return batch


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


def _ask(check: _Check, row: BatchRow, catalogue: Catalogue, dry_run: bool) -> None:
    """Ask about the faults of a traced trial, and store those of a trial in the lab."""
    outcome, checked, state = check.outcome, catalogue.content.checked, state_of(check.folder)
    before, folder, doubts = len(outcome.faults), check.folder.name, list[Doubt]()
    if row.status != "ok":
        where, _, finding = row.reason.partition(": ")
        # The pictures of a dry run are deleted.
        finding = PICTURE.sub("", finding) if dry_run else finding
        answers = {"crack": 2} if CHOICE in finding else {}
        doubts = [Doubt("photo", where, finding.replace(CHOICE, "a 2 in the column crack"), answers=answers)]
    elif DEPTH not in outcome.stand_ins and (outcome.trial is None or checked.get(folder) != (state, [])):
        doubts = check.doubts()
    outcome.ask(*(replace(one, where=check.clean(one.where), finding=check.clean(one.finding)) for one in doubts))
    if outcome.trial is not None:
        checked[folder] = (state, [f"{fault}" for fault in outcome.faults[before:]])


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
        changed["crack"] = CrackShape(depth_mm=NEEDED[DEPTH][1], tilt="vertical")
    elif "crack.tilt" in outcome.stand_ins:
        changed["crack"] = trial.crack and trial.crack.model_copy(update={"fill": None})
    return trial.model_copy(update=changed)


def _reuse(folder: Path, others: Iterable[Path]) -> None:
    """Copy the tracing of a trial's photo into its run folder from another trial, unless a stage has run there."""
    with suppress(InputError):  # Reported when the photo is digitised.
        run = folder / RUN
        if (run / MANIFEST).is_file() and look_into(run).manifest["stages"]:
            return
        key = tracing_key(load_trial(folder / TRIAL), folder)
        for other in (other / RUN for other in others if (other / RUN / MANIFEST).is_file()):
            traced = look_into(other)
            if traced.manifest["stages"].get("digitise", {}).get("key") == key:
                with open_folder(run, create=True) as copy:
                    copy.copy_stage("digitise", traced)
                return
