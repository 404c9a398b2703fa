"""The fill of a run as the pictures of a map need it: small enough for each run of a sweep to keep."""

import io
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import opened
from sealtwin.core.vtk_files import Frame
from simulate.watchers import PAST_THE_END, ROWS_EVERY, Moments, Watcher, take_frame

if TYPE_CHECKING:
    from simulate.injection import Injection
    from validate.figures.chart import Watched

LARGEST_FILL_BYTES = 1_000_000_000  # Of a million particles at forty moments
GRAIN_MM = 0.01  # Positions are rounded to it: a tenth of a pixel of a picture, and half the bytes


class KeptFill(Watcher):
    """A watcher that keeps a frame at each of some moments and at the end, and the computing times of frames."""

    def __init__(self, snapshots_s: Iterable[float]) -> None:
        self._wanted_s = sorted(set(snapshots_s))
        self._frames: list[Frame] = []
        self._pace: list[tuple[float, float]] = []  # Moving particles, and computing time so far in s

    def begin(self, injection: "Injection") -> None:
        self._frames, self._pace = [], []
        end_s = injection.frames * injection.schedule.frame_s
        wanted_s = [t_s for t_s in self._wanted_s if t_s * PAST_THE_END < end_s]
        self._moments = Moments(wanted_s, lambda _, frame: self._frames.append(frame))
        self._moments.begin(injection)

    def after_frame(self, injection: "Injection") -> None:
        self._moments.after_frame(injection)
        if injection.done % ROWS_EVERY == 0:
            injection.wait()
            self._pace.append((injection.engine.movers.number(), injection.statistics.frames_s))
        if injection.done >= injection.frames or injection.at_rest:
            self._frames.append(take_frame(injection))

    def content(self) -> bytes:
        """Return the content of the file fill.npz: for 4,000 particles 0.1 MB."""
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
            frame_ms=1000 * np.diff(so_far_s, prepend=0.0) / ROWS_EVERY,
        )
        return target.getvalue()


def read_fill(path: Path, differs_mm: float | None = None) -> "Watched":
    """Read a file fill.npz. Speeds and densities are NaN, since no map shows them. Raises InputError if damaged."""
    from validate.figures.chart import Watched

    try:
        with opened(path, LARGEST_FILL_BYTES) as file, np.load(file, allow_pickle=False) as arrays:
            content = {name: arrays[name] for name in arrays.files}
        at = np.cumsum(content["particles"])[:-1]
        places, ages, states = (np.split(content[name].T, at) for name in ("place", "age_s", "state"))
        frames = tuple(
            Frame(
                t_s=float(t_s),
                position_mm=place * GRAIN_MM,
                velocity_mm_s=np.full(place.shape, np.nan),
                age_s=age_s.astype(float),
                density=np.full(len(place), np.nan),
                state=state.astype(int),
            )
            for t_s, place, age_s, state in zip(content["t_s"], places, ages, states, strict=True)
        )
        moved = content["moving"] > 0
        return Watched(frames, content["moving"][moved], content["frame_ms"][moved], differs_mm)
    except (OSError, InputError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as fault:
        raise InputError(f"{path}: damaged ({fault}). Delete it; 'sealtwin map' then computes the run again.") from None
