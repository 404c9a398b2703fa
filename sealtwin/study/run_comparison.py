"""Compare finished runs in a table: their figures, the settings that differ, and the nearest one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, texts
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import UNNUMBERED, look_into
from sealtwin.trial.job import (
    DIGITISED,
    SEEDS,
    SIMULATED,
    STAGES,
    TRIAL,
    Job,
    display_path,
    made_by,
    other_versions,
    start_job,
)
from sealtwin.trial.trial_file import load_trial
from sealtwin.trial.validate_stage import read_level, readings_of
from validate.metrics.verdict import SOUND, beside_baselines, kept_volume
from validate.result import COMPARISON, Comparison, read_comparison
from validate.run_facts import facts_of_runs, run_warnings

NOT_SETTINGS = ("name", "note", "assumed", "output")  # Keys and tables of a trial that do not change the result
SAME_MM = 0.01
"""Largest difference in mm, at any station, between copies of the same readings: the last digit of a caliper. Repeated
readings differ by ten times as much."""
STAGE_NUMBER = "stage_number."  # Prefix of the stage numbers among the settings


@dataclass(frozen=True)
class Side:
    """One run of the comparison."""

    name: str  # Name of the trial, and the run folder
    settings: Mapping[str, Any]  # Settings and stage numbers by dotted name
    profile: Profile
    readings: Profile | None
    comparison: Comparison | None  # None without readings
    volume_ratio: float  # Settled volume, divided by the dispensed volume
    escaped_particles: int = 0  # Number of particles that went through a wall
    edited: Sequence[str] = ()  # Names of its files that were changed after the run
    fluid_warnings: Sequence[Fact] = ()  # Faults of its fluid

    @property
    def unranked(self) -> str:
        """Reasons why the run is not ranked. Empty if it is ranked."""
        low, high = SOUND
        reasons = {
            f"files were edited by hand after the run ({', '.join(self.edited)})": self.edited,
            "particles went through a wall": self.escaped_particles,
            f"{self.volume_ratio:.3f} of the dispensed volume settled ({low:g} to {high:g} is sound)": not kept_volume(
                self.volume_ratio
            ),
        }
        return " and ".join(reason for reason, applies in reasons.items() if applies)


Sides = Sequence[Side]


def compare_runs(folders: Sequence[Path]) -> dict[str, Any]:
    """Return the figures of each run, the settings that differ, and a sentence about the nearest run.

    Raises InputError if a folder is not a finished run, or if settings or files of a run were changed after the results
    were written.
    """
    jobs = [_finished(folder) for folder in folders]
    sides = [_side(job) for job in jobs]
    by_run = {number: side.fluid_warnings for number, side in enumerate(sides, start=1)}
    return {
        "finding": ranking(sides),
        "runs": [_row(number, side, sides) for number, side in enumerate(sides, start=1)],
        "differing": differing(sides),
        "other_versions": other_versions(*(job.folder for job in jobs)),
        "fluid_warnings": texts(facts_of_runs(by_run, len(sides))),
    }


def differing(sides: Sides) -> dict[str, list[Any]]:
    """Return the settings that differ among the runs, with each run's value. It is None if a run does not set it."""
    by_name = {name: [side.settings.get(name) for side in sides] for side in sides for name in side.settings}
    return {name: values for name, values in by_name.items() if any(value != values[0] for value in values)}


def first_with_readings(sides: Sides) -> list[int | None]:
    """Return for each run the index of the first run with the same readings, or None for a run without readings.

    Readings with equal numbers count as the same, even if their sheets differ.
    """
    return [next((first for first, other in enumerate(sides) if _same(other.readings, side.readings)), None)
            for side in sides]  # fmt: skip


def _same(first: Profile | None, second: Profile | None) -> bool:
    if first is None or second is None or len(first.s_mm) != len(second.s_mm):
        return False
    numbers = ([readings.s_mm, readings.level_mm] for readings in (first, second))
    return np.allclose(*numbers, rtol=0, atol=SAME_MM)


def ranking(sides: Sides) -> str:
    """Return a sentence that names the ranked run with the smallest mean error, or says why none is named.

    Runs with different readings are not ranked, because some readings are easier to fit than others.
    """
    ranked = {
        number: side.comparison
        for number, side in enumerate(sides, start=1)
        if side.comparison is not None and not side.unranked
    }
    if not ranked:
        return "No run with readings is ranked, so none is nearest."
    if any(name.startswith(STAGE_NUMBER) for name in differing(sides)):
        return "The runs have different stage numbers, so none is nearest."
    if len({first_with_readings(sides)[number - 1] for number in ranked}) > 1:
        return "The runs have different readings, so none is nearest."
    best = min(ranked, key=lambda number: ranked[number].mean_error_mm)
    return f"Run {best} is nearest to the readings: {sides[best - 1].name}. {beside_baselines(ranked[best])}"


def _row(number: int, side: Side, sides: Sides) -> dict[str, Any]:
    """Return the figures of one run. Figures of the comparison are None without readings."""
    first, m = first_with_readings(sides)[number - 1], side.comparison
    same = f", the same as for run {first + 1}" if first is not None and first + 1 < number else ""
    return {
        "number": number,
        "name": side.name,
        "readings": m and f"{m.readings_data}, {m.role}{same}",
        "mean_error_mm": m and m.mean_error_mm,
        "interval_95_mm": m and m.interval_95_mm,
        "bias_mm": m and m.bias_mm,
        "worst_error_mm": m and m.errors.worst_error_mm,
        "beats_baseline": m and m.beats_baseline,
        "volume_ratio": side.volume_ratio,
        "not_ranked": side.unranked or None,
    }


def _finished(folder: Path) -> Job:
    """Read a run, and check its files with the manifest, as 'sealtwin validate' does."""
    run = look_into(folder)
    job = start_job(load_trial(run.path / TRIAL), run.path, run, "cpu", Progress())
    made_by(job, "digitise", DIGITISED)
    made_by(job, "simulate", SIMULATED)
    if job.trial.readings is not None:
        made_by(job, "validate", [COMPARISON])
        if changed := job.folder.changed_since("validate"):
            raise InputError(
                f"{job.path}: {changed[0]} was changed after the readings were compared. Run 'sealtwin validate "
                f"{job.path}' again."
            )
    return job


def _side(job: Job) -> Side:
    readings, (profile, seeds) = readings_of(job), read_level(job)
    run = record_files.read_simulation(job.path)
    with files.reading_stage_file(job.path / "simulation.json"):
        volume_ratio = run.volume_ratio
    stages = STAGES if readings is not None else STAGES[:-1]
    numbers = {STAGE_NUMBER + stage: job.folder.numbers_of(stage).get(stage, UNNUMBERED) for stage in stages}
    return Side(
        name=f"{job.trial.name} ({display_path(job.path)})",
        settings=_flat(job.trial.model_dump(mode="json", exclude=set(NOT_SETTINGS))) | numbers,
        profile=profile,
        readings=readings,
        comparison=None if readings is None else read_comparison(job.path),
        volume_ratio=volume_ratio,
        escaped_particles=run.escaped_particles,
        fluid_warnings=run_warnings(run, volume_ratio, seeds),
        edited=[file for stage in (*STAGES, SEEDS) for file in job.folder.edited(stage)],
    )


def _flat(content: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Return the settings that are set, by dotted name. ``before`` is the prefix of the names."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{before}{key}.")
        elif value is not None:
            flat[f"{before}{key}"] = value
    return flat
