"""Make the checks that precede a run's first frame, for all samples of a lab's folder."""

from typing import Any

from digitise.settings import CHOICE
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, open_folder
from sealtwin.lab.catalogue import RUN, Catalogue
from sealtwin.lab.files import TRIAL
from sealtwin.lab.ingest import Ingested, save_questions
from sealtwin.lab.notes import DEPTH, SCALE
from sealtwin.lab.sample import LabSample
from sealtwin.study.photos import Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run


def check_runs(ingested: Ingested, progress: Progress, jobs: int = 1) -> Batch:
    """Trace each trial with a scale in the folder of its run, check it as its run would, and ask about the faults.

    A page with all walls, and with the sheets in question, is written at the top of the lab. Samples with questions are
    traced too, so that all questions are asked together. A fault in one sample does not stop the others. Raises
    InputError if the lab has another program's contact sheet.
    """
    lab, traced = ingested.lab, dict[str, tuple[LabSample, PlannedPhoto]]()
    with holding(lab, progress.note):
        for sample in ingested.samples:
            if sample.record is not None and sample.trial is not None and SCALE not in sample.stand_ins:
                sample.trial_folder = lab / sample.record.folder
                run = f"{sample.record.folder}/{RUN}"
                traced[run] = sample, PlannedPhoto(sample.trial_folder / TRIAL, run, _without_questions(sample))
        sheets = {f"{one.file('readings')}": sheet for one in ingested.samples if (sheet := one.sheet_in_question)}
        planned = [photo for _, photo in traced.values()]
        batch = digitise_many(planned, lab, _Steps(progress), jobs, locked=True, sheets=sheets)
        progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
        for number, row in enumerate(batch.rows, start=1):
            _check(*traced[row.folder], row)
            progress.advance(number, row.folder)
        save_questions(ingested, Catalogue(lab))
    return batch


def _without_questions(sample: LabSample) -> dict[str, Any]:
    """Return the settings with which a sample in question is traced.

    They leave out readings that cannot be read, and the fill of walls that nobody has described.
    """
    changed: dict[str, Any] = {"readings": None, "gate": None} if sample.dialect is None else {}
    return changed | {"crack.fill": None} if sample.stand_ins.keys() & {DEPTH, "crack.tilt"} else changed


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
        except InputError as fault:
            sample.refuse(fault)
        else:
            sample.ask(*(() if readings is None else readings.questions))


class _Steps(Progress):
    """Progress without notes: what they say of faults is in the answer, in the names of the lab's own files."""

    def __init__(self, shown: Progress) -> None:
        self.start, self.advance, self.close = shown.start, shown.advance, shown.close
