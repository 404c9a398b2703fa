"""The trials of a lab that show how far the model is off: measured, held out, and run to their report."""

from pathlib import Path

from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.stage_keys import other_numbers
from sealtwin.lab.catalogue import RUN, Catalogue, Record, read_run
from sealtwin.lab.held_out import TRIAL, readings_hash, uses
from sealtwin.trial.stage_numbers import NUMBERS
from sealtwin.trial.trial_file import load_trial
from validate.metrics.verdict import kept_volume
from validate.readings.read_readings import read_readings
from validate.result import COMPARISON, EarlierTrial, read_comparison


def earlier_trials(catalogue: Catalogue, source: Path | None = None) -> tuple[tuple[EarlierTrial, ...], list[str]]:
    """Return the latest trial of each sample that counts, and cautions on those that could not be read.

    A trial counts where photo and readings are measured, these were held out and chose nothing since, and particles
    that kept their volume made its level, in files that nobody edited. The sample whose files lie in ``source``, or in
    a run folder there, is none of them, and nor is one with the readings of another.
    """
    here = None if source is None else {source.resolve(), source.resolve().parent}
    own = {one.sample for one in catalogue.records if here and (catalogue.lab / one.folder).resolve() in here}
    latest = {record.sample: record for record in catalogue.records if record.sample not in own}
    found: dict[str, EarlierTrial] = {}
    cautions: list[str] = []
    for record in latest.values():
        try:
            if (counts := _counts(catalogue.lab, record)) is not None:
                found.setdefault(*counts)
        except InputError as fault:
            why = str(fault).partition("\n")[0]
            cautions.append(f"caution: sample '{record.name}' is not among the earlier trials: {why}")
    chosen_by = uses(catalogue)[0] if found else {}
    return tuple(trial for digest, trial in found.items() if digest not in chosen_by), cautions


def _counts(lab: Path, record: Record) -> tuple[str, EarlierTrial] | None:
    """Return the hash of the readings and the trial; None where it does not count."""
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
        raise InputError(f"{run}: computed by {other}. 'sealtwin run' with its trial computes it anew.")
    length_mm = comparison.covered_length_mm
    return readings_hash(read_readings(run / readings.file, readings)), EarlierTrial(
        name=record.name,
        level_error_mm=comparison.bias_mm,
        computed_fill_ratio=comparison.simulated_fill_ratio,
        read_fill_ratio=comparison.measured_fill_ratio,
        computed_heap_mm2=comparison.simulated_overfill_mm3 / length_mm,
        read_heap_mm2=comparison.measured_overfill_mm3 / length_mm,
    )
