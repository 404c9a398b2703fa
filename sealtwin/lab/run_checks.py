"""Checks of trials as a run makes them before its first frame, so that what is sound does run."""

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
from sealtwin.lab.facts_above import facts_above
from sealtwin.lab.found_files import TRIAL
from sealtwin.lab.ingest import Ingested, write_pairing, write_trial
from sealtwin.lab.note_words import SCALE
from sealtwin.lab.pairing import PAIRING
from sealtwin.lab.sample_outcome import SampleOutcome
from sealtwin.lab.trial_tables import NEEDED
from sealtwin.study.photos import Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run
from sealtwin.trial.trial_file import Trial, folder_name, load_trial

PICTURE = re.compile(r" Look at [^\n]+?\.png\.")
DEPTH = "crack.depth_mm"


def check_runs(
    ingested: Ingested, folder: Path, progress: Progress, jobs: int = 1
) -> tuple[Batch, list[CatalogueFault]]:
    """Trace every trial that was taken in or is sound from ``folder``, and check it as its run would.

    Trials are traced into the folders that their runs go on in, and a contact sheet of all lies on top of the lab.
    Photos of samples that are held back are traced too, and forgotten, so that all questions come at once, as are all
    in a dry run. What is traced already is not traced again; a fault in one costs no other. Raises InputError where
    the lab holds another's contact sheet.
    """
    taken = {each.trial: each for each in ingested.outcomes if each.trial is not None and not ingested.dry_run}
    tried = {
        folder_name(each.sample.name): each
        for each in ingested.outcomes
        if each.trial is None and each.settings is not None and SCALE not in each.stand_ins
    }
    faults = list[CatalogueFault]()
    with tempfile.TemporaryDirectory() as scratch:
        for name, outcome in list(tried.items()):
            try:
                write_trial(outcome, _without_doubts(outcome), folder, Path(scratch) / name)
            except InputError as fault:
                faults.append(CatalogueFault(tried.pop(name).sample.name, str(fault)))
        forgotten = _Forgotten(progress, Path(scratch), tried)
        batch, told = _checked(Path(scratch), tried, forgotten, jobs)
    faults += [CatalogueFault(fault.name, forgotten.clean(fault.sentence)) for fault in told]
    rows = [replace(row, file=forgotten.clean(row.file), reason=forgotten.clean(row.reason)) for row in batch.rows]
    batch = replace(batch, rows=rows)
    if ingested.dry_run:
        return batch, faults
    # Nobody would miss them on a page of the others.
    missed = [
        BatchRow(str(outcome.sample.files["photo"]), outcome.sample.name, "failed", reason=" ".join(outcome.faults))
        for outcome in ingested.outcomes
        if outcome.fate in ("failed", "bug") and "photo" in outcome.sample.files
    ]
    with holding(ingested.lab, progress.note):
        catalogue = Catalogue(ingested.lab)
        batch, told = _checked(ingested.lab, taken, progress, jobs, missed, catalogue)
        # What was edited since is read first.
        if files.sha256(ingested.lab / PAIRING) == catalogue.content.pairing:
            write_pairing(ingested, catalogue)
        catalogue.save()
    return batch, [*faults, *told]


class _Forgotten(Progress):
    """Progress of trials in a temporary folder: what it shows names the lab's own files, and no picture there."""

    def __init__(self, shown: Progress, scratch: Path, tried: Mapping[str, SampleOutcome]) -> None:
        self._shown, self._scratch = shown, scratch
        self._names = {
            f"{scratch / name / raw.kept_as}": raw.original for name, one in tried.items() for raw in one.raw
        }

    def clean(self, sentence: str) -> str:
        sentence = PICTURE.sub("", sentence)
        for path, original in self._names.items():
            sentence = sentence.replace(path, original)
        return sentence.replace(f"{self._scratch}/", "")

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._shown.start(title, total, done)

    def expect(self, left_s: float) -> None:
        self._shown.expect(left_s)

    def advance(self, done: int, note: str = "") -> None:
        self._shown.advance(done, note)

    def note(self, text: str) -> None:
        self._shown.note(self.clean(text))

    def warn(self, text: str) -> None:
        self._shown.warn(self.clean(text))

    def close(self) -> None:
        self._shown.close()


def _without_doubts(outcome: SampleOutcome) -> Trial:
    """Return the settings of a sample; of one that is held back without its readings, which are asked about."""
    assert outcome.settings is not None, "only what has settings is tried"
    trial = outcome.settings
    changed: dict[str, Any] = dict.fromkeys(("readings", "gate")) if outcome.faults else {}
    if DEPTH in outcome.stand_ins:
        # Upright walls hold whatever the depth is.
        changed["crack"] = CrackShape(depth_mm=NEEDED[DEPTH][0], tilt="vertical")
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
    """Trace and check the trials in ``place``; a lab's ``catalogue`` keeps what was found and spares a second check."""
    planned = [PlannedPhoto(place / name / TRIAL, f"{name}/{RUN}", {}) for name in tried]
    if not planned:
        return Batch(place), []
    batch = digitise_many(planned, place, progress, jobs, missed, held=True)
    progress.start(f"Checking {len(batch.rows)} trials", len(batch.rows))
    faults = list[CatalogueFault]()
    for number, row in enumerate(batch.rows, start=1):
        name = row.folder.removesuffix(f"/{RUN}")
        state = state_of(place / name)
        if row.status != "ok":
            told = [row.reason.replace(CHOICE, f"a 2 in the column crack of {PAIRING}")]
        elif catalogue is not None and catalogue.content.checked.get(name) == (state, []):
            told = []
        else:
            told = [] if DEPTH in tried[name].stand_ins else _told(place / name / RUN)
        # Files are named as the lab knows them.
        for raw in tried[name].raw:
            told = [sentence.replace(f"{place / name / raw.kept_as}", raw.original) for sentence in told]
        if catalogue is not None:
            catalogue.content.checked[name] = (state, told)
        tried[name].ask(PICTURE.sub("", sentence) if catalogue is None else sentence for sentence in told)
        faults += [CatalogueFault(tried[name].sample.name, sentence) for sentence in told]
        progress.advance(number, row.folder)
    return batch, faults


def _told(run: Path) -> list[str]:
    """Return what keeps a traced trial from its run, and what its readings may not have meant in that crack."""
    source = run.parent
    trial = load_trial(source / TRIAL)
    try:
        facts_above(trial, source)
        with open_folder(run, create=True) as opened:
            return list(check_run(start_job(trial, source, opened, "cpu", Progress())))
    except InputError as fault:
        return str(fault).splitlines()
