"""Runs of a trial with the seeds after its own, their mean level and its band: RUN/level.csv and RUN/seeds.json.

The runs are in RUN/seeds, a folder like a sweep's.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from sealtwin.core import files, record_files
from sealtwin.core.facts import Fact, without
from sealtwin.core.stage_keys import stage_key
from sealtwin.study import study_folder
from sealtwin.study.estimate import in_words, size_of
from sealtwin.study.moved_inputs import Base
from sealtwin.study.runner import Computing
from sealtwin.study.variants import Variant, compute_variants, inputs_of, with_seed
from sealtwin.trial.job import SEEDS, Job, clear, stage_settings
from sealtwin.trial.pipeline import REPORT_S, rounds_of_seeds
from sealtwin.trial.stage_numbers import numbers_up_to
from sealtwin.trial.validate_stage import OF_SEEDS, SEED_RUNS
from validate.result import SeedRuns
from validate.run_facts import facts_of_runs, fluid_warnings
from validate.uncertainty.computed import Z_95, further_run_mm2, require_different

FOLDER = "seeds"


def compute_other_seeds(job: Job) -> bool:
    """Bring the mean level of the trial's seeds up to date; return True if anything was computed.

    Raises:
        InputError: The trial's own run is not finished, or other stage numbers than this version's computed it; or two
            seeds gave the same level.
        NumericalError: A run failed. The message names it, and the same command tries it again.
    """
    from simulate.device import choose_device

    count, inputs = job.trial.seeds or 1, inputs_of(job)
    settings: dict[str, Any] = {**stage_settings(job.trial, "simulate"), "seeds": count}
    numbers = numbers_up_to("simulate")
    # Without the device: a report written on another machine keeps the levels that it finds.
    key = stage_key(inputs, settings, numbers)
    if job.folder.is_current(SEEDS, key):
        return False
    alone = job.trial.model_copy(update={"seeds": None, "readings": None, "gate": None})
    base, folder, device = Base.of(replace(job, trial=alone)), job.path / FOLDER, choose_device(job.device)
    others: list[Variant] = [({"seed": number}, with_seed(alone, number), base.sample) for number in range(1, count)]
    jobs = min(job.above.jobs, len(others)) if device == "cpu" else min(job.above.jobs, 1)
    how = Computing(device, jobs, later_s=REPORT_S)
    runs = compute_variants(folder, others, base, how, inputs, job.progress, SEEDS, f"the mean of {count} seeds")
    seeds = [job.trial.seed, *(int(run.trial["seed"]) for run in runs)]
    profiles = [base.profile, *(record_files.read_profile(study_folder.run_path(folder, run.key)) for run in runs)]
    s_mm = base.profile.s_mm
    levels_mm = np.array([np.interp(s_mm, profile.s_mm, profile.level_mm) for profile in profiles])
    require_different(levels_mm, [f"with seed = {seed}" for seed in seeds], str(job.path))
    half_mm = Z_95 * float(np.sqrt(further_run_mm2(levels_mm, count)))
    record = SeedRuns(
        seeds=tuple(seeds),
        mean_level_mm=float(np.trapezoid(levels_mm.mean(axis=0), s_mm) / np.ptp(s_mm)),
        scatter_mm=float(np.sqrt(levels_mm.var(axis=0, ddof=1).mean())),
        band_95_mm=half_mm,
        warnings=tuple(_other_warnings(job, base, runs)),
    )
    clear(job, SEEDS)
    record_files.write_level(job.path, s_mm, dict(zip(seeds, levels_mm, strict=True)), half_mm)
    files.write_json(job.path / SEED_RUNS, record.model_dump())
    wall_s = sum(run.wall_s or 0.0 for run in runs)
    job.folder.record(SEEDS, key, settings, inputs, OF_SEEDS, wall_s, numbers=numbers)
    return True


def announce_seeds(job: Job) -> None:
    """Note the expected time of the runs with all seeds, unless the first is finished."""
    if "simulate" not in job.folder.finished():
        whole_s = size_of(job.trial, record_files.read_sample(job.path)).work_s * (1 + rounds_of_seeds(job))
        job.progress.note(
            f"{job.trial.seeds} runs, with seeds from {job.trial.seed}: about {in_words(whole_s + REPORT_S)} in all, "
            "from a model; the first run will correct it."
        )


def _other_warnings(job: Job, base: Base, runs: list[study_folder.StudyRun]) -> list[Fact]:
    """Return the warnings of the other runs' fluid, without those that the own run has with other numbers."""
    keys = [fact.key for fact in fluid_warnings(base.run, record_files.read_simulation(job.path).volume_ratio)]
    others = {run.number + 1: without(run.figures.fluid_warnings, *keys) if run.figures else () for run in runs}
    return facts_of_runs(others, len(runs) + 1)
