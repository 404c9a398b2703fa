"""Watchers that write files during a run of particles. The files are complete at any moment."""

import io
import math
import re
import time
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import opened
from sealtwin.core.run_folder import MANIFEST
from sealtwin.core.vtk_files import Frame, read_collection, write_collection, write_frame
from simulate.injection import SUBSTEP_FACTORS, Injection, Watcher
from simulate.setup.release_schedule import ROUNDING

EVERY_S = 10.0  # Wall time in s between checkpoints. Writing a checkpoint takes 10 ms for 15,000 particles.
LARGEST_CHECKPOINT_BYTES = 4_000_000_000  # Largest checkpoint that is read: 4 kB for each of a million particles
UNREADABLE = (OSError, InputError, KeyError, ValueError, EOFError, zipfile.BadZipFile)
"""Errors that are raised by reading a checkpoint that is damaged or of another version."""
PAST_THE_END = 1.02
"""A moment after the end of the run, but before this multiple of the run's duration, means the end. The paper shows a
picture at 15 s, but the nozzle of the reconstructed trial stops after 14.8 s."""
FRAME = re.compile(r"\d{4,}\.\d{3}s\.vtp")
PACE_EVERY = 10  # Number of frames per computing time


class Checkpoint(Watcher):
    """Watcher that saves a run's state at ``path``, and restores it in a run with the same ``key``."""

    def __init__(self, path: Path, key: str, note: Callable[[str], None]) -> None:
        """Prepare the watcher.

        ``key`` identifies all inputs of the run. ``note`` prints sentences about checkpoints.
        """
        self._path, self._key, self._note = path, key, note

    @property
    def finer(self) -> int:
        """``Injection.finer`` of the checkpoint. 1 if there is no checkpoint, or if ``begin`` would reject it."""
        try:
            content = self._content()
            return _finer(content) if str(content["key"]) == self._key else 1
        except UNREADABLE:
            return 1

    def begin(self, injection: Injection) -> None:
        if injection.finer > self.finer:
            # This replaces the checkpoint of the failed attempt, which would otherwise be repeated after a kill.
            self.keep(injection)
        elif self._path.is_file():
            self._note(f"{self._path.name}: {self._resume(injection)}")
        self._kept = time.monotonic()

    def after_frame(self, injection: Injection) -> None:
        if time.monotonic() - self._kept >= EVERY_S:
            self.keep(injection)
            self._kept = time.monotonic()

    def keep(self, injection: Injection) -> None:
        """Write the checkpoint. An incomplete file never gets the checkpoint's name."""
        with files.replacing(self._path) as temporary:
            np.savez(
                temporary,
                allow_pickle=False,
                key=np.array(self._key),
                finer=np.array(injection.finer),
                **injection.snapshot(),
            )

    def remove(self) -> None:
        """Remove the checkpoint of a finished run."""
        self._path.unlink(missing_ok=True)

    def _resume(self, injection: Injection) -> str:
        """Restore the checkpoint if it belongs to this run, and return a sentence about the outcome."""
        again = "the fluid run starts again at its first frame."
        try:
            content = self._content()
            if (str(content["key"]), _finer(content)) != (self._key, injection.finer):
                return f"is from a run with other settings, inputs or device; {again}"
            injection.restore(content)
        except UNREADABLE as fault:
            return f"is damaged ({fault}); {again}"
        return f"the run continues after frame {injection.done} of {injection.frames}, t = {injection.t_s:.2f} s."

    def _content(self) -> dict[str, NDArray[Any]]:
        """Return all arrays of the checkpoint, which are read before the run is changed. Reading detects damage."""
        with opened(self._path, LARGEST_CHECKPOINT_BYTES) as file, np.load(file, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}


def _finer(content: Mapping[str, Any]) -> int:
    """Return ``Injection.finer`` of a checkpoint. Raises KeyError or ValueError if it is missing or invalid."""
    finer = content["finer"]
    if finer.ndim or finer not in SUBSTEP_FACTORS:
        raise ValueError(f"finer is {finer}")
    return int(finer)


def take_frame(injection: Injection) -> Frame:
    """Return the current state of all particles of the first run that have left the nozzle."""
    injection.wait()
    state, out = injection.engine.state, injection.out
    return Frame(
        t_s=injection.t_s,
        position_mm=state.position_mm()[:out],
        velocity_mm_s=state.velocity_mm_s()[:out],
        age_s=(injection.done - injection.schedule.frame_of[:out]).astype(float) * injection.schedule.frame_s,
        # ParticleState and the kernels use the same numbers.
        density=state.by_release(state.density)[:out].astype(float),
        state=state.status_of()[:out],
    )


