"""What each stage leaves for the next, and whether it may be used."""

from collections.abc import Sequence

from sealtwin.errors import InputError
from sealtwin.store import files
from sealtwin.trials.job import Job, StageName, stage_settings

DIGITISED = ("outline.json", "crack.ply", "solid.json", "trajectory.csv")
"""What the later stages read of the first."""
SIMULATED = ("particles.csv", "simulation.json", "profile.csv")


def made_by(job: Job, stage: StageName, names: Sequence[str]) -> dict[str, str]:
    """Hashes of files that ``stage`` left, edited since or not.

    Raises InputError where it is not finished, or was with other settings than the trial's.
    """
    again = f"'sealtwin {stage} {job.path}'" if stage != "digitise" else f"'sealtwin run TRIAL --out {job.path}'"
    made_with = job.folder.settings_of(stage)
    missing = [name for name in names if not (job.path / name).is_file()]
    if made_with is None or missing:
        what = f" ({missing[0]} is not there)" if missing else ""
        raise InputError(f"{job.path}: {stage} is not finished{what}. Run {again} first.")
    wanted = stage_settings(job.trial, stage)
    if differing := [table for table, setting in wanted.items() if made_with.get(table) != setting]:
        raise InputError(
            f"{job.path / 'trial.toml'}: [{'], ['.join(differing)}] is not what {stage} ran with here. "
            f"Run {again} for these settings first."
        )
    for name in job.folder.edited(stage):
        job.progress.note(f"{name}: not as {stage} wrote it; it is used as it is now.")
    return {name: files.sha256(job.path / name) for name in names}
