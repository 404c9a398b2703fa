"""The log of a run's health: a row of health.csv every few frames."""

from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core.errors import naming
from sealtwin.core.files import read_text, write_text
from sealtwin.core.records import ParticleState
from simulate.injection import Injection

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
EVERY = 10  # Number of frames to a row


class HealthLog:
    """A watcher that adds rows to a file, flushed at once so that a kill loses none."""

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
        if injection.done % EVERY == 0:
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
