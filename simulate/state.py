"""The particles of one run, or of several at once, on the device. Centimetres and seconds."""

from typing import Any

import numpy as np
import warp as wp

from sealtwin.records import Floats
from simulate import kernels_rest as device_code
from simulate.distance import CM
from simulate.neighbours import NOWHERE_CM
from simulate.nozzle import Schedule

SPARE = 2
"""Entries behind the last particle: nobody, with whom lists are filled up, and what a load of sixteen bytes reads."""


class State:
    """All particles in the order of release, run by run; ``runs`` share one schedule.

    Those still to come lie where and move as they will be released.
    """

    def __init__(self, schedule: Schedule, device: str, runs: int = 1) -> None:
        self.device, self.runs, self.points_a_run = device, runs, schedule.particles
        self._released = schedule.released
        count = runs * schedule.particles
        self.place = _padded(np.pad(schedule.position_mm * CM, ((0, 0), (0, 1))), runs, wp.vec4, device)
        """Position, and the multiplier of the density constraint: RESTS where a particle rests."""
        self.velocity = _padded(schedule.velocity_mm_s * CM, runs, wp.vec3, device)
        self.start = wp.zeros(count, dtype=wp.vec3, device=device)
        """Where each was before the substep."""
        self.direction = _padded(np.zeros((schedule.particles, 3)), runs, wp.vec3, device)
        """Of the viscosity's search; zero for who rests."""
        self.density = wp.full(count, 1.0, dtype=float, device=device)
        self.bulk = _padded(np.zeros((schedule.particles, 2)), runs, wp.vec2, device)
        """Volume m/rho in cm3, and thickness: the weight of a particle's pairs in the viscosity."""
        self.frame_of = wp.array(np.tile(schedule.frame_of, runs), dtype=int, device=device)
        self.fate = wp.full(count, int(device_code.WAITING), dtype=int, device=device)
        self.frame = wp.full(1, -1, dtype=int, device=device)
        """The number of the frame that runs, or ran last; -1 before the first."""

    @property
    def nobody(self) -> int:
        """A number that stands for no particle, and may be read like one."""
        return self.count

    @property
    def count(self) -> int:
        """Of all particles, those still to come included."""
        return self.runs * self.points_a_run

    def own(self, run: int) -> slice:
        """The particles of a run."""
        return slice(run * self.points_a_run, (run + 1) * self.points_a_run)

    def released(self, frame: int) -> int:
        """Particles of a run that are out once a frame's release is made."""
        return int(self._released[min(frame, len(self._released) - 1)])

    def lasting(self) -> dict[str, Any]:
        """Arrays that a substep takes over from the one before, by name."""
        names = ("place", "velocity", "density", "bulk", "fate")
        return {name: getattr(self, name) for name in names}

    def position_mm(self) -> Floats:
        """Of all particles, (count, 3)."""
        return self.place.numpy()[:, :3].astype(float) / CM

    def velocity_mm_s(self) -> Floats:
        """Of all particles, (count, 3)."""
        return self.velocity.numpy().astype(float) / CM


def _padded(rows: Floats, runs: int, dtype: type, device: str) -> Any:
    """An array with entries behind its end that may be read."""
    spare = np.full((SPARE, rows.shape[1]), NOWHERE_CM if dtype is wp.vec4 else 0.0)
    whole = wp.array(np.concatenate([np.tile(rows, (runs, 1)), spare]), dtype=dtype, device=device)
    return whole[: runs * len(rows)]
