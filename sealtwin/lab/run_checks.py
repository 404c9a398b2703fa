"""Make the checks that precede a run's first frame, for all trials of a lab."""

import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from digitise.settings import CHOICE, CrackShape
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, open_folder
from sealtwin.lab.catalogue import RUN, Catalogue, CatalogueFault, state_of
from sealtwin.lab.found_files import TRIAL
from sealtwin.lab.held_out import facts_above
from sealtwin.lab.ingest import Ingested, write_pairing, write_trial
from sealtwin.lab.note_words import DEPTH, SCALE
from sealtwin.lab.pairing import PAIRING
from sealtwin.lab.sample_outcome import SampleOutcome
from sealtwin.lab.sample_trials import NEEDED
from sealtwin.study.photos import Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run
from sealtwin.trial.trial_file import Trial, folder_name, load_trial

PICTURE = re.compile(r" Look at [^\n]+?\.png\.")


def check_runs(
    ingested: Ingested, folder: Path, progress: Progress, jobs: int = 1
) -> tuple[Batch, list[CatalogueFault]]:
    """Trace the crack of each sample of ``folder`` that has a scale, and check its trial as its run would.

    Each trial in the lab is traced once, into the folder of its run. A contact sheet of all trials is written at the
    top of the lab. Samples in doubt, and all samples of a dry run, are traced in a temporary folder, so that all
    questions are asked together. A fault in one sample does not stop the others. Raises InputError if the lab has
    another program's contact sheet.
    """
    taken = {each.trial: each for each in ingested.outcomes if each.trial is not None and not ingested.dry_run}
    doubtful = {
        folder_name(each.sample.name): (each, _without_doubts(each, each.settings))
        for each in ingested.outcomes
        if each.trial is None and each.settings is not None and SCALE not in each.stand_ins
    }
    faults, tried = list[CatalogueFault](), dict[str, SampleOutcome]()
    with tempfile.TemporaryDirectory() as scratch:
        for name, (outcome, trial) in doubtful.items():
            try:
                write_trial(outcome, trial, folder, Path(scratch) / name)
                tried[name] = outcome
            except InputError as fault:
                faults.append(CatalogueFault(outcome.sample.name, str(fault)))
        forgotten = _Forgotten(progress, Path(scratch), tried)
        batch, more = _checked(Path(scratch), tried, forgotten, jobs)
    faults += [CatalogueFault(fault.name, forgotten.clean(fault.sentence)) for fault in more]
    rows = [replace(row, file=forgotten.clean(row.file), reason=forgotten.clean(row.reason)) for row in batch.rows]
    batch = replace(batch, rows=rows)
    if ingested.dry_run:
        return batch, faults
    # The page shows samples that failed too: otherwise they would not be missed.
    missed = [
        BatchRow(str(outcome.sample.files["photo"]), outcome.sample.name, "failed", reason=" ".join(outcome.faults))
        for outcome in ingested.outcomes
        if outcome.fate in ("failed", "bug") and "photo" in outcome.sample.files
    ]
    with holding(ingested.lab, progress.note):
        catalogue = Catalogue(ingested.lab)
        batch, more = _checked(ingested.lab, taken, progress, jobs, missed, catalogue)
        # Do not overwrite edits since the ingest; the next ingest reads them.
        if files.sha256(ingested.lab / PAIRING) == catalogue.content.pairing:
            write_pairing(ingested, catalogue)
        catalogue.save()
    return batch, [*faults, *more]


class _Forgotten(Progress):
    """Progress of trials in a temporary folder. Its texts name the lab's files, but no pictures, which are deleted."""

    def __init__(self, shown: Progress, scratch: Path, tried: Mapping[str, SampleOutcome]) -> None:
        self._shown, self._scratch = shown, scratch
        self.start, self.advance, self.close = shown.start, shown.advance, shown.close
        self._names = {
            f"{scratch / name / raw.kept_as}": raw.original for name, one in tried.items() for raw in one.raw
        }

    def clean(self, sentence: str) -> str:
        sentence = PICTURE.sub("", sentence)
        for path, original in self._names.items():
            sentence = sentence.replace(path, original)
        return sentence.replace(f"{self._scratch}/", "")

    def note(self, text: str) -> None:
        self._shown.note(self.clean(text))

    def warn(self, text: str) -> None:
        self._shown.warn(self.clean(text))


def _without_doubts(outcome: SampleOutcome, trial: Trial) -> Trial:
    """Return the trial of a sample without what is in doubt.

    It has no readings if the sample has faults, upright walls if the depth is missing, and no fill if the tilt is.
    """
    changed: dict[str, Any] = dict.fromkeys(("readings", "gate")) if outcome.faults else {}
    if DEPTH in outcome.stand_ins:
        # Upright walls are possible at any depth.
        changed["crack"] = CrackShape(depth_mm=NEEDED[DEPTH].stand_in, tilt="vertical")
    elif "crack.tilt" in outcome.stand_ins and trial.crack is not None:
        changed["crack"] = trial.crack.model_copy(update={"fill": None})
    return trial.model_copy(update=changed)


def _checked(
    place: Path,
    tried: Mapping[str, SampleOutcome],
    progress: Progress,
    jobs: int,
    missed: Sequence[BatchRow] = (),
    catalogue: Catalogue | None = None,
) -> tuple[Batch, list[CatalogueFault]]:
    """Trace and check the trials in ``place``.

    A lab's ``catalogue`` stores the faults. A trial that had none is not checked again until it changes.
    """
    planned = [PlannedPhoto(place / name / TRIAL, f"{name}/{RUN}", {}) for name in tried]
    if not planned:
        return Batch(place), []
    batch = digitise_many(planned, place, progress, jobs, missed, locked=True)
    progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
    faults = list[CatalogueFault]()
    for number, row in enumerate(batch.rows, start=1):
        name = row.folder.removesuffix(f"/{RUN}")
        state = state_of(place / name)
        sentences: list[str] = []
        if row.status != "ok":
            sentences = [row.reason.replace(CHOICE, f"a 2 in the column crack of {PAIRING}")]
        elif DEPTH not in tried[name].stand_ins and (
            catalogue is None or catalogue.content.checked.get(name) != (state, [])
        ):
            sentences = _faults_of(place / name / RUN)
        # Messages have the lab's names of files.
        for raw in tried[name].raw:
            sentences = [sentence.replace(f"{place / name / raw.kept_as}", raw.original) for sentence in sentences]
        if catalogue is not None:
            catalogue.content.checked[name] = (state, sentences)
        tried[name].ask(PICTURE.sub("", sentence) if catalogue is None else sentence for sentence in sentences)
        faults += [CatalogueFault(tried[name].sample.name, sentence) for sentence in sentences]
        progress.advance(number, row.folder)
    return batch, faults


def _faults_of(run: Path) -> list[str]:
    """Return the faults that prevent the run of a traced trial, and doubts about its readings."""
    source = run.parent
    trial = load_trial(source / TRIAL)
    try:
        facts_above(trial, source)
        with open_folder(run, create=True) as opened:
            return list(check_run(start_job(trial, source, opened, "cpu", Progress())))
    except InputError as fault:
        return str(fault).splitlines()
