"""Run the sound samples of a lab, several at a time. Each has its own run folder, in which a killed run continues."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from sealtwin.core import files, record_files
from sealtwin.core.cluster import Lost
from sealtwin.core.errors import InputError, SealtwinError
from sealtwin.core.progress import Progress
from sealtwin.lab.catalogue import RUN, Catalogue, Record, read_run
from sealtwin.lab.files import TRIAL
from sealtwin.study.estimate import SETUP_S, RunSize, checked_size
from sealtwin.study.extra_runs import by_studies
from sealtwin.study.photos import write_trace
from sealtwin.study.runner import Computing, launch
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.job import STAGES
from sealtwin.trial.pipeline import run_trial
from sealtwin.trial.simulate_stage import PROGRESS
from sealtwin.trial.trial_file import load_trial
from validate.readings.names import sample_key

REPORT_S = 4.0  # Time to compare a run and to draw its report, on one core


@dataclass(frozen=True)
class SampleRun:
    """Result of one sample."""

    name: str
    state: Literal["done", "up to date", "failed", "left out"]
    folder: str | None = None  # Folder of its trial, in the lab
    mean_error_mm: float | None = None  # None without readings
    passed: bool | None = None  # Result of the gate; None if the trial has none
    report: str | None = None
    reason: str | None = None  # Why it failed, or was left out
    warnings: tuple[str, ...] = ()
    bug: bool = False
    wall_s: float = 0.0


def run_samples(lab: Path, how: Computing, progress: Progress) -> list[SampleRun]:
    """Run the latest trial of each sound sample, and return the results of all samples.

    Finished runs are not computed again. Samples with open questions are left out. A run that fails does not stop the
    others. Raises InputError if the folder is not a lab.
    """
    catalogue = Catalogue.of(lab)
    faults = catalogue.faults()
    left_out = [
        SampleRun(first.name, "left out", reason=" ".join(fault.sentence for fault in (first, *others)))
        for first, *others in faults.values()
    ]
    trials = [record for record in catalogue.latest if record.sample not in faults]
    return sorted([*_run_all(lab, trials, how, progress), *left_out], key=lambda one: sample_key(one.name))


def run_in_worker(lab: Path, record: Record, device: str) -> list[SampleRun]:
    """Run one sample in its own folder. The list has one entry."""
    began, progress, trial_folder = time.monotonic(), Progress(), lab / record.folder
    try:
        trial = load_trial(trial_folder / TRIAL)
        finished = run_trial(trial, trial_folder, trial_folder / RUN, STAGES, device, progress, above=by_studies())
    except Exception as fault:
        # A bug in one run must not stop the others; the command ends with code 1.
        bug, reason = not isinstance(fault, SealtwinError | OSError), f"{fault}"
        if bug:
            reason = f"{type(fault).__name__}: {fault}. A bug: please report {write_trace(trial_folder / RUN)}."
        wall_s = time.monotonic() - began
        return [SampleRun(record.name, "failed", record.folder, reason=reason, bug=bug, wall_s=wall_s)]
    comparison = finished.result.comparison
    return [
        SampleRun(
            record.name,
            "done" if finished.redone else "up to date",
            record.folder,
            mean_error_mm=comparison and comparison.mean_error_mm,
            passed=comparison and comparison.passed,
            report=finished.result.report,
            warnings=tuple(text.removeprefix("note: ") for text in progress.warned),
            wall_s=time.monotonic() - began,
        )
    ]


def _run_all(lab: Path, trials: Sequence[Record], how: Computing, progress: Progress) -> list[SampleRun]:
    if not trials:
        return []
    results, records = dict[str, SampleRun](), {record.folder: record for record in trials}

    def keep(run: StudyRun, result: SampleRun | Lost) -> StudyRun:
        if isinstance(result, Lost):
            name, reason = records[run.key].name, f"{result.reason}: give fewer --jobs."
            result = SampleRun(name, "failed", run.key, reason=reason)
        results[run.key] = result
        return replace(run, state="failed" if result.state == "failed" else "done", wall_s=result.wall_s)

    sizes = {key: _size(lab, record) for key, record in records.items()}
    runs = [StudyRun(at, key, {}, {}, key, key, size.work_s) for at, (key, size) in enumerate(sizes.items(), start=1)]
    work = run_in_worker, lambda group: (lab, records[group[0].key], how.device), keep
    began_s = time.time()
    launch(runs, how, "Running", progress, work, left_s=lambda run: _left_s(lab / run.key / RUN / PROGRESS, began_s))
    return list(results.values())


def _left_s(path: Path, began_s: float) -> float | None:
    """Return the time that a run needs still, as it has written it, or None if it has not."""
    try:
        return files.read_json(path)["eta_s"] if path.stat().st_mtime > began_s else None
    except (InputError, OSError, KeyError, TypeError):
        return None


def _size(lab: Path, record: Record) -> RunSize:
    """Return the size of a run; that of nothing to compute if it is finished, or if its worker will report a fault."""
    folder = lab / record.folder
    try:
        result = read_run(lab, record)
        if result is None or set(STAGES) - set(result.stages):
            trial = load_trial(folder / TRIAL).loaded(folder)
            size, _ = checked_size(trial, record_files.read_sample(folder / RUN))
            return replace(size, work_s=size.work_s + REPORT_S)
    except (InputError, OSError):
        pass
    return RunSize(0, 0, SETUP_S)
