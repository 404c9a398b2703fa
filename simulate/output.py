"""Watchers of a fluid run: its frames at chosen moments, the log of its health, and its checkpoints."""

import math
import time
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.errors import InputError, naming
from sealtwin.core.files import read_text, replacing, write_text
from sealtwin.core.plain_files import opened
from sealtwin.core.records import Frame, ParticleState
from simulate.injection import Injection
from simulate.setup.release_schedule import ROUNDING

PAST_THE_END = 1.02
"""Factor of a run's duration up to which a moment counts as its end: the paper shows 15 s, and the nozzle of the
reconstructed trial stops after 14.8 s."""
COLUMNS = (
    "frame",
    "t_s",
    "particles",
    "moving",
    "density_error_mean",
    "density_error_p95",
    "escaped",
    "spilled",
    "viscosity_iterations",
    "ms_a_frame",
)
"""``particles`` have left the nozzle. Density errors are compressions of those that move, over the rest density;
iterations a substep and ms are means since the previous row; where nothing moved, errors and iterations are empty.
"""
ROW_EVERY = 10  # Number of frames to a row
CHECKPOINT_EVERY_S = 10.0  # Wall time between checkpoints. Writing one takes 10 ms for 15,000 particles.
LARGEST_CHECKPOINT_BYTES = 4_000_000_000  # Limit of a checkpoint, some kilobytes for each of millions of particles


def take_frame(injection: Injection) -> Frame:
    """All particles of the first run that have left the nozzle, after its last frame."""
    injection.wait()
    state, out = injection.engine.state, injection.out
    return Frame(
        t_s=injection.t_s,
        position_mm=state.position_mm()[:out],
        velocity_mm_s=state.velocity_mm_s()[:out],
        age_s=(injection.done - injection.schedule.frame_of[:out]).astype(float) * injection.schedule.frame_s,
        # The numbers of ParticleState and of the kernels are the same.
        density=state.by_release(state.density)[:out].astype(float),
        state=state.status_of()[:out],
    )


class Moments:
    """A watcher that hands over a frame at each of some moments."""

    def __init__(self, times_s: Iterable[float], take: Callable[[float, Frame], None]) -> None:
        """``times_s`` increase and may be endless; ``take`` receives the moment, and the frame at or just after it."""
        self._times_s, self._take = iter(times_s), take
        self._next_s = math.inf

    def begin(self, injection: Injection) -> None:
        """Skip the moments before a resumed run's frame; a moment of that frame itself may not be taken yet."""
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
        """Number of frames at which the next moment is due, at least one."""
        if math.isinf(self._next_s):
            return math.inf
        number = max(1, math.ceil(self._next_s / injection.schedule.frame_s - ROUNDING))
        return min(number, injection.frames) if number <= PAST_THE_END * injection.frames else number


class HealthLog:
    """A watcher that adds rows to health.csv, flushed at once so that a kill loses none."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._solves, self._frames_s, self._frame = 0, 0.0, 0

    def begin(self, injection: Injection) -> None:
        """Keep the rows up to a resumed run's frame, or start a new file."""
        rows = read_text(self._path).splitlines()[1:] if injection.done and self._path.is_file() else []
        kept = [row for row in rows if row.count(",") == len(COLUMNS) - 1 and int(row.split(",")[0]) <= injection.done]
        # A new file, since the name may be a link to another one.
        write_text(self._path, "\n".join([",".join(COLUMNS), *kept, ""]))
        self._look_back(injection)

    def after_frame(self, injection: Injection) -> None:
        if injection.done % ROW_EVERY == 0:
            with naming(self._path), self._path.open("a", encoding="utf-8", newline="\n") as file:
                file.write(",".join(self._row(injection)) + "\n")
            self._look_back(injection)

    def _row(self, injection: Injection) -> list[str]:
        injection.wait()
        engine, statistics = injection.engine, injection.statistics
        moving = engine.movers.number()
        mover = engine.movers.movers.particle.numpy()[:moving]
        error = np.maximum(engine.state.density.numpy()[mover] - 1.0, 0.0)
        status = engine.state.status.numpy()
        solves = statistics.solves[self._solves :]
        values: dict[str, Any] = {
            "frame": injection.done,
            "t_s": f"{injection.t_s:.4f}",
            "particles": injection.out,
            "moving": moving,
            "density_error_mean": f"{error.mean():.6f}" if moving else "",
            "density_error_p95": f"{np.quantile(error, 0.95):.6f}" if moving else "",
            "escaped": int((status == int(ParticleState.ESCAPED)).sum()),
            "spilled": int((status == int(ParticleState.SPILLED)).sum()),
            "viscosity_iterations": f"{np.mean(solves):.2f}" if solves else "",
            "ms_a_frame": f"{1000 * (statistics.frames_s - self._frames_s) / (injection.done - self._frame):.3f}",
        }
        return [str(values[name]) for name in COLUMNS]

    def _look_back(self, injection: Injection) -> None:
        """Start the means of the next row."""
        self._solves, self._frames_s = len(injection.statistics.solves), injection.statistics.frames_s
        self._frame = injection.done


class Checkpoint:
    """A watcher that keeps a run's state at ``path``, and restores it in a run of the same ``key``.

    A killed run continues from its last checkpoint, to the same bits on a CPU.
    """

    def __init__(self, path: Path, key: str, note: Callable[[str], None]) -> None:
        """``key`` stands for all that the run depends on. ``note`` receives what was done with a checkpoint."""
        self._path, self._key, self._note = path, key, note
        self._kept = time.monotonic()

    def begin(self, injection: Injection) -> None:
        if self._path.is_file():
            self._note(f"{self._path.name}: {self._resume(injection)}")
        self._kept = time.monotonic()

    def after_frame(self, injection: Injection) -> None:
        if time.monotonic() - self._kept >= CHECKPOINT_EVERY_S:
            self.keep(injection)
            self._kept = time.monotonic()

    def keep(self, injection: Injection) -> None:
        """Write the file, complete or not at all."""
        with replacing(self._path) as temporary:
            np.savez(temporary, allow_pickle=False, key=np.array(self._key), **injection.snapshot())

    def remove(self) -> None:
        """Remove the checkpoint of a finished run."""
        self._path.unlink(missing_ok=True)

    def _resume(self, injection: Injection) -> str:
        """Restore the checkpoint, if it is one of this run; returns the outcome in words."""
        again = "the fluid run starts again at its first frame."
        try:
            with opened(self._path, LARGEST_CHECKPOINT_BYTES) as file, np.load(file, allow_pickle=False) as arrays:
                # Read completely before anything is changed: reading finds damage.
                content: dict[str, NDArray[Any]] = {name: arrays[name] for name in arrays.files}
            if str(content["key"]) != self._key:
                return f"kept by a run with other settings, inputs or device; {again}"
            injection.restore(content)
        except (OSError, InputError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as fault:
            return f"damaged ({fault}); {again}"
        return f"going on after frame {injection.done} of {injection.frames}, t = {injection.t_s:.2f} s."
