"""Run the sound samples of a lab, several at a time. Each has its own run folder, in which a killed run continues."""

import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from sealtwin.core import files, record_files
from sealtwin.core.cluster import Lost
from sealtwin.core.errors import InputError, SealtwinError
from sealtwin.core.progress import Progress
from sealtwin.lab.catalogue import RUN, Catalogue, Record, read_run
from sealtwin.lab.files import TRIAL
from sealtwin.study.estimate import SETUP_S, size_of
from sealtwin.study.photos import write_trace
from sealtwin.study.pipeline import run_trial
from sealtwin.study.runner import StudyOptions, launch
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.job import STAGES
from sealtwin.trial.simulate_stage import PROGRESS
from sealtwin.trial.trial_file import load_trial
from validate.readings.words import sample_key

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


def run_samples(lab: Path, options: StudyOptions, progress: Progress) -> list[SampleRun]:
    """Run the latest trial of each sound sample, and return the results of all samples.

    Finished runs are not computed again. Samples with open questions are left out. A run that fails does not stop the
    others. Raises InputError if the folder is not a lab.
    """
    catalogue = Catalogue.of(lab)
    faults = catalogue.faults()
    results = [
        SampleRun(each[0].name, "left out", reason=" ".join(fault.sentence for fault in each))
        for each in faults.values()
    ]
    records = {record.folder: record for key, record in catalogue.latest.items() if key not in faults}

    def keep(run: StudyRun, result: SampleRun | Lost) -> StudyRun:
        if isinstance(result, Lost):
            result = SampleRun(records[run.key].name, "failed", run.key, reason=f"{result.reason}: give fewer --jobs.")
        results.append(result)
        return replace(run, state="failed" if result.state == "failed" else "done", wall_s=result.wall_s)

    def left_s(run: StudyRun) -> float | None:
        """Return the time that a run needs still, as it has written it, or None if it has not."""
        with suppress(InputError, OSError, KeyError, TypeError):
            return files.read_json(lab / run.key / RUN / PROGRESS)["eta_s"]

    runs = [
        StudyRun(number, key, {}, {}, key, key, _work_s(lab, record))
        for number, (key, record) in enumerate(records.items(), start=1)
    ]
    work = run_in_worker, lambda group: (lab, records[group[0].key], options.device), keep
    launch(runs, options, "Running", progress, work, left_s=left_s)
    return sorted(results, key=lambda result: sample_key(result.name))


def run_in_worker(lab: Path, record: Record, device: str) -> list[SampleRun]:
    """Run one sample in its own folder. The list has one entry."""
    began, progress, folder = time.monotonic(), Progress(), lab / record.folder
    result = SampleRun(record.name, "failed", record.folder)
    try:
        trial = load_trial(folder / TRIAL)
        finished = run_trial(trial, folder, folder / RUN, STAGES, device, progress)
    except (SealtwinError, OSError) as fault:
        result = replace(result, reason=f"{fault}")
    except Exception as fault:
        # A bug in one run must not stop the others; the command ends with code 1.
        reason = f"{type(fault).__name__}: {fault}. A bug: please report {write_trace(folder / RUN)}."
        result = replace(result, reason=reason, bug=True)
    else:
        comparison = finished.result.comparison
        result = replace(
            result,
            state="done" if finished.redone else "up to date",
            mean_error_mm=comparison and comparison.mean_error_mm,
            passed=comparison and comparison.passed,
            report=finished.result.report,
            warnings=tuple(warning.text for warning in progress.warned),
        )
    return [replace(result, wall_s=time.monotonic() - began)]


def _work_s(lab: Path, record: Record) -> float:
    """Return the computing time of a run by the model; little if it is finished, or if its worker reports a fault."""
    folder = lab / record.folder
    with suppress(InputError, OSError):
        result = read_run(lab, record)
        if result is None or set(STAGES) - set(result.stages):
            trial = load_trial(folder / TRIAL).loaded(folder)
            return size_of(trial.pour(record_files.read_sample(folder / RUN))).work_s + REPORT_S
    return SETUP_S
