"""Samples and paths that several benchmarks need."""

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.reality.inputs import Pour
from sealtwin.core import record_files
from sealtwin.core.progress import Progress
from sealtwin.core.records import Sample, Trajectory
from sealtwin.core.run_folder import open_folder
from sealtwin.study.pipeline import run_stages
from sealtwin.trial.job import start_job
from sealtwin.trial.trial_file import Trial
from tests.support.paths import FIXTURE


def digitised(trial: Trial) -> Sample:
    """Return the sample of a trial whose files are in the folder of the shipped trial."""
    with tempfile.TemporaryDirectory() as scratch, open_folder(Path(scratch) / "run", create=True) as folder:
        run_stages(start_job(trial, FIXTURE, folder, "cpu", Progress()), ("digitise",))
        return record_files.read_sample(folder.path)


def pour_along(path: Trajectory, nozzle_mm: float, flow_factor: float = 1.0) -> Pour:
    """Return a path with its flow as the second reality takes them: a waypoint's flow holds until the next one."""
    times_s, flow_mm3_s = np.repeat(path.t_s, 2)[1:-1], flow_factor * np.repeat(path.flow_mm3_s[:-1], 2)
    return Pour(path.t_s, path.s_mm, times_s, flow_mm3_s, nozzle_mm)
