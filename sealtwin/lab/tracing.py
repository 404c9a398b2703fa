"""The walls of a lab's samples, traced at once after an ingest: to be seen before anything is run."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from sealtwin.errors import InputError
from sealtwin.lab import telling
from sealtwin.lab.catalogue import Fault
from sealtwin.lab.ingest import Ingested
from sealtwin.lab.keeping import TRIAL
from sealtwin.photos.batch import BUG, SOME_FAILED, Planned, Report, Row, digitise_many
from sealtwin.progress import Progress
from sealtwin.store import files, stage_files
from sealtwin.trials.trial import load_trial


def trace(ingested: Ingested, progress: Progress, jobs: int = 1) -> Report:
    """Digitise every trial that ``ingested`` took in or found sound, into the folder that its run goes on in.

    What is done already is not done again; a fault in one costs no other. A contact sheet of all lies on top of the
    lab, photos of samples that were held back among them. With its crack's length known, a trial's readings are looked
    at once more. Raises InputError where the lab holds another's contact sheet.
    """
    lab = ingested.lab
    trials = [outcome.trial for outcome in ingested.outcomes if outcome.trial is not None]
    planned = [Planned(lab / trial / TRIAL, f"{trial}/{telling.RUN}", {}) for trial in trials]
    if not planned:
        return Report({"version": 1, "photos": [], "failed": 0, "exit_code": 0}, ["No sample to trace."], 0)
    report = digitise_many(planned, lab, progress, jobs, _held_back(ingested))
    done = [photo["folder"] for photo in report.content["photos"] if photo["status"] == "ok"]
    outside = [fault for folder in done for fault in _readings_outside(lab / folder)]
    if not outside:
        return report
    content: dict[str, Any] = {**report.content, "readings": [vars(fault) for fault in outside]}
    code = report.exit_code or SOME_FAILED
    lines = [*report.lines, *(f"failed: {fault.sentence}" for fault in outside)]
    return Report({**content, "exit_code": code}, lines, code)


def together(ingested: Ingested, traced: Report) -> Report:
    """What 'sealtwin ingest --digitise' says at its end."""
    codes = (telling.exit_code(ingested), traced.exit_code)
    code = BUG if BUG in codes else next((code for code in codes if code), 0)
    content = {**telling.content(ingested), "digitised": traced.content, "exit_code": code}
    return replace(traced, content=content, lines=[*telling.lines(ingested), "", *traced.lines], exit_code=code)


def _held_back(ingested: Ingested) -> list[Row]:
    """Photos of samples in which something is wrong: nobody would miss them on a page of the others."""
    return [
        Row(str(outcome.sample.files["photo"]), outcome.sample.name, "failed", reason=" ".join(outcome.faults))
        for outcome in ingested.outcomes
        if outcome.trial is None and "photo" in outcome.sample.files
    ]


def _readings_outside(run: Path) -> Iterator[Fault]:
    """What of a trial's readings cannot be in the crack that was found."""
    trial = load_trial(run.parent / TRIAL)
    if trial.readings is None:
        return
    from validate.caliper import read_readings

    depth_mm = float(files.read_json(run / "solid.json")["depth_mm"])
    try:
        read_readings(
            run.parent / trial.readings.file, trial.readings, stage_files.read_outline(run).length_mm, depth_mm
        )
    except InputError as fault:
        yield from (Fault(trial.name, sentence) for sentence in str(fault).splitlines())
