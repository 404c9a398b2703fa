"""The time that 'sealtwin validate RUN --uncertainty' takes, estimated from the trial's own run."""

from dataclasses import replace

from sealtwin.core import record_files
from sealtwin.core.cluster import cores
from sealtwin.study.estimate import estimate, in_words, size_of
from sealtwin.study.extra_runs import RATIO, REPLICATES
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.job import Job
from validate.uncertainty.validation import two_level_design


def time_of_extra_runs(job: Job) -> str:
    """Return the time in words: that of the trial's own run, by how much more the model takes for the others."""
    trial, run = job.trial, record_files.read_simulation(job.path)
    if run.bed is not None:
        return ""
    trajectory, outline = record_files.read_trajectory(job.path), record_files.read_outline(job.path)
    weighed = record_files.read_solid(job.path).figures.weighed
    inputs = trial.uncertainty.with_sample(outline.width_doubt_mm, weighed).moved
    numbers = {
        run.radius_mm / RATIO: REPLICATES,
        run.radius_mm: REPLICATES,
        run.radius_mm * RATIO: REPLICATES + (len(two_level_design(len(inputs))) if inputs else 0),
    }
    waiting = StudyRun(number=1, key="", settings={}, trial={}, sample="", kin="", work_s=0.0)
    runs, sizes = list[StudyRun](), []
    for radius_mm, number in numbers.items():
        solver = trial.solver.model_copy(update={"radius_mm": radius_mm})
        sizes.append(size_of(trial.model_copy(update={"solver": solver}), trajectory, outline.mean_width_mm))
        runs += [replace(waiting, work_s=sizes[-1].work_s)] * number
    # One of the trial's own size is done.
    wall_s = job.folder.manifest["stages"]["simulate"]["wall_time_s"]
    runs[REPLICATES] = replace(runs[REPLICATES], state="done", wall_s=wall_s)
    jobs = cores() if run.device.startswith("CPU") else 1
    return in_words(estimate(runs, sizes[0], jobs, 1, keep_runs=False).time_s)
