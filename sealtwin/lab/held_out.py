"""Readings that helped to choose something: the studies and calibrations that a lab's catalogue names."""

import hashlib
from pathlib import Path

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import holding
from sealtwin.lab.catalogue import Catalogue, is_lab
from sealtwin.study.extra_time import time_of_extra_runs
from sealtwin.study.study_file import load_study
from sealtwin.trial.job import Above, Job, shown
from sealtwin.trial.trial_file import Trial, load_trial
from validate.readings.read_readings import read_readings

TRIAL = "trial.toml"
LEVELS = 3  # Folders from a run's or a sheet's own up to the lab's: lab/P01/run
DECIMALS = 6  # Of a millimetre, as of a profile's file; no sheet has as many


def facts_above(trial: Trial, source: Path, *, compared: bool = True) -> Above:
    """Return what the lab and the studies know of a trial whose files lie in ``source``.

    What of the lab could not be searched is a caution, and is no search. Raises InputError, naming the study or the
    calibration, where it is ``compared`` with readings that it declares held out, and the lab used to choose.
    """
    searched, cautions = False, list[str]()
    held, lab = trial.readings, _lab_of(source)
    if compared and held is not None and held.role == "held-out" and lab is not None and (source / held.file).is_file():
        digest, catalogue = readings_hash(read_readings(source / held.file, held)), Catalogue(lab)
        calibrations, cautions = _calibrations(catalogue, digest)
        if used := [*sorted(catalogue.uses.get(digest, [])), *calibrations]:
            raise InputError(
                f'{source / TRIAL}: readings.role = "held-out", but the {used[0]} of {shown(lab)} used these readings '
                'to choose; write "calibrated-on".'
            )
        searched = not cautions
    return Above(lab_searched=searched, extra_runs=_time_of_extra_runs, cautions=tuple(cautions))


def readings_hash(readings: Profile) -> str:
    """Return the hash of the levels and their stations, whatever file they are in and in whatever order the repeats."""
    repeats_mm = readings.level_mm[:, None] if readings.repeats_mm is None else readings.repeats_mm
    # Missing readings come last, and a column of nothing else is none.
    repeats_mm = np.sort(repeats_mm, axis=1)
    repeats_mm = repeats_mm[:, ~np.isnan(repeats_mm).all(axis=0)]
    table = np.round(np.column_stack([readings.s_mm, repeats_mm]), DECIMALS) + 0.0
    return hashlib.sha256(table.astype("<f8").tobytes()).hexdigest()


def note_study(file: Path) -> None:
    """Let the lab's catalogue name a study that ranked its runs by readings of the lab; other studies are not noted.

    Raises InputError if the study, its trial or the catalogue cannot be read.
    """
    study = load_study(file)
    base = file.parent / study.trial
    trial = load_trial(base)
    if trial.readings is not None:
        sheet = base.parent / trial.readings.file
        note_use(sheet, read_readings(sheet, trial.readings), f"study '{study.name}'")


def note_use(sheet: Path, readings: Profile, what: str) -> None:
    """Let the catalogue of the lab that a sheet lies in name what ranked its runs by these readings of it."""
    if (lab := _lab_of(sheet.parent)) is not None:
        with holding(lab, lambda _: None):
            catalogue = Catalogue(lab)
            uses = catalogue.uses.setdefault(readings_hash(readings), [])
            if what not in uses:
                uses.append(what)
                catalogue.save()


def _lab_of(folder: Path) -> Path | None:
    """Return the lab that a folder lies in, or None."""
    folder = folder.resolve()
    return next((above for above in (folder, *folder.parents)[:LEVELS] if is_lab(above)), None)


def _calibrations(catalogue: Catalogue, digest: str) -> tuple[list[str], list[str]]:
    """Return the names of the lab's trials that are calibrated on readings with that hash, and what was not read."""
    found, cautions = list[str](), list[str]()
    for record in catalogue.records:
        path = catalogue.lab / record.folder / TRIAL
        try:
            readings = load_trial(path).readings if path.is_file() else None
            if readings is None or readings.role != "calibrated-on":
                continue
            own = readings_hash(read_readings(path.parent / readings.file, readings))
        except InputError as fault:
            # Another sample's sheet must not keep this one from its run.
            why = str(fault).partition("\n")[0]
            cautions.append(f"caution: sample '{record.name}' may be calibrated on these readings: {why}")
            continue
        if own == digest:
            found.append(f"calibration of sample '{record.name}', revision {record.revision},")
    return found, cautions


def _time_of_extra_runs(job: Job) -> str:
    trial = job.trial
    return "" if trial.readings is None and not trial.uncertainty.moved else time_of_extra_runs(job)
