"""The time that 'sealtwin validate RUN --uncertainty' takes, estimated from the trial's own run."""

import time
from dataclasses import replace

import numpy as np

from sealtwin.core.cluster import cores
from sealtwin.core.errors import InputError
from sealtwin.study.drawn_runs import PLACES, level_of, model_of
from sealtwin.study.estimate import estimate, in_words, size_of
from sealtwin.study.extra_runs import RATIO, REPLICATES
from sealtwin.study.moved_inputs import Base
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.job import Job
from validate.uncertainty.computed import RUNS, two_level_design

A_LITTLE = 0.1  # Of its uncertainty, by which each input is moved in the run that is timed


def time_of_extra_runs(job: Job) -> str:
    """Return the time in words: that of the trial's own run, by how much more the model takes for the others."""
    base = Base.of(job)
    trial, run, trajectory, outline = base.trial, base.run, base.bench.trajectory, base.bench.outline
    drawn = bool(base.inputs) and model_of(base) == "slot"
    drawn_s = RUNS * _time_of_a_draw_s(base) / cores() if drawn else 0.0
    if run.bed is not None:
        return in_words(drawn_s) if drawn else ""
    designed = len(two_level_design(len(base.inputs))) if base.inputs and not drawn else 0
    numbers = {
        run.radius_mm / RATIO: REPLICATES,
        run.radius_mm: REPLICATES,
        run.radius_mm * RATIO: REPLICATES + designed,
    }
    waiting = StudyRun(number=1, key="", settings={}, trial={}, sample="", kin="", work_s=0.0)
    runs, sizes = list[StudyRun](), []
    for radius_mm, number in numbers.items():
        solver = trial.solver.model_copy(update={"radius_mm": radius_mm})
        try:
            sizes.append(size_of(trial.model_copy(update={"solver": solver}), trajectory, outline.mean_width_mm))
        except InputError:
            # Particles so small are too many, or its sealant is too stiff in them: 'sealtwin validate' says which.
            return ""
        runs += [replace(waiting, work_s=sizes[-1].work_s)] * number
    # One of the trial's own size is done.
    wall_s = job.folder.manifest["stages"]["simulate"]["wall_time_s"]
    runs[REPLICATES] = replace(runs[REPLICATES], state="done", wall_s=wall_s)
    jobs = cores() if run.device.startswith("CPU") else 1
    return in_words(drawn_s + estimate(runs, sizes[0], jobs, 1, keep_runs=False).time_s)


def _time_of_a_draw_s(base: Base) -> float:
    """Run the fast model once with its inputs moved, and time it."""
    began_s = time.perf_counter()
    level_of(base, {name: A_LITTLE * by for name, by in base.inputs.items()}, np.linspace(0.0, 1.0, PLACES))
    return time.perf_counter() - began_s
