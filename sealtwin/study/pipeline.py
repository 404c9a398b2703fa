"""Run the stages of one trial in order. A stage is computed again only if its inputs, settings or number changed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.errors import NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import open_folder
from sealtwin.core.solid_figures import SolidFigures
from sealtwin.study.estimate import REPORT_S
from sealtwin.study.uncertainty_runs import compute_other_seeds, rounds_of_seeds
from sealtwin.trial import digitise_stage, simulate_stage, validate_stage
from sealtwin.trial.job import (
    SEEDS,
    STAGES,
    Job,
    StageName,
    adopt_trial,
    clear,
    display_path,
    other_versions,
    require_sample,
    require_solid,
    run_folder_of,
    start_job,
)
from sealtwin.trial.trial_file import Trial
from sealtwin.trial.validate_stage import read_seeds
from validate.result import (
    PREDICTION,
    RESULT,
    ComputedBy,
    FluidFigures,
    PredictedLevel,
    SampleFigures,
    TrialResult,
    read_comparison,
)


@dataclass(frozen=True)
class FinishedStages:
    result: TrialResult
    redone: tuple[StageName, ...]
    can_be_planned: bool  # True if 'sealtwin plan' supports the sealant
    can_be_varied: bool  # True if 'sealtwin validate RUN --uncertainty' can add to the result


def run_trial(
    trial: Trial,
    file: Path,
    out: Path | None,
    stages: Sequence[StageName],
    device: str,
    progress: Progress,
    threads: int | None = None,
    jobs: int = 0,
    source: Path | None = None,
) -> FinishedStages:
    """Bring ``stages`` of a trial up to date in ``out`` (default: that of ``run_folder_of``).

    ``file`` is the trial file, or the file from which the trial was begun. Paths in the trial are relative to
    ``source``, by default its folder. ``jobs`` is the number of worker processes for the runs with other seeds. 0
    computes them in this process.
    """
    source = source or file.parent
    require_sample(trial, source)
    with open_folder(out or run_folder_of(file, trial), create=True) as folder:
        job = start_job(trial, source, folder, device, progress, file)
        return run_stages(replace(job, threads=threads, jobs=jobs), stages)


def run_stages(job: Job, stages: Sequence[StageName]) -> FinishedStages:
    """Bring ``stages`` up to date, in their order.

    If a stage fails, raises InputError or NumericalError. The folder is then unchanged, except for refused.png and the
    checkpoint of a fluid run. If a particle escaped, raises NumericalError after all files are written.
    """
    work = {"digitise": digitise_stage, "simulate": simulate_stage, "validate": validate_stage}
    redone, more = list[StageName](), False
    _check_cheap_inputs(job, stages)
    for stage in STAGES:
        if stage in stages and stage != "digitise":
            require_solid(job)
        both = stage == "simulate" and {"simulate", "validate"} <= set(stages)
        # The sheet is read with the crack, so that a mistake in it is found before the long simulation.
        if both and (readings := validate_stage.readings_of(job)) is not None:
            validate_stage.note_doubts(job, readings)
        if both and "simulate" not in job.folder.finished():
            # The stage begins with the distances to the walls, on one core. Another core can import the report.
            Thread(target=import_module, args=["validate.report.write_report"], daemon=True).start()
        job.progress.later(REPORT_S if both else 0.0, rounds_of_seeds(job))
        if stage == "validate" and {"simulate", "validate"} & set(stages):
            more = _bring_seeds_up_to_date(job)
        if stage in stages and work[stage].bring_up_to_date(job):
            redone.append(stage)
    adopt_trial(job)
    result = read_result(job)
    if (escaped := result.fluid and result.fluid.escaped_particles) and stages[-1] != "digitise":
        raise NumericalError(
            f"{job.path}: {escaped} particles went through a wall, which must never happen. The files are complete, "
            "but must not be used. Please report this bug with the trial file."
        )
    if not redone and not more:
        job.progress.note(f"{job.path}: complete and up to date; nothing to redo.")
    can_be_planned = job.trial.fluid is not None and job.trial.fluid.suits_fast_model
    return FinishedStages(result, tuple(redone), can_be_planned, job.trial.can_be_varied)


def _check_cheap_inputs(job: Job, stages: Sequence[StageName]) -> None:
    """Raise InputError if the device does not exist or the sheet cannot be read, before the photo is traced."""
    if "simulate" in stages and job.device != "cpu" and job.trial.solver.has_particles:
        from simulate.device import choose_device

        choose_device(job.device)
    readings = job.trial.readings
    if {"digitise", "validate"} <= set(stages) and job.sheet is not None and readings and readings.scan is None:
        from validate.readings.read_readings import read_readings

        read_readings(job.sheet, readings)


def _bring_seeds_up_to_date(job: Job) -> bool:
    """Compute the runs with the trial's other seeds. If the trial has one seed, delete the mean of earlier seeds.

    Returns True if a file was changed.
    """
    if job.trial.seeds is not None:
        return compute_other_seeds(job)
    was_there = SEEDS in job.folder.manifest["stages"]
    clear(job, SEEDS)
    return was_there


def check_run(job: Job) -> Profile | None:
    """Check a trial as a run does before its first frame, and return the readings with the remarks on them.

    Digitises first if needed. Raises the same InputError as a run.
    """
    digitise_stage.bring_up_to_date(job)
    require_solid(job)
    readings = validate_stage.readings_of(job)
    simulate_stage.check(job)
    return readings


def read_result(job: Job) -> TrialResult:
    """Return the results in the run folder, and write them to run.json if that file is missing or differs."""
    folder, stages, manifest = job.folder, job.folder.finished(), job.folder.manifest["stages"]
    with files.reading_stage_file(folder.path):
        result = TrialResult(
            name=job.trial.name,
            assumed=job.trial.assumed_words,
            folder=display_path(folder.path),
            wall_time_s=sum(manifest[stage]["wall_time_s"] for stage in stages),
            stages=tuple(stages),
            computed_by={
                stage: ComputedBy(
                    sealtwin=manifest[stage]["versions"].get("sealtwin"), stage_numbers=folder.numbers_of(stage)
                )
                for stage in stages
            },
            other_versions=tuple(other_versions(folder)),
            edited=tuple(name for stage in stages for name in folder.edited(stage)),
            sample=_sample(folder.path, job.trial) if "digitise" in stages else None,
            fluid=_fluid(job) if "simulate" in stages else None,
            seeds=read_seeds(job),
            **(_validation_records(job) if "validate" in stages else {}),
        )
    target, text = folder.path / RESULT, files.as_json(result.model_dump())
    if not target.is_file() or files.read_text(target) != text:
        files.write_text(target, text)
    return result


def _sample(folder: Path, trial: Trial) -> SampleFigures:
    outline = record_files.read_outline(folder)
    figures, volume_mm3, width_mm = SolidFigures(), None, None
    if outline.width_source == "none":
        sealant_mm3 = record_files.read_trajectory(folder).dispensed_mm3
    else:
        figures = record_files.read_record(SolidFigures, folder / "solid.json")
        volume_mm3 = record_files.read_record(record_files.SolidFile, folder / "solid.json").cavity_volume_mm3
        sealant_mm3, width_mm = figures.sealant_mm3, outline.mean_width_mm
    if sealant_mm3 is None:
        raise ValueError("solid.json: sealant_mm3 is missing")
    return SampleFigures(
        data=trial.shown_by.data,
        length_mm=outline.length_mm,
        mean_width_mm=width_mm,
        width_source=outline.width_source,
        width_95_mm=outline.width_95_mm,
        cavity_volume_mm3=volume_mm3,
        cavity_volume_95_mm3=figures.cavity_volume_95_mm3,
        weighed=figures.weighed,
        sealant_mm3=sealant_mm3,
        path_source=outline.path_source,
        scale_source=outline.scale_source,
        mm_per_px=None if outline.seen_in == "mesh" else outline.mm_per_px,
        scale_uncertainty=outline.scale_uncertainty,
        scale_residual_mm=outline.scale_residual_mm,
        camera_tilt_deg=outline.camera_tilt_deg,
        warnings=(*outline.warnings, *figures.warnings),
    )


def _fluid(job: Job) -> FluidFigures:
    from validate.run_facts import run_warnings

    run, bed = record_files.read_simulation(job.path), record_files.read_run(job.path)
    counts = ("particles", "escaped_particles", "spilled_particles")
    return FluidFigures(
        # For the fast model, which has no particles, the counts are None.
        **{name: getattr(run, name) if run.has_particles else None for name in counts},
        above_face_mm3=(1 - bed.share_below_face) * run.volume_ratio * run.dispensed_volume_mm3,
        unfit=None if run.has_particles else run.unfit,
        volume_ratio=run.volume_ratio,
        device=run.device,
        warnings=(*run.doubts, *run_warnings(run, run.volume_ratio, read_seeds(job))),
    )


def _validation_records(job: Job) -> dict[str, Any]:
    """Return the records that the stage validate wrote, by field of ``TrialResult``."""
    folder, has_readings = job.path, job.trial.readings is not None
    predicted = not has_readings and (folder / PREDICTION).is_file()
    return {
        "report": display_path(folder / "report.html"),
        "comparison": read_comparison(folder) if has_readings else None,
        "prediction": record_files.read_record(PredictedLevel, folder / PREDICTION) if predicted else None,
    }
