"""A run of a study once more, watched: what lay where at some moments, and what its frames cost.

A study keeps no particles, which a night of runs would fill a disk with. Whoever wants to see some of its runs has them
computed again, from the ledger's own settings; on a CPU they come out the same to the last bit.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sealtwin.errors import SealtwinError
from sealtwin.output import PAST_THE_END
from sealtwin.progress import Progress
from sealtwin.records import Floats, Frame, Profile
from sealtwin.store import files, stage_files
from sealtwin.store.vtk_files import read_frame, write_frame
from sealtwin.study.ledger import Ledger, StudyRun, run_path
from sealtwin.study.workers import bench_of, trial_of
from sealtwin.trials.watching import HEALTH, read_health

FOLDER = "watched"
"""In a run's folder."""
SEEN = "seen.json"
"""Written last: what lies beside it is complete."""


@dataclass(frozen=True)
class Watched:
    """A run as it went."""

    frames: tuple[Frame, ...]
    """In the order of time; the last one is its end."""
    particles: Floats
    """That moved, every few frames, (k,)."""
    frame_ms: Floats
    """What a frame took then, (k,)."""
    differs_mm: float
    """Mean distance of its level from that of the study's run; 0 where it is the same."""


def watch_run(folder: Path, ledger: Ledger, run: StudyRun, device: str, progress: Progress) -> Watched:
    """Compute a run that is done once more, or read what was seen of it before.

    Frames are those at the moments that the trial's table output names, and the last one.

    Raises NumericalError where the second run fails.
    """
    home = run_path(folder, run.key) / FOLDER
    if not (home / SEEN).is_file():
        _compute(home, folder, ledger, run, device, progress)
    seen = files.read_json(home / SEEN)
    with files.understood(home / SEEN):
        health = read_health(home)
        moved = health["moving"] > 0
        return Watched(
            frames=tuple(read_frame(home / name) for name in seen["frames"]),
            particles=health["moving"][moved],
            frame_ms=health["ms_a_frame"][moved],
            differs_mm=float(seen["differs_mm"]),
        )


def is_seen(folder: Path, run: StudyRun) -> bool:
    """Whether ``watch_run`` costs nothing."""
    return (run_path(folder, run.key) / FOLDER / SEEN).is_file()


def _compute(home: Path, folder: Path, ledger: Ledger, run: StudyRun, device: str, progress: Progress) -> None:
    from sealtwin.study.bench import ready
    from simulate.frames import Moments, take_frame
    from simulate.health import HealthLog
    from simulate.profile import measure_profile
    from simulate.run import follow

    entry = ledger.entry(run.key)
    bench, trial = bench_of(folder, entry), trial_of(entry)
    injection = ready(bench, [trial], device)
    end_s = injection.frames * injection.schedule.frame_s
    wanted_s = sorted(t_s for t_s in set(trial.output.snapshots_s) if t_s * PAST_THE_END < end_s)
    frames: list[Frame] = []
    home.mkdir(parents=True, exist_ok=True)
    follow(injection, progress, [Moments(wanted_s, lambda _, frame: frames.append(frame)), HealthLog(home / HEALTH)])
    (outcome,) = injection.outcomes()
    if isinstance(outcome, SealtwinError):
        raise outcome
    frames.append(take_frame(injection))
    names = [f"{number}.vtp" for number in range(len(frames))]
    for name, frame in zip(names, frames, strict=True):
        write_frame(home / name, frame)
    again = measure_profile(outcome, bench.outline, bench.solid)
    before = stage_files.read_profile(run_path(folder, run.key))
    files.write_json(home / SEEN, {"version": 1, "frames": names, "differs_mm": _distance_mm(again, before)})


def _distance_mm(again: Profile, before: Profile) -> float:
    level_mm = np.interp(before.s_mm, again.s_mm, again.level_mm)
    # The file holds millionths.
    return float(np.abs(np.round(level_mm, 6) - before.level_mm).mean())
