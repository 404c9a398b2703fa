"""Find which studies used a lab's readings for choosing settings, and which earlier trials can test the model."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import holding
from sealtwin.core.stage_keys import other_numbers
from sealtwin.lab.catalogue import RUN, Catalogue, Record, is_lab, read_run
from sealtwin.lab.found_files import TRIAL
from sealtwin.study.extra_runs import time_of_extra_runs
from sealtwin.study.seed_runs import announce_seeds, compute_other_seeds
from sealtwin.study.study_file import load_study
from sealtwin.trial.job import Above, Job, shown
from sealtwin.trial.stage_numbers import NUMBERS
from sealtwin.trial.trial_file import Trial, load_trial
from validate.metrics.verdict import kept_volume
from validate.readings.read_readings import read_readings
from validate.result import COMPARISON, EarlierTrial, read_comparison
from validate.settings import Readings

LEVELS = 3  # Folders to search upward for the lab, from that of a run: lab/P01/run
DECIMALS = 6  # Of a millimetre, as in the file of a profile; sheets have fewer


def uses(catalogue: Catalogue) -> tuple[dict[str, list[str]], list[str]]:
    """Return the studies and calibrated trials of a lab by the hash of the readings that they used.

    Also returns a caution about each trial that could not be read.
    """
    names_by_hash = {digest: sorted(names) for digest, names in catalogue.content.uses.items()}
    cautions = list[str]()
    for record in catalogue.records:
        path = catalogue.lab / record.folder / TRIAL
        try:
            readings = load_trial(path).readings if path.is_file() else None
            if readings is None or readings.role != "calibrated-on":
                continue
            use = f"calibration of sample '{record.name}', revision {record.revision},"
            names_by_hash.setdefault(_hash_of(path.parent, readings), []).append(use)
        except InputError as fault:
            # A fault in the sheet of another sample must not prevent this run.
            cautions.append(_caution(record, "cannot be read, so it may be calibrated on these readings", fault))
    return names_by_hash, cautions


def _caution(record: Record, what: str, fault: InputError) -> str:
    first, _, _ = str(fault).partition("\n")
    return f"caution: sample '{record.name}' {what}: {first}"


def _hash_of(folder: Path, readings: Readings) -> str:
    """Return the hash of a trial's readings. Raises InputError if they cannot be read."""
    return readings_hash(read_readings(folder / readings.file, readings))


def readings_hash(readings: Profile) -> str:
    """Return the hash of stations and levels; it does not depend on the file format or the order of the repeats."""
    repeats_mm = readings.level_mm[:, None] if readings.repeats_mm is None else readings.repeats_mm
    # Sorting puts missing readings last; columns without readings are dropped.
    repeats_mm = np.sort(repeats_mm, axis=1)
    repeats_mm = repeats_mm[:, ~np.isnan(repeats_mm).all(axis=0)]
    table = np.round(np.column_stack([readings.s_mm, repeats_mm]), DECIMALS) + 0.0
    return hashlib.sha256(table.astype("<f8").tobytes()).hexdigest()


def note_study(file: Path, settings: Mapping[str, Any] | None = None) -> None:
    """Record a study in the catalogue of the lab whose readings ranked its runs. Without a lab, nothing is recorded.

    ``settings``, by dotted name, replaced settings of the study's trial. Raises InputError if the study, its trial or
    the catalogue cannot be read.
    """
    study = load_study(file)
    base = file.parent / study.trial
    trial = load_trial(base, settings)
    if trial.readings is not None:
        sheet = base.parent / trial.readings.file
        note_use(sheet, read_readings(sheet, trial.readings), f"study '{study.name}'")


def note_use(sheet: Path, readings: Profile, what: str) -> None:
    """Record in the lab's catalogue that ``what`` used these readings for choosing settings.

    Nothing is recorded if ``sheet`` is not in a lab.
    """
    if (lab := lab_of(sheet.parent)) is not None:
        with holding(lab, lambda _: None):
            catalogue = Catalogue(lab)
            uses = catalogue.content.uses.setdefault(readings_hash(readings), [])
            if what not in uses:
                uses.append(what)
                catalogue.save()


def lab_of(folder: Path) -> Path | None:
    """Return the lab that is this folder or one of the two folders above it; None if none of the three is a lab."""
    folder = folder.resolve()
    return next((above for above in (folder, *folder.parents)[:LEVELS] if is_lab(above)), None)


