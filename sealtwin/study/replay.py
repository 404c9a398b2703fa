"""Finished runs of a study computed once more, to keep their frames and what these cost.

A study keeps no particles, which would fill a disk. On a CPU the second run is the first one to the last bit.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sealtwin.core import files, record_files
from sealtwin.core.cluster import cores, run_tasks
from sealtwin.core.errors import NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Frame
from sealtwin.core.vtk_files import read_frame, write_frame
from sealtwin.study.estimate import in_words
from sealtwin.study.study_folder import StudyRun, run_path
from sealtwin.trial.simulate_stage import HEALTH, read_health
from validate.study_figures.cost_and_fills import Watched

FOLDER, SEEN = "watched", "seen.json"
"""Folder in a run's own, and its last file, which says that the others are complete."""


def watch_runs(folder: Path, runs: Sequence[StudyRun], device: str, progress: Progress) -> list[Watched]:
    """Compute finished runs once more, or read what an earlier call kept of them.

    Frames are those at the moments that the trial's [output] names, and the last one.

    Raises NumericalError if a second run fails.
    """
    waiting = [run for run in runs if not (run_path(folder, run.key) / FOLDER / SEEN).is_file()]
    if waiting:
        jobs = min(cores() if device == "cpu" else 1, len(waiting))
        time_s = sum(run.wall_s or 0.0 for run in waiting) / max(1, jobs)
        progress.note(f"{len(waiting)} runs are computed once more, to be drawn: about {in_words(time_s)}.")
        progress.start("Computing once more", len(waiting))
        tasks = ((run, (folder.resolve(), run, device)) for run in waiting)
        for done, (run, lost) in enumerate(run_tasks(_compute, tasks, jobs), start=1):
            if lost is not None:
                raise NumericalError(f"{folder}: run {run.number} was computed once more, and failed: {lost.reason}.")
            progress.advance(done, f"run {run.number}")
    return [_read(run_path(folder, run.key) / FOLDER) for run in runs]


def _read(home: Path) -> Watched:
    seen = files.read_json(home / SEEN)
    with files.understood(home / SEEN):
        health = read_health(home)
        moved = health["moving"] > 0
        frames = tuple(read_frame(home / name) for name in seen["frames"])
        return Watched(frames, health["moving"][moved], health["ms_a_frame"][moved], float(seen["differs_mm"]))


def _compute(folder: Path, run: StudyRun, device: str) -> None:
    """Write what ``_read`` reads. Raises NumericalError if the run fails."""
    from sealtwin.study.runner import read_bench, ready
    from simulate.output.frames import PAST_THE_END, Moments, take_frame
    from simulate.output.health_log import HealthLog
    from simulate.profile import measure_profile
    from simulate.run import follow

    home, trial = run_path(folder, run.key) / FOLDER, run.checked_trial
    bench = read_bench(folder / "samples" / run.sample, trial.readings)
    injection = ready(bench, [trial], device)
    end_s = injection.frames * injection.schedule.frame_s
    wanted_s = sorted(t_s for t_s in set(trial.output.snapshots_s) if t_s * PAST_THE_END < end_s)
    frames: list[Frame] = []
    home.mkdir(parents=True, exist_ok=True)
    watchers = [Moments(wanted_s, lambda _, frame: frames.append(frame)), HealthLog(home / HEALTH)]
    follow(injection, Progress(), watchers)
    (outcome,) = injection.outcomes()
    if isinstance(outcome, NumericalError):
        raise outcome
    frames.append(take_frame(injection))
    names = [f"{number}.vtp" for number in range(len(frames))]
    for name, frame in zip(names, frames, strict=True):
        write_frame(home / name, frame)
    again = measure_profile(outcome, bench.outline, bench.solid)
    before = record_files.read_profile(run_path(folder, run.key))
    # The file holds millionths.
    level_mm = np.round(np.interp(before.s_mm, again.s_mm, again.level_mm), 6)
    differs_mm = float(np.abs(level_mm - before.level_mm).mean())
    files.write_json(home / SEEN, {"version": 1, "frames": names, "differs_mm": differs_mm})
