"""Compute variants of a trial's own run in a folder of its run folder, like that of a sweep.

Results are computed once: if the process is killed, the same command computes the remaining runs.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from sealtwin.core import record_files
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.facts import Fact
from sealtwin.core.progress import Progress
from sealtwin.core.records import Sample
from sealtwin.core.stage_keys import stage_key
from sealtwin.study import study_folder
from sealtwin.study.estimate import RunSize, Timing, checked_size, estimate, size_of
from sealtwin.study.moved_inputs import Base
from sealtwin.study.runner import Computing, compute
from sealtwin.trial.job import DIGITISED, Job, made_by, stage_settings
from sealtwin.trial.stage_numbers import numbers_up_to
from sealtwin.trial.trial_file import Trial
from validate.run_facts import facts_of_runs

SEEDS = 2**31  # Number of seeds that a trial may have

Variant = tuple[dict[str, float], Trial, Sample]
"""A variant: the settings in which it differs from the trial (particle size and seed, or steps of inputs), its own
trial, and its sample."""


def inputs_of(job: Job) -> dict[str, str]:
    """Return the hashes of the files of the trial's own run.

    Raises InputError if it is not finished, or if other stage numbers than this version's computed it.
    """
    inputs = {**made_by(job, "digitise", DIGITISED), **made_by(job, "simulate", ("particles.csv", "profile.csv"))}
    if other := job.other_numbers("simulate"):
        raise InputError(
            f"{job.path}: its level was computed by {other}, so extra runs would come from another solver. Run "
            f"'sealtwin run TRIAL --out {job.path}' first."
        )
    return inputs


def with_seed(trial: Trial, number: int) -> Trial:
    """Return the trial of one run, whose seed is larger by ``number``."""
    return trial.model_copy(update={"seed": (trial.seed + number) % SEEDS, "seeds": None})


def compute_variants(
    folder: Path,
    variants: Sequence[Variant],
    base: Base,
    how: Computing,
    inputs: Mapping[str, str],
    progress: Progress,
    name: str,
    why: str,
) -> list[study_folder.StudyRun]:
    """Compute the variants that are not done yet, and return the runs of all.

    ``name`` is that of the study. ``why`` completes "Extra runs for ". Raises InputError if particles do not fit a
    crack, and NumericalError if a run failed.
    """
    if study_folder.holds_study(folder):
        study_folder.remove_temporary_files(folder)
    runs, largest, remarks = _runs(folder, variants, how.device, inputs)
    plan = study_folder.Plan(name, runs, numbers=numbers_up_to("simulate"))
    runs = study_folder.resume(folder, plan, progress.note, retry=True)
    timings = own_timing(base)
    expected = estimate(runs, largest, how.jobs, how.batch, keep_runs=False, timings=timings)
    if expected.runs:
        progress.note(f"Extra runs for {why}: {expected.sentence}")
        for remark in remarks:
            progress.warn(remark.text)
        runs = compute(folder, runs, how, "Extra runs", progress, timings)
    if failed := [run for run in runs if run.state == "failed"]:
        reasons = "\n".join(f"{words_of(run.settings)}: {run.reason}" for run in failed)
        raise NumericalError(
            f"{folder}: {len(failed)} of {len(runs)} extra runs failed, so there is no result for {why}. The same "
            f"command tries only these again.\n{reasons}"
        )
    if finer := [words_of(run.settings) for run in runs if run.figures and run.figures.health.finer]:
        progress.warn(
            f"{len(finer)} of {len(runs)} extra runs failed, and were computed anew with more substeps "
            f"({finer[0]}). They may differ from the others by more than by the seed: give the trial a number of "
            "solver.substeps with which none fails."
        )
    return runs


def _runs(
    folder: Path, variants: Sequence[Variant], device: str, inputs: Mapping[str, str]
) -> tuple[list[study_folder.StudyRun], RunSize, list[Fact]]:
    """Write the samples of the runs. Return the runs, the size of the largest one and remarks on the fluids.

    Raises InputError if particles do not fit a crack.
    """
    runs, sizes, remarks = [], [], dict[int, list[Fact]]()
    for number, (moved, trial, sample) in enumerate(variants, start=1):
        try:
            size, remarks[number] = checked_size(trial, sample)
        except InputError as fault:
            raise InputError(
                f"{folder}: the extra run with {words_of(moved)} is not possible: {fault} Extra runs may have "
                "smaller and larger particles than the trial's: give the trial another solver.radius_mm."
            ) from None
        sizes.append(size)
        # Runs of another particle size or seed have the trial's own sample.
        steps = {} if moved.keys() & {"solver.radius_mm", "seed"} else moved
        name = stage_key(inputs, {"moved": steps}, numbers_up_to("digitise"))[:12]
        home = folder / "samples" / name
        if not all((home / file).is_file() for file in DIGITISED):
            record_files.write_sample(home, sample)
        # The settings of a sloping sample have a table "sample" already.
        place = {"sample" if trial.sample.level else "bench": name}
        settings = {**stage_settings(trial, "simulate"), **place, "device": device}
        key = stage_key(inputs, settings, numbers_up_to("simulate"))
        content = trial.model_dump(mode="json", exclude_none=True)
        runs.append(study_folder.StudyRun(number, key, moved, content, name, key, size.work_s))
    largest = max(sizes, key=lambda size: (size.particles, size.bytes))
    return runs, largest, facts_of_runs(remarks, len(runs))


def words_of(settings: Mapping[str, float]) -> str:
    """Describe a run by its particle size and the number added to the seed, or by how far its inputs are moved."""
    return ", ".join(
        f"{name} = {value:g}" if "." in name else f"{name} {value:+g} from the trial's"
        for name, value in settings.items()
    )


def own_timing(base: Base) -> list[Timing]:
    """Return the time of the trial's own run if it was recorded, for the first estimate of the extra runs' time."""
    health = base.run.health
    if health.setup_s is None or health.frames_s is None:
        return []
    return [(size_of(base.trial, base.sample).work_s, health.setup_s + health.frames_s)]