def earlier_trials(catalogue: Catalogue, source: Path | None = None) -> tuple[tuple[EarlierTrial, ...], list[str]]:
    """Return the latest trial of each sample if it can test the model, and cautions on unreadable trials.

    Such a trial has a measured photo and measured readings that were held out and that no study has used since. Its
    level was simulated with particles that kept their volume, and its files were not edited. The sample whose folder is
    ``source``, or contains the run folder ``source``, is excluded. Of samples with equal readings only the first is
    returned.
    """
    here = None if source is None else {source.resolve(), source.resolve().parent}
    own = {one.sample for one in catalogue.records if here and (catalogue.lab / one.folder).resolve() in here}
    latest = {record.sample: record for record in catalogue.records if record.sample not in own}
    by_readings: dict[str, EarlierTrial] = {}
    cautions: list[str] = []
    for record in latest.values():
        try:
            if (counts := _counts(catalogue.lab, record)) is not None:
                by_readings.setdefault(*counts)
        except InputError as fault:
            cautions.append(_caution(record, "is left out of the earlier trials", fault))
    chosen_by = uses(catalogue)[0] if by_readings else {}
    return tuple(trial for digest, trial in by_readings.items() if digest not in chosen_by), cautions


def _counts(lab: Path, record: Record) -> tuple[str, EarlierTrial] | None:
    """Return the hash of the trial's readings, and the trial as an earlier trial; None if it cannot test the model."""
    result, run = read_run(lab, record), lab / record.folder / RUN
    if result is None or result.edited or not (run / COMPARISON).is_file():
        return None
    comparison = read_comparison(run)
    simulation = record_files.read_simulation(run)
    measured = comparison.photo_data == comparison.readings_data == "measured"
    if comparison.role != "held-out" or not measured or not simulation.has_particles:
        return None
    if simulation.escaped_particles or not kept_volume(simulation.volume_ratio):
        return None
    readings = load_trial(run / TRIAL).readings
    if readings is None:
        return None
    if other := other_numbers(result.numbers, NUMBERS):
        raise InputError(f"{run}: was computed by {other}. Compute it again with 'sealtwin run' and its trial.")
    length_mm = comparison.covered_length_mm
    return _hash_of(run, readings), EarlierTrial(
        name=record.name,
        level_error_mm=comparison.bias_mm,
        computed_fill_ratio=comparison.simulated_fill_ratio,
        read_fill_ratio=comparison.measured_fill_ratio,
        computed_heap_mm2=comparison.simulated_overfill_mm3 / length_mm,
        read_heap_mm2=comparison.measured_overfill_mm3 / length_mm,
    )


def facts_above(trial: Trial, source: Path, *, compared: bool = True, jobs: int = 0) -> Above:
    """Return the facts that the lab and its studies add to a trial whose files are in ``source``.

    ``jobs`` is the number of worker processes of extra runs; 0 computes them in this process. If a part of the lab
    cannot be read, the facts contain a caution and the lab counts as not searched. Raises InputError if ``compared`` is
    True and the trial declares its readings as held out, although a study or a calibration of the lab used them for
    choosing settings.
    """
    searched, cautions = False, list[str]()
    readings, lab = trial.readings, lab_of(source)
    held_out = readings if compared and readings is not None and readings.role == "held-out" else None
    if held_out is not None and lab is not None and (source / held_out.file).is_file():
        names_by_hash, cautions = uses(Catalogue(lab))
        if used := names_by_hash.get(_hash_of(source, held_out)):
            raise InputError(
                f'{source / TRIAL}: readings.role is "held-out", but the {used[0]} of {shown(lab)} used these readings '
                'to choose settings. Set readings.role = "calibrated-on".'
            )
        searched = not cautions
    return Above(
        lab_searched=searched,
        extra_runs=_time_of_extra_runs,
        cautions=tuple(cautions),
        earlier=_earlier_trials,
        other_seeds=compute_other_seeds,
        announce_seeds=announce_seeds,
        jobs=jobs,
    )


def _time_of_extra_runs(job: Job) -> str:
    trial = job.trial
    return "" if trial.readings is None and not trial.uncertainty.moved else time_of_extra_runs(job)


def _earlier_trials(job: Job) -> tuple[EarlierTrial, ...]:
    if (lab := lab_of(job.source)) is None:
        return ()
    trials, cautions = earlier_trials(Catalogue(lab), job.source)
    for caution in cautions:
        job.progress.warn(caution)
    return trials
