"""Second stage: inject the sealant and measure its level."""

import time
from pathlib import Path

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Run
from sealtwin.core.run_figures import FAST
from sealtwin.core.run_folder import MANIFEST, stage_key
from sealtwin.core.vtk_files import read_collection
from sealtwin.trial.job import DIGITISED, SIMULATED, Job, begin_writing, made_by, stage_settings
from sealtwin.trial.trial_file import Output

CHECKPOINT = "checkpoint.npz"  # File with the checkpoint of an unfinished run
SNAPSHOTS = Path("snapshots", "snapshots.pvd")  # Collection file that lists the snapshots of its folder


def bring_up_to_date(job: Job) -> bool:
    """Run the stage unless its files are up to date. Returns True if it ran.

    Raises InputError if the settings cannot be used for the crack, and NumericalError if the run becomes unstable.
    """
    _require_fluid(job)
    trial, device = job.trial, device_of(job)
    inputs = made_by(job, "digitise", DIGITISED)
    settings, numbers = stage_settings(trial, "simulate"), job.numbers("simulate")
    key = stage_key(inputs, {**settings, **({"device": device} if device else {})}, numbers)
    if job.folder.is_current("simulate", key) and (not device or _has_snapshots(job)):
        # A run that was killed just after its end may have left its checkpoint.
        (job.path / CHECKPOINT).unlink(missing_ok=True)
        return False
    before = job.folder.entry_of("simulate")
    if before.get("inputs") == inputs and before["settings"]["solver"].get("model") != FAST == trial.solver.model:
        raise InputError(
            f"{job.path}: contains a finished run of particles, which a run of the fast model would replace. Give "
            "another folder with --out, or delete this folder."
        )
    began = time.monotonic()

    from simulate.injection import ComputeOptions
    from simulate.run import fill
    from simulate.watchers import Checkpoint, FrameFiles, StillThere

    sample = record_files.read_sample(job.path)
    # The checkpoint is the first of these watchers, because it may resume the run before the others begin.
    checkpoint = Checkpoint(job.path / CHECKPOINT, f"{key} {trial.output.model_dump_json()}", job.progress.note)
    snapshots = FrameFiles(job.path / SNAPSHOTS, sorted(set(trial.output.snapshots_s)))
    # The checkpoint is in the list twice, because it must be first both before the run and after each frame.
    still_there = StillThere(job.path)
    watchers = still_there, checkpoint, snapshots, still_there
    run, profile = fill(trial.pour(sample), ComputeOptions(device, job.threads, job.progress, watchers))
    begin_writing(job, "simulate")
    record_files.write_run(job.path, run)
    record_files.write_profile(job.path, profile)
    facts = {"device": run.device, "seed": trial.seed}
    if run.has_particles:
        _note_missed(job, run)
        facts["output"] = trial.output.model_dump(mode="json")
    else:
        # Files of an earlier particle run are deleted.
        for name in (*snapshots_of(job), CHECKPOINT, SNAPSHOTS):
            (job.path / name).unlink(missing_ok=True)
    wall_time_s = time.monotonic() - began
    job.folder.record("simulate", key, settings, inputs, SIMULATED, wall_time_s, numbers=numbers, **facts)
    checkpoint.remove()
    return True


def device_of(job: Job) -> str:
    """Return the device of the trial's run, or "" for the fast model, whose result does not depend on the device.

    Raises InputError if the device does not exist, or if threads are given for a device other than a CPU.
    """
    if not job.trial.solver.has_particles:
        return ""
    from simulate.device import choose_device, describe_device

    device = choose_device(job.device)
    if (job.threads or 1) > 1 and device != "cpu":
        raise InputError(f"--threads {job.threads}: threads apply only to a CPU, but this run is on {device}. Omit it.")
    job.progress.note(f"Device: {describe_device(device)}")
    return device


def check(job: Job) -> None:
    """Check a digitised trial as its run does before the first frame. Raises the same InputError as the run."""
    from simulate.run import check as check_run

    _require_fluid(job)
    check_run(job.trial.pour(record_files.read_sample(job.path)))


def _note_missed(job: Job, run: Run) -> None:
    """Show a note if snapshots are missing because the run ended before their time."""
    from simulate.watchers import PAST_THE_END

    health = run.health.recorded()
    end_s = health["frames"] * health["frame_s"]
    wanted_s = set(job.trial.output.snapshots_s) - set(Output().snapshots_s)
    if late := [f"{t_s:g}" for t_s in sorted(wanted_s) if t_s > PAST_THE_END * end_s]:
        job.progress.note(f"note: there is no snapshot at {', '.join(late)} s, since the run ended at {end_s:.2f} s.")


def _require_fluid(job: Job) -> None:
    if job.trial.fluid is None:
        raise InputError(
            f"{job.path / 'trial.toml'}: there is no table [fluid]. Give viscosity_pa_s, or U and D_cm, and simulate "
            "again."
        )


def _has_snapshots(job: Job) -> bool:
    """Return True if the finished run wrote all snapshots that the trial now requests."""
    with files.reading_stage_file(job.path / MANIFEST):
        written = {*job.folder.manifest["stages"]["simulate"].get("output", {}).get("snapshots_s", ())}
    return {*job.trial.output.snapshots_s} <= written


def snapshots_of(job: Job) -> list[str]:
    """Return the files of the run's snapshots in the order of time."""
    if not (job.path / SNAPSHOTS).is_file():
        return []
    return [f"{SNAPSHOTS.parent}/{path.name}" for _, path in read_collection(job.path / SNAPSHOTS)]
