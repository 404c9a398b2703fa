"""Checkpoints: a killed run continues from its last one, to the same bits on a CPU."""

import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.errors import InputError
from sealtwin.core.files import replacing
from sealtwin.core.plain_files import opened
from simulate.injection import Injection

EVERY_S = 10.0  # Wall time between checkpoints. Writing one takes 10 ms for 15,000 particles.
LARGEST_CHECKPOINT_BYTES = 4_000_000_000  # Limit of a checkpoint, some kilobytes for each of millions of particles


class Checkpoint:
    """A watcher that keeps a run's state at ``path``, and restores it in a run of the same ``key``."""

    def __init__(self, path: Path, key: str, note: Callable[[str], None]) -> None:
        """``key`` stands for all that the run depends on. ``note`` receives what was done with a checkpoint."""
        self._path, self._key, self._note = path, key, note
        self._kept = time.monotonic()

    def begin(self, injection: Injection) -> None:
        if self._path.is_file():
            self._note(f"{self._path.name}: {self._resume(injection)}")
        self._kept = time.monotonic()

    def after_frame(self, injection: Injection) -> None:
        if time.monotonic() - self._kept >= EVERY_S:
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
