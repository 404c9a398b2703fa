"""The particles of one run, or of several at once, on the device. Centimetres and seconds."""

from typing import Any

import numpy as np
import warp as wp
from warp.utils import array_scan

from sealtwin.core.records import Floats, Integers
from simulate.fluid.launcher import Launcher
from simulate.kernels import movers as listing
from simulate.kernels import status as device_code
from simulate.kernels.neighbours import NOWHERE_CM
from simulate.setup.release_schedule import Schedule
from simulate.setup.signed_distance import CM

SPARE = 2  # Entries behind the last particle: a dummy particle that pads lists, and room for loads of sixteen bytes
KEPT_AS = {
    "place": "position",
    "velocity": "velocity",
    "earlier_velocity": "earlier_velocity",
    "density": "density",
    "bulk": "volume_and_viscosity",
    "pressed": "pressed",
    "free": "free",
    "wall": "wall",
    "fate": "status",
    "number": "number",
    "released_in": "release_frame",
    "quiet_s": "quiet_s",
}
"""Arrays that outlast a substep, by their names in a checkpoint; some of the names are older than ours."""
NOWHERE_FREE = (0.0, 0.0, 0.0, -1e3)
"""Free ball of a particle that never asked for walls: no place lies in it, nor near it."""


class State:
    """All particles, run by run; the ``runs`` share one schedule.

    They begin in the order of release. ``renumber`` gives those that are out another one, as ``number`` says; what this
    class returns by particle is in the order of release. Particles that are not released yet have the position and
    velocity of their release.
    """

    def __init__(self, schedule: Schedule, device: str, runs: int = 1) -> None:
        self.device, self.runs, self.particles_per_run = device, runs, schedule.particles
        self._released = schedule.released
        self._columns: list[wp.array] = []
        count = self.count
        self.position = _padded(np.pad(schedule.position_mm * CM, ((0, 0), (0, 1))), runs, wp.vec4, device)
        self.velocity = _padded(schedule.velocity_mm_s * CM, runs, wp.vec3, device)
        self.earlier_velocity = wp.clone(self.velocity)
        self.scaled_residual = _padded(np.zeros((schedule.particles, 3)), runs, wp.vec3, device)
        self.density = wp.full(count, 1.0, dtype=float, device=device)
        self.volume_and_viscosity = _padded(np.zeros((schedule.particles, 2)), runs, wp.vec2, device)
        self.pressed, self.wall = (wp.zeros(count, dtype=wp.vec4, device=device) for _ in range(2))
        self.free = wp.full(count, wp.vec4(*NOWHERE_FREE), dtype=wp.vec4, device=device)
        self.status = wp.full(count, int(device_code.WAITING), dtype=int, device=device)
        self.number = wp.array(np.arange(count), dtype=int, device=device)
        """Place of each particle in the order of release, over all runs."""
        self.release_frame = wp.array(np.tile(schedule.frame_of, runs), dtype=int, device=device)
        self.quiet_s = wp.zeros(count, dtype=float, device=device)
        self.fault = self.column(int)
        """Faults of each particle so far, one bit each."""
        self.frame = wp.full(1, -1, dtype=int, device=device)
        self.swelling = wp.full(runs, 1.0, dtype=float, device=device)
        self.particles = device_code.Particles()  # The struct of these arrays that kernels take
        self.particles.per_run = schedule.particles
        for name in ("scaled_residual", "frame", "swelling", "fault", *KEPT_AS.values()):
            if name != "number":
                setattr(self.particles, name, getattr(self, name))
        self.particles.moved = self.scaled_residual
        everywhere = np.tile(schedule.position_mm * CM, (runs, 1))
        self.particles.previous_position = wp.array(everywhere, dtype=wp.vec3, device=device)
        self.particles.density_before = self.column(float)
        self._columns += [self.particles.previous_position, self.scaled_residual, *self.lasting().values()]

    @property
    def count(self) -> int:
        """Number of all particles, released or not; as an index, the dummy particle behind them."""
        return self.runs * self.particles_per_run

    def own(self, run: int) -> slice:
        """The particles of a run."""
        return slice(run * self.particles_per_run, (run + 1) * self.particles_per_run)

    def released(self, frame: int) -> int:
        """Number of a run's particles that are out once a frame's release is made."""
        return int(self._released[min(frame, len(self._released) - 1)])

    def release_by(self, released: Integers, frame: int) -> None:
        """Release by another list, which may grow on the way; no particle before ``frame`` unless it is placed."""
        self._released = released
        self.release_frame.fill_(frame)

    def place(self, own: slice, position_cm: Floats, velocity_cm_s: Floats, frame: int) -> None:
        """Put particles that are not released yet where and when they leave; on a CPU, whose arrays are views."""
        self.position.numpy()[own, :3] = position_cm
        self.particles.previous_position.numpy()[own] = position_cm
        for velocity in (self.velocity, self.earlier_velocity):
            velocity.numpy()[own] = velocity_cm_s
        self.release_frame.numpy()[own] = frame

    def lasting(self) -> dict[str, Any]:
        """Arrays that outlast a substep, by their names in a checkpoint."""
        return {kept: getattr(self, name) for kept, name in KEPT_AS.items()}

    def column(self, dtype: type) -> Any:
        """Return an array of zeros, one for each particle, that is renumbered with them."""
        self._columns.append(wp.zeros(self.count, dtype=dtype, device=self.device))
        return self._columns[-1]

    def renumber(self, order: Integers) -> None:
        """Move the particle from ``order[k]`` to place k, for the first n, (n,); none leaves its own run's places."""
        for column in self._columns:
            column[: len(order)].assign(column.numpy().take(order, axis=0))

    def by_release(self, column: wp.array) -> Any:
        """Values by particle in the order of release, a copy."""
        values, place = column.numpy(), np.asarray(self.number.numpy(), dtype=np.int64)
        found = np.empty_like(values)
        found[place] = values
        return found

    def position_mm(self) -> Floats:
        """Positions of all particles, (count, 3)."""
        return self.by_release(self.position)[:, :3].astype(float) / CM

    def velocity_mm_s(self) -> Floats:
        """Velocities of all particles, (count, 3)."""
        return self.by_release(self.velocity).astype(float) / CM

    def status_of(self) -> Integers:
        """Status of all particles, (count,), by the numbers of ``kernels.status``."""
        return self.by_release(self.status).astype(np.int64)


