"""The processes of a sweep on this machine. Each takes the next waiting run from the ledger and holds nothing else."""

import os
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing import get_context
from multiprocessing.connection import wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from sealtwin.processes import end_with_parent
from sealtwin.progress import Progress
from sealtwin.study.bench import Bench, Failure, Sealing, read_bench, seal, write_sealing
from sealtwin.study.ledger import Claim, Entry, Ledger, run_path
from sealtwin.trials.trial import Trial
from validate.settings import Readings

BEAT_EVERY_S = 1.0
"""Between two words to the ledger: often enough for somebody who looks, and no cost beside frames of milliseconds."""
STALLED_S = 900.0
"""Without a finished frame. Preparing a crack takes seconds, a frame of a million particles some more."""
LOOK_EVERY_S = 0.3
LOST_AT_MOST = 3
"""Processes killed at the same run: the fault is the run's, or the memory's."""
ONE_THREAD: dict[str, str] = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""A process per core: more threads than that only wait for each other."""
LOST = (
    f"{LOST_AT_MOST} processes were killed while they computed it, most likely since memory ran out: give fewer "
    "--jobs, and --retry."
)


@dataclass(frozen=True)
class Task:
    """How runs are computed; where and what they are is in the folder."""

    folder: Path
    device: str
    batch: int
    """Runs in one launch, at most."""
    keep_runs: bool


def run_here(task: Task, jobs: int, look: Callable[[Ledger], None]) -> None:
    """Compute all that waits with ``jobs`` processes, and calls ``look`` a few times a second.

    Killed processes are replaced, and what they held is computed again; interrupted, none is left behind.
    """
    crew: list[SpawnProcess] = []
    lost: Counter[str] = Counter()
    with Ledger(task.folder) as ledger:
        try:
            while True:
                crew = [process for process in crew if not _has_ended(process, ledger, lost)]
                wanted = min(jobs, len(crew) + ledger.count("waiting"))
                with _environment(ONE_THREAD), _deaf_to_interrupts():
                    crew += [_start(task) for _ in range(wanted - len(crew))]
                if not crew:
                    break
                wait([process.sentinel for process in crew], timeout=LOOK_EVERY_S)
                _end_stalled(crew, ledger)
                look(ledger)
            look(ledger)
        finally:
            for process in crew:
                process.kill()
            for process in crew:
                process.join()
                assert process.pid is not None, "it was started"
                ledger.put_back(ledger.held_by(process.pid))


def work(task: Task) -> None:
    """The life of one process: until no run waits."""
    end_with_parent()
    compute_all(task)


def compute_all(task: Task) -> None:
    """Claim after claim, each run to its result or to its reason in the ledger."""
    with Ledger(task.folder) as ledger:
        while (claim := ledger.claim(task.batch)) is not None:
            outcomes = seal(
                bench_of(task.folder, claim.entries[0]),
                [trial_of(entry) for entry in claim.entries],
                device=task.device,
                keep_runs=task.keep_runs,
                progress=_Heart(ledger, claim),
            )
            keep(task.folder, ledger, claim, outcomes)


def keep(folder: Path, ledger: Ledger, claim: Claim, outcomes: Sequence[Sealing | Failure]) -> None:
    """What became of the runs of a claim. Files first, then the ledger: what is done is there."""
    for entry, outcome in zip(claim.entries, outcomes, strict=True):
        if isinstance(outcome, Failure):
            ledger.fail(claim, entry.key, outcome.wall_s, outcome.reason, outcome.trace)
        else:
            digest = write_sealing(run_path(folder, entry.key), outcome, entry.settings)
            ledger.finish(claim, entry.key, outcome.wall_s, {**outcome.figures, "profile_sha256": digest})


def trial_of(entry: Entry) -> Trial:
    return Trial.model_validate_json(entry.trial)


def bench_of(folder: Path, entry: Entry) -> Bench:
    readings = trial_of(entry).readings
    return _bench(folder / "samples" / entry.sample, "" if readings is None else readings.model_dump_json())


@lru_cache(maxsize=1)
def _bench(sample: Path, readings: str) -> Bench:
    """The last one is kept, since runs of one sample mostly come one after the other."""
    return read_bench(sample, Readings.model_validate_json(readings) if readings else None)


class _Heart(Progress):
    """Says in the ledger how far a run is."""

    def __init__(self, ledger: Ledger, claim: Claim) -> None:
        self._ledger, self._claim = ledger, claim
        self._frames, self._last = 0, 0.0

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._frames = total
        self._beat(done)

    def advance(self, done: int, note: str = "") -> None:
        if time.monotonic() - self._last >= BEAT_EVERY_S:
            self._beat(done)

    def _beat(self, done: int) -> None:
        self._last = time.monotonic()
        self._ledger.beat(self._claim, done, self._frames)


def _start(task: Task) -> SpawnProcess:
    # A fresh process each: the threads of the libraries do not survive a fork.
    process = get_context("spawn").Process(target=work, args=(task,), name="sealtwin sweep")
    process.start()
    return process


def _has_ended(process: SpawnProcess, ledger: Ledger, lost: Counter[str]) -> bool:
    """Whether it has. What a killed process held is waiting again, or failed where that has happened too often."""
    if process.is_alive():
        return False
    process.join()
    assert process.pid is not None, "it was started"
    held = ledger.held_by(process.pid)
    # A signal's code is below 0; whoever sends one may send another.
    if (process.exitcode or 0) > 0 and not held:
        raise RuntimeError(f"A process of the sweep ended with code {process.exitcode} before it took a run.")
    lost.update(held)
    for key in held:
        if lost[key] >= LOST_AT_MOST:
            ledger.give_up(key, LOST)
    ledger.put_back(key for key in held if lost[key] < LOST_AT_MOST)
    return True


def _end_stalled(crew: Sequence[SpawnProcess], ledger: Ledger) -> None:
    stalled = ledger.silent_since(time.time() - STALLED_S)
    for process in crew:
        if process.pid in stalled:
            process.kill()


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Ctrl-C reaches the whole terminal. Processes started within are deaf to it, and end when the parent says so."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _environment(names: Mapping[str, str]) -> Iterator[None]:
    """For processes that are started within."""
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(names)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
