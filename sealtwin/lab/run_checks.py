"""Make the checks that precede a run's first frame, for all samples of a lab's folder."""

import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any

from digitise.settings import CHOICE
from sealtwin.core import files
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, open_folder
from sealtwin.lab.catalogue import RUN, Catalogue
from sealtwin.lab.files import TRIAL, folder_of
from sealtwin.lab.ingest import Ingested, save_questions, write_trial
from sealtwin.lab.notes import DEPTH, SCALE
from sealtwin.lab.prepare import INPUTS, doubts_in
from sealtwin.lab.sample import PAIRING, LabSample
from sealtwin.study.photos import Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run
from sealtwin.trial.trial_file import load_trial

WAITING = ".traced"  # Folder in a lab with the tracings of samples that have no trial yet


def check_runs(ingested: Ingested, progress: Progress, jobs: int = 1) -> Batch:
    """Trace the crack of each sample that has a scale, and check its trial as its run would; ask about the faults.

    Each trial in the lab is traced into the folder of its run. A page with all walls, and with the sheets in question,
    is written at the top of the lab. Samples in doubt are traced too, so that all questions are asked together, in a
    hidden folder of the lab, from which their runs are moved to their trials. A fault in one sample does not stop the
    others. Raises InputError if the lab has another program's contact sheet.
    """
    lab, traced = ingested.lab, dict[str, LabSample]()
    with holding(lab, progress.note):
        for sample in ingested.samples:
            if _has_trial(sample, lab):
                traced[(sample.copies / RUN).relative_to(lab).as_posix()] = sample
        planned = [PlannedPhoto(sample.copies / TRIAL, run, {}) for run, sample in traced.items()]
        sheets = {f"{one.file('readings')}": sheet for one in ingested.samples if (sheet := one.sheet_in_question)}
        batch = digitise_many(planned, lab, _Steps(progress), jobs, locked=True, sheets=sheets)
        progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
        for number, row in enumerate(batch.rows, start=1):
            _check(traced[row.folder], row)
            progress.advance(number, row.folder)
        for folder in {*(lab / WAITING).glob("*")} - {sample.copies for sample in traced.values()}:
            shutil.rmtree(folder)
        with suppress(OSError):  # Unless tracings are left
            (lab / WAITING).rmdir()
        catalogue = Catalogue(lab)
        # Do not overwrite edits since the ingest; the next ingest reads them.
        save_questions(ingested, catalogue, edited=files.sha256(lab / PAIRING) != catalogue.content.pairing)
    return batch


def _has_trial(sample: LabSample, lab: Path) -> bool:
    """Set the folder with the trial of a sample to trace. That of a sample in doubt is written into a hidden folder."""
    folder = lab / WAITING / folder_of(sample.name)
    # It has the sample's earlier name, which may have changed.
    (folder / RUN / TRIAL).unlink(missing_ok=True)
    if sample.record is not None:
        sample.copies = lab / sample.record.folder
        if (folder / RUN).is_dir() and not (sample.copies / RUN).exists():
            (folder / RUN).rename(sample.copies / RUN)
        return True
    if sample.trial is None or SCALE in sample.stand_ins:
        return False
    shutil.rmtree(folder / INPUTS, ignore_errors=True)
    # Without readings that cannot be read, and without a fill in walls that nobody has described.
    changed: dict[str, Any] = {"readings": None, "gate": None} if sample.dialect is None else {}
    if sample.stand_ins & {DEPTH, "crack.tilt"} and sample.trial.crack is not None:
        changed["crack"] = sample.trial.crack.model_copy(update={"fill": None})
    try:
        write_trial(sample, sample.trial.model_copy(update=changed), folder)
    except InputError as fault:
        sample.ask(f"{fault}")
        return False
    sample.copies = folder
    return True


def _check(sample: LabSample, row: BatchRow) -> None:
    """Ask about the faults that prevent the run of the traced trial, and doubts about its readings."""
    if row.status != "ok":
        where, _, finding = row.reason.partition(": ")
        answers = {"crack": 2} if CHOICE in finding else {}
        sample.ask(Doubt("photo", where, finding.replace(CHOICE, "a 2 in the column crack"), answers=answers))
    elif DEPTH not in sample.stand_ins:
        try:
            trial = load_trial(sample.copies / TRIAL)
            with open_folder(sample.copies / RUN, create=True) as opened:
                readings = check_run(start_job(trial, sample.copies, opened, "cpu", Progress()))
        except InputError as fault:
            sample.ask(*doubts_in(fault))
        else:
            sample.ask(*(() if readings is None else readings.questions))


class _Steps(Progress):
    """Progress without notes: what they say of faults is in the answer, in the names of the lab's own files."""

    def __init__(self, shown: Progress) -> None:
        self.start, self.advance, self.close = shown.start, shown.advance, shown.close
