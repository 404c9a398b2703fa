"""Who watches a fluid run for its folder: checkpoint, frames, snapshots, health, progress."""

import itertools
import time
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from sealtwin.errors import InputError
from sealtwin.output import CHECKPOINT, FRAMES, SNAPSHOTS, Output
from sealtwin.records import Floats, Frame
from sealtwin.store.files import write_json
from sealtwin.store.tables import read_table
from sealtwin.store.vtk_files import time_of_frame, write_collection, write_frame
from simulate.checkpoint import Checkpoint
from simulate.frames import Moments
from simulate.health import COLUMNS, HealthLog
from simulate.injection import Injection

HEALTH = "health.csv"
PROGRESS = "progress.json"
PROGRESS_EVERY_S = 1.0


class FrameFiles:
    """Watches a run and writes frames beside a collection, which is whole at any moment."""

    def __init__(self, collection: Path, times_s: Iterable[float]) -> None:
        self._collection, self._folder = collection, collection.parent
        self._moments = Moments(times_s, self._take)
        self._frames: dict[str, float] = {}

    def begin(self, injection: Injection) -> None:
        """What lies there goes, but for frames that a resumed run has behind it."""
        for stale in self._folder.glob(".*"):
            stale.unlink()  # What a kill left of a file that was being written.
        found = sorted(self._folder.glob("*s.vtp"))
        times = {path.name: _time_or_none(path) for path in found}
        self._frames = {name: t_s for name, t_s in times.items() if t_s is not None and t_s <= injection.t_s}
        for path in found:
            if path.name not in self._frames:
                path.unlink()
        self._collection.unlink(missing_ok=True)
        if self._frames:
            self._collect()
        self._moments.begin(injection)

    def after_frame(self, injection: Injection) -> None:
        self._moments.after_frame(injection)

    def _take(self, asked_s: float, frame: Frame) -> None:
        if frame.t_s in self._frames.values():
            return  # Several moments in one frame of the run, or just past its end.
        name = f"{asked_s:08.3f}s.vtp"
        write_frame(self._folder / name, frame)
        self._frames[name] = frame.t_s
        self._collect()

    def _collect(self) -> None:
        write_collection(self._collection, [(t_s, name) for name, t_s in self._frames.items()])


class ProgressFile:
    """Watches a run and says in a small JSON how far it is, at most once a second: for other programs.

    Held as a context around the run, it says at its end how that was.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._injection: Injection | None = None
        self._began = self._written = 0.0
        self._before = 0

    def begin(self, injection: Injection) -> None:
        self._injection, self._before = injection, injection.done
        self._began = time.monotonic()
        self._write("running")

    def after_frame(self, injection: Injection) -> None:
        if time.monotonic() - self._written >= PROGRESS_EVERY_S:
            self._write("running")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, fault: BaseException | None, _: TracebackType | None) -> None:
        if self._injection is not None:
            stopped = kind is not None and issubclass(kind, KeyboardInterrupt)
            state = "finished" if kind is None else "interrupted" if stopped else "failed"
            self._write(state, str(fault) if state == "failed" else None)

    def _write(self, state: str, fault: str | None = None) -> None:
        run = self._injection
        assert run is not None, "begun before"
        self._written = time.monotonic()
        # A bed at rest ends a run before its last frame.
        frames = run.done if state == "finished" else run.frames
        here = run.done - self._before
        eta_s = round((self._written - self._began) * (frames - run.done) / here, 1) if here else None
        write_json(
            self._path,
            {
                "version": 1,
                "stage": "simulate",
                "state": state,
                "error": fault,
                "frame": run.done,
                "frames": frames,
                "t_s": round(run.t_s, 4),
                "percent": round(100 * run.done / frames, 1),
                "eta_s": eta_s if state == "running" else None,
                "particles": run.out,
                "moving": run.moving,
                "updated_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            },
        )


def watch(
    folder: Path, output: Output, key: str, note: Callable[[str], None]
) -> tuple[Checkpoint, FrameFiles, FrameFiles, HealthLog]:
    """All that a run folder keeps of a run as it goes; ``key`` stands for all that the run depends on.

    The checkpoint is first: it may put the run further on before the others begin, and is kept after they wrote.
    """
    every_s = output.frames_every_s
    return (
        Checkpoint(folder / CHECKPOINT, f"{key} {output.model_dump_json()}", note),
        FrameFiles(folder / FRAMES, () if every_s is None else (every_s * number for number in itertools.count())),
        FrameFiles(folder / SNAPSHOTS, sorted(set(output.snapshots_s))),
        HealthLog(folder / HEALTH),
    )


def read_health(folder: Path) -> dict[str, Floats]:
    """The columns of health.csv, NaN where a row had nothing to say."""
    return dict(zip(COLUMNS, read_table(folder / HEALTH, COLUMNS).T, strict=True))


def _time_or_none(path: Path) -> float | None:
    """Of a frame; None of one that is damaged: a run that is resumed does not need it to go on."""
    try:
        return time_of_frame(path)
    except InputError:
        return None
