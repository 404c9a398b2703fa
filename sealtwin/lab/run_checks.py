"""Checks of trials that were taken in: all that a run makes before its first frame, so that what is sound does run."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import holding, open_folder
from sealtwin.lab.catalogue import RUN, Catalogue, CatalogueFault
from sealtwin.lab.found_files import TRIAL
from sealtwin.lab.held_out import facts_above
from sealtwin.lab.ingest import Ingested, write_trial
from sealtwin.photos.batch import Batch, BatchRow, PlannedPhoto, digitise_many
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import check_run
from sealtwin.trial.trial_file import folder_name, load_trial

PICTURE = re.compile(r" Look at \S+\.png\.")


def check_runs(
    ingested: Ingested, folder: Path, progress: Progress, jobs: int = 1
) -> tuple[Batch, list[CatalogueFault]]:
    """Trace every trial that was taken in or is sound from ``folder``, and check it as its run would.

    Trials are traced into the folders that their runs go on in, and a contact sheet of all lies on top of the lab,
    photos of samples that were held back among them; a dry run leaves nothing. What is traced already is not traced
    again; a fault in one costs no other. Raises InputError where the lab holds another's contact sheet.
    """
    with _trials(ingested, folder, progress) as (place, trials):
        planned = [PlannedPhoto(place / trial / TRIAL, f"{trial}/{RUN}", {}) for trial in trials]
        if not planned:
            return Batch(ingested.lab), []
        # Nobody would miss them on a page of the others.
        held_back = [
            BatchRow(str(outcome.sample.files["photo"]), outcome.sample.name, "failed", reason=" ".join(outcome.faults))
            for outcome in ingested.outcomes
            if outcome.fate in ("failed", "bug") and "photo" in outcome.sample.files
        ]
        batch = digitise_many(planned, place, progress, jobs, held_back, held=True)
        progress.start(f"Checking {len(batch.done)} trials", len(batch.done))
        faults = list[CatalogueFault]()
        for number, row in enumerate(batch.done, start=1):
            faults += _faults(place / row.folder, ingested)
            progress.advance(number, row.folder)
        faults += [CatalogueFault(row.folder.removesuffix(f"/{RUN}"), row.reason) for row in batch.failed]
        if ingested.dry_run:
            told = [(fault.name, PICTURE.sub("", fault.sentence)) for fault in faults]
            faults = [CatalogueFault(name, text.replace(f"{place}/", "")) for name, text in told]
        return batch, faults


@contextmanager
def _trials(ingested: Ingested, folder: Path, progress: Progress) -> Iterator[tuple[Path, list[str]]]:
    """Yield the folder of the trials and their names; those of a dry run are there while they are checked."""
    if not ingested.dry_run:
        with holding(ingested.lab, progress.note):
            yield ingested.lab, [outcome.trial for outcome in ingested.outcomes if outcome.trial is not None]
        return
    with tempfile.TemporaryDirectory() as scratch:
        fresh = {
            folder_name(outcome.sample.name): outcome
            for outcome in ingested.outcomes
            if outcome.fate in ("new", "revised") and outcome.settings is not None
        }
        for name, outcome in fresh.items():
            write_trial(outcome, folder, Path(scratch) / name)
        yield Path(scratch), list(fresh)


def _faults(run: Path, ingested: Ingested) -> list[CatalogueFault]:
    """Return what keeps a traced trial from its run, and what its readings may not have meant in that crack."""
    source = run.parent
    trial = load_trial(source / TRIAL)
    known, checked = f"runs {source.name}", f"{files.sha256(source / TRIAL)} {version('sealtwin')}"
    if not ingested.dry_run and _fact(ingested.lab, known) == checked:
        return []
    try:
        facts_above(trial, source)
        with open_folder(run, create=True) as opened:
            told = check_run(start_job(trial, source, opened, "cpu", Progress()))
    except InputError as fault:
        told = tuple(str(fault).splitlines())
    if not told and not ingested.dry_run:
        with Catalogue.of(ingested.lab) as catalogue:
            catalogue.state_fact(known, checked)
    return [CatalogueFault(trial.name, sentence) for sentence in told]


def _fact(lab: Path, name: str) -> str | None:
    with Catalogue.of(lab) as catalogue:
        return catalogue.fact(name)