def _padded(rows: Floats, runs: int, dtype: type, device: str) -> Any:
    """An array of ``runs`` times ``rows`` with readable entries behind its end."""
    spare = np.full((SPARE, rows.shape[1]), NOWHERE_CM if dtype is wp.vec4 else 0.0)
    whole = wp.array(np.concatenate([np.tile(rows, (runs, 1)), spare]), dtype=dtype, device=device)
    return whole[: runs * len(rows)]


class MoversList:
    """The list of particles that move, made anew in each frame: some are released, freeze, fall asleep or wake."""

    def __init__(self, state: State, launcher: Launcher, in_order: bool | None = None) -> None:
        """``in_order`` says that one thread takes all particles in order, as on a CPU; None asks the device."""
        device = state.device
        self._state, self._sorted = state, False
        self._in_order = device == "cpu" if in_order is None else in_order
        state.particles.mover = wp.zeros(state.count, dtype=int, device=device)
        state.particles.movers = wp.zeros(1, dtype=int, device=device)
        state.particles.first_row = wp.zeros(state.runs + 1, dtype=int, device=device)
        self._order = listing.Order()
        self._order.row = wp.zeros(0 if self._in_order else state.count, dtype=int, device=device)
        ways = [(state.particles, self._order, by_cell) for by_cell in (0, 1)]
        if self._in_order:
            self._list = [launcher.bind(listing.list_in_order, *way) for way in ways]
        else:
            self._mark = [launcher.bind_first(listing.mark_movers, *way) for way in ways]
            self._list_marked = [launcher.bind_first(listing.list_marked, *way) for way in ways]

    def find(self, count: int) -> None:
        """List them in the order in which they lie in memory, among the first ``count`` particles.

        Of several runs ``count`` is that of all.
        """
        self._sorted = False
        # A GPU finds the number of movers at the last particle.
        self._list_first(count if self._in_order else self._state.count, by_cell=False)

    def sort(self, number: wp.array, count: int) -> None:
        """Put movers just found into the order of ``number``, the first ``count`` particles cell by cell.

        Rows that follow each other then have neighbours in common, which a processor still has at hand; a frame is too
        short for them to part.
        """
        if self._sorted:
            return
        self._sorted = True
        self._order.number = number
        self._list_first(count, by_cell=True)

    def _list_first(self, count: int, *, by_cell: bool) -> None:
        if self._in_order:
            # One slice, however many threads there are; without a row nothing is launched, and the list would stay.
            self._list[by_cell](max(count, 1), each=0.0)
            return
        self._mark[by_cell](count)
        row: Any = self._order.row[:count]
        array_scan(row, row, inclusive=False)
        self._list_marked[by_cell](count)

    def number(self) -> int:
        """Number of movers, over all runs."""
        return int(self._state.particles.movers.numpy()[0])
