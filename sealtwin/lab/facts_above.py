"""Facts on a trial that only its lab and the studies have."""

from pathlib import Path

from sealtwin.core.errors import InputError
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.earlier_trials import earlier_trials
from sealtwin.lab.held_out import TRIAL, lab_of, readings_hash, uses
from sealtwin.study.extra_runs import time_of_extra_runs
from sealtwin.trial.job import Above, Job, shown
from sealtwin.trial.trial_file import Trial
from validate.readings.read_readings import read_readings
from validate.result import EarlierTrial


def facts_above(trial: Trial, source: Path, *, compared: bool = True) -> Above:
    """Return the facts of lab and studies on a trial whose files are in ``source``.

    A part of the lab that cannot be read is a caution; the lab then counts as not searched. Raises InputError, naming
    the study or the calibration, if the trial is ``compared`` with readings that it declares held out, and that the lab
    used to choose.
    """
    searched, cautions = False, list[str]()
    held, lab = trial.readings, lab_of(source)
    if compared and held is not None and held.role == "held-out" and lab is not None and (source / held.file).is_file():
        found, cautions = uses(Catalogue(lab))
        if used := found.get(readings_hash(read_readings(source / held.file, held))):
            raise InputError(
                f'{source / TRIAL}: readings.role = "held-out", but the {used[0]} of {shown(lab)} used these readings '
                'to choose; write "calibrated-on".'
            )
        searched = not cautions
    return Above(
        lab_searched=searched, extra_runs=_time_of_extra_runs, cautions=tuple(cautions), earlier=_earlier_trials
    )


def _time_of_extra_runs(job: Job) -> str:
    trial = job.trial
    return "" if trial.readings is None and not trial.uncertainty.moved else time_of_extra_runs(job)


def _earlier_trials(job: Job) -> tuple[EarlierTrial, ...]:
    if (lab := lab_of(job.source)) is None:
        return ()
    found, cautions = earlier_trials(Catalogue(lab), job.source)
    for caution in cautions:
        job.progress.warn(caution)
    return found