class Moments(Watcher):
    """Watcher that calls ``take`` with a frame at each of several moments."""

    def __init__(self, times_s: Sequence[float], take: Callable[[float, Frame], None]) -> None:
        """Prepare the watcher. ``times_s`` must increase.

        The arguments of ``take`` are the moment, and the frame at this moment or just after it.
        """
        self._all_s, self._take = times_s, take

    def begin(self, injection: Injection) -> None:
        """Skip the moments before the current frame of a resumed run, but not the moment of that frame."""
        # If a run is computed again, all moments are taken again.
        self._times_s = iter(self._all_s)
        self._next_s = next(self._times_s, math.inf)
        while self._due(injection) < injection.done:
            self._next_s = next(self._times_s, math.inf)
        self.after_frame(injection)

    def after_frame(self, injection: Injection) -> None:
        if injection.done < self._due(injection):
            return
        frame = take_frame(injection)
        while self._due(injection) <= injection.done:
            self._take(self._next_s, frame)
            self._next_s = next(self._times_s, math.inf)

    def _due(self, injection: Injection) -> float:
        """Return the number of finished frames at which the next moment is taken, at least one."""
        if math.isinf(self._next_s):
            return math.inf
        number = max(1, math.ceil(self._next_s / injection.schedule.frame_s - ROUNDING))
        return min(number, injection.frames) if number <= PAST_THE_END * injection.frames else number


class FrameFiles(Moments):
    """Watcher that writes frames of a run as files, and a collection file that lists these frames."""

    def __init__(self, collection: Path, times_s: Sequence[float]) -> None:
        super().__init__(times_s, self._write)
        self._collection, self._folder = collection, collection.parent

    def begin(self, injection: Injection) -> None:
        """Remove the frames of an earlier run, except frames up to a resumed run's frame, and not the user's files."""
        paths = sorted(self._folder.glob("*"))
        frames = read_collection(self._collection) if self._collection.is_file() else []
        self._frames = {path.name: t_s for t_s, path in frames if t_s <= injection.t_s and path in paths}
        for path in paths:
            if files.is_temporary(path) or (FRAME.fullmatch(path.name) and path.name not in self._frames):
                path.unlink()
        self._collection.unlink(missing_ok=True)
        if self._frames:
            self._collect()
        super().begin(injection)

    def _write(self, asked_s: float, frame: Frame) -> None:
        if frame.t_s in self._frames.values():
            return  # Another moment of the same frame, or just after the run's end
        name = f"{asked_s:08.3f}s.vtp"
        write_frame(self._folder / name, frame)
        self._frames[name] = frame.t_s
        self._collect()

    def _collect(self) -> None:
        write_collection(self._collection, [(t_s, name) for name, t_s in self._frames.items()])


class StillThere(Watcher):
    """Watcher that ends a run if its folder was removed, before other watchers write into a new folder."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._manifest = folder, folder / MANIFEST

    def after_frame(self, injection: Injection) -> None:
        if not self._manifest.is_file():
            raise InputError(
                f"{self._folder}: the folder was removed during the fluid run, so the run stopped. Run the trial again."
            )

    begin = after_frame


GRAIN_MM = 0.01  # Step to which positions are rounded, a tenth of a picture's pixel. It halves the size of the file


class KeptFill(Watcher):
    """Watcher that stores the frames at several moments and at the end, and the computing times of frames."""

    def __init__(self, snapshots_s: Iterable[float]) -> None:
        self._wanted_s = sorted(set(snapshots_s))

    def begin(self, injection: Injection) -> None:
        self._frames = list[Frame]()
        self._pace = list[tuple[float, float]]()  # Moving particles, and computing time so far in s
        end_s = injection.frames * injection.schedule.frame_s
        wanted_s = [t_s for t_s in self._wanted_s if t_s * PAST_THE_END < end_s]
        self._moments = Moments(wanted_s, lambda _, frame: self._frames.append(frame))
        self._moments.begin(injection)

    def after_frame(self, injection: Injection) -> None:
        self._moments.after_frame(injection)
        if injection.done % PACE_EVERY == 0:
            injection.wait()
            self._pace.append((injection.engine.movers.number(), injection.statistics.frames_s))
        if injection.done >= injection.frames or injection.at_rest:
            self._frames.append(take_frame(injection))

    def content(self) -> bytes:
        """Return the content of the file fill.npz. It takes 0.1 MB for 4,000 particles."""
        place_mm = np.concatenate([frame.position_mm for frame in self._frames])
        moving, so_far_s = np.array(self._pace).reshape(-1, 2).T
        target = io.BytesIO()
        np.savez_compressed(
            target,
            allow_pickle=False,
            t_s=np.array([frame.t_s for frame in self._frames]),
            particles=np.array([len(frame.state) for frame in self._frames]),
            place=np.rint(place_mm / GRAIN_MM).astype("<i4").T,
            age_s=np.concatenate([frame.age_s for frame in self._frames]).astype("<f4"),
            state=np.concatenate([frame.state for frame in self._frames]).astype("u1"),
            moving=moving,
            frame_ms=1000 * np.diff(so_far_s, prepend=0.0) / PACE_EVERY,
        )
        return target.getvalue()
