"""Processor times of runs, frame by frame, taken in the run itself and with the load that others made beside it."""

import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import psutil
from numpy.typing import NDArray

from sealtwin.core import files
from sealtwin.core.errors import NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Sample
from sealtwin.trial.stage_numbers import numbers_up_to
from sealtwin.trial.trial_file import Trial
from simulate.injection import Injection
from simulate.run import follow, ready
from simulate.watchers import Watcher


@dataclass(frozen=True, eq=False)
class Pace:
    """Times of one run's frames on a processor, without its walls and its profile."""

    processor_s: float
    wall_s: float
    others_cores: float
    """Processor cores that other processes kept busy meanwhile, in the mean."""
    moving: NDArray[np.int64]
    """Particles that moved, (frames,)."""
    frame_ms: Floats
    """Processor time, (frames,)."""


class _Clock(Watcher):
    """A watcher that takes the processor time of every frame."""

    def __init__(self) -> None:
        self.moving: list[int] = []
        self.frame_ms: list[float] = []
        self._began = 0.0

    def begin(self, injection: Injection) -> None:
        self._began = time.process_time()

    def after_frame(self, injection: Injection) -> None:
        injection.wait()
        now = time.process_time()
        self.moving.append(injection.moving)
        self.frame_ms.append(1000 * (now - self._began))
        self._began = now


def take_pace(path: Path, bench: Sample, trial: Trial) -> None:
    """Compute a run in this process and write its pace, unless that of the same trial was written before.

    Raises NumericalError where the run fails.
    """
    settings = trial.model_dump(mode="json")
    if not is_current(path) or files.read_json(path).get("trial") != settings:
        facts = {"trial": settings, "stage_numbers": numbers_up_to("simulate")}
        files.write_json(path, {"version": 1, **_listed(_paced(bench, trial)), **facts})


def is_current(path: Path) -> bool:
    """Return True for a pace of this version's stage numbers."""
    return path.is_file() and files.read_json(path).get("stage_numbers") == numbers_up_to("simulate")


def read_pace(path: Path) -> Pace:
    content = files.read_json(path)
    with files.understood(path):
        moving, frame_ms = np.array(content["moving"]), np.array(content["frame_ms"], dtype=float)
        return Pace(content["processor_s"], content["wall_s"], content["others_cores"], moving, frame_ms)


def _paced(bench: Sample, trial: Trial) -> Pace:
    fluid, solver, nozzle = trial.physics
    clock, injection = (
        _Clock(),
        ready(bench, [fluid], solver, nozzle, seed=trial.seed, device="cpu", slope=trial.sample),
    )
    busy_s, wall_s, own_s = _busy_s(), time.monotonic(), time.process_time()
    follow(injection, Progress(), [clock])
    busy_s, wall_s, own_s = _busy_s() - busy_s, time.monotonic() - wall_s, time.process_time() - own_s
    (outcome,) = injection.outcomes()
    if isinstance(outcome, NumericalError):
        raise outcome
    # Both clocks tick in hundredths of a second.
    others_cores = max(0.0, (busy_s - own_s) / wall_s)
    return Pace(own_s, wall_s, others_cores, np.array(clock.moving), np.array(clock.frame_ms))


def _busy_s() -> float:
    """Time that all cores of this machine were busy since it started, also for other machines on the same processor."""
    times = psutil.cpu_times()._asdict()
    # Linux counts guests in user and nice already; waiting for a disk keeps no core busy.
    return sum(value for name, value in times.items() if name not in ("idle", "iowait", "guest", "guest_nice"))


def _listed(pace: Pace) -> dict[str, object]:
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in asdict(pace).items()}
