"""The second stage: sealant is injected, and its level read."""

import json
import time
from dataclasses import replace
from pathlib import Path

from sealtwin.errors import InputError
from sealtwin.output import CHECKPOINT, FRAMES, PAST_THE_END, SNAPSHOTS, Output
from sealtwin.records import Run
from sealtwin.store import files, stage_files
from sealtwin.store.folder import MANIFEST, stage_key
from sealtwin.store.vtk_files import read_collection, read_frame
from sealtwin.trials.job import Job, begin_writing, stage_settings
from sealtwin.trials.made import DIGITISED, SIMULATED, made_by


def bring_up_to_date(job: Job) -> bool:
    """Whether anything had to be redone.

    Raises InputError where the settings do not fit the crack, NumericalError where the numbers stop meaning anything.
    """
    trial = job.trial
    if trial.fluid is None:
        raise InputError(
            f"{job.path / 'trial.toml'}: no [fluid] table; give U and D_cm, or viscosity_pa_s, and simulate again."
        )
    from simulate.device import choose_device, describe_device

    device = choose_device(job.device)
    if job.threads > 1 and device != "cpu":
        raise InputError(f"--threads {job.threads}: threads are a CPU's, and this run is on {device}. Leave it out.")
    job.progress.note(f"Device: {describe_device(device)}")
    inputs = made_by(job, "digitise", DIGITISED)
    settings = stage_settings(trial, "simulate")
    key = stage_key(inputs, {**settings, "device": device})
    if job.folder.is_current("simulate", key) and _shows(job, trial.output):
        # Killed just after it was finished, a run leaves its checkpoint.
        (job.path / CHECKPOINT).unlink(missing_ok=True)
        return False
    began = time.monotonic()

    from sealtwin.trials.watching import PROGRESS, ProgressFile, read_health, watch
    from simulate.fit import check_fit
    from simulate.profile import measure_profile, volume_ratio
    from simulate.run import inject
    from validate.drawing.snapshots import Scene
    from validate.gallery import write_gallery

    outline, solid = stage_files.read_outline(job.path), stage_files.read_solid(job.path)
    trajectory = stage_files.read_trajectory(job.path)
    check_fit(outline, solid, trial.fluid, trial.solver, trial.nozzle)
    checkpoint, *others = watch(job.path, trial.output, key, job.progress.note)
    with ProgressFile(job.path / PROGRESS) as progress_file:
        run = inject(
            solid,
            outline,
            trajectory,
            trial.fluid,
            trial.solver,
            trial.nozzle,
            seed=trial.seed,
            device=device,
            progress=job.progress,
            watchers=(checkpoint, *others, progress_file),
            threads=job.threads,
        )
        run = replace(run, health={**run.health, "volume_ratio": volume_ratio(run, solid)})
        profile = measure_profile(run, outline, solid)
        begin_writing(job, "simulate")
        stage_files.write_run(job.path, run)
        stage_files.write_profile(job.path, profile)
        job.progress.start("Drawing", 1)
        scene = Scene(outline, solid, trajectory, run.radius_mm, trial.nozzle.diameter_mm)
        frames = {Path(name).stem: read_frame(job.path / name) for name in snapshots_of(job)}
        pictures = write_gallery(job.path, frames, scene, read_health(job.path))
        _say_what_is_missing(job, run)
        facts = {"device": describe_device(device), "seed": trial.seed, "output": trial.output.model_dump(mode="json")}
        job.folder.record("simulate", key, settings, inputs, (*SIMULATED, *pictures), time.monotonic() - began, **facts)
        checkpoint.remove()
    return True


def _say_what_is_missing(job: Job, run: Run) -> None:
    end_s = run.health["frames"] * run.health["frame_s"]
    if late := [t_s for t_s in sorted(set(job.trial.output.snapshots_s)) if t_s > PAST_THE_END * end_s]:
        moments = ", ".join(f"{t_s:g}" for t_s in late)
        job.progress.note(f"note: no snapshot at {moments} s: the run ended after {end_s:.2f} s.")


def _shows(job: Job, wanted: Output) -> bool:
    """Whether the finished run left all frames and pictures that are wanted now."""
    with files.understood(job.path / MANIFEST):
        made = Output.model_validate_json(json.dumps(job.folder.manifest["stages"]["simulate"].get("output", {})))
    if wanted.frames_every_s is not None and not (job.path / FRAMES).is_file():
        return False
    return wanted.frames_every_s in (None, made.frames_every_s) and set(wanted.snapshots_s) <= set(made.snapshots_s)


def snapshots_of(job: Job) -> list[str]:
    """Files of the run's snapshots, in the order of time; none where the run made none."""
    if not (job.path / SNAPSHOTS).is_file():
        return []
    return [f"{SNAPSHOTS.parent}/{path.name}" for _, path in read_collection(job.path / SNAPSHOTS)]
