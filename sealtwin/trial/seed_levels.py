"""The level of a run folder: that of its run, or the mean of the runs with the trial's seeds."""

from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import LEVEL
from sealtwin.core.records import Profile
from sealtwin.trial.job import SEEDS, Job
from validate.result import SeedRuns

SEED_RUNS = "seeds.json"
OF_SEEDS = (LEVEL, SEED_RUNS)  # Files of the runs with the other seeds that the report reads


def read_seeds(job: Job) -> SeedRuns | None:
    """Read the record of the runs whose mean is the level; None if there is one run, or they are not finished."""
    if job.trial.seeds is None or SEEDS not in job.folder.finished():
        return None
    return record_files.read_record(SeedRuns, job.path / SEED_RUNS)


def read_level(job: Job) -> tuple[Profile, SeedRuns | None]:
    """Read the level, and the record of the runs if it is a mean. Raises InputError if one of them is missing."""
    seeds = read_seeds(job)
    if job.trial.seeds is not None and (seeds is None or len(seeds.seeds) != job.trial.seeds):
        raise InputError(
            f"{job.path}: the runs of its {job.trial.seeds} seeds are not finished. Run 'sealtwin validate {job.path}' "
            "first."
        )
    return (record_files.read_profile if seeds is None else record_files.read_level)(job.path), seeds
