"""State on the device of the particles of one run, or of several runs together, in centimetres and seconds."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray
from warp.utils import array_scan

from sealtwin.core.records import Floats, Integers
from simulate.fluid.launcher import Launcher
from simulate.fluid.walk import Extent
from simulate.kernels import movers as listing
from simulate.kernels import status as device_code
from simulate.kernels.neighbours import NOWHERE_CM
from simulate.setup.release_schedule import Schedule
from simulate.setup.signed_distance import CM

SPARE = 2  # Entries after the last particle: a dummy particle that pads lists, and space for loads of sixteen bytes
KEPT = (
    *("position", "velocity", "earlier_velocity", "density", "volume_and_viscosity", "pressed", "free", "wall"),
    *("status", "number", "release_frame", "quiet_s"),
)
"""Names of the arrays that later substeps need. A checkpoint uses the same names."""
NOWHERE_FREE = (0.0, 0.0, 0.0, -1e3)
"""Free ball (ball without walls) of a particle for which walls have not been searched yet. No position is in it."""


def reader(array: wp.array) -> Callable[[], NDArray[Any]]:
    """Return a function that reads an array, which must never be replaced. On a CPU, calls return the same view."""
    if str(array.device) != "cpu":
        return array.numpy
    view = array.numpy()
    return lambda: view


class State:
    """All particles, run by run. All ``runs`` have the same release schedule.

    At the start, the particles are in the order of release. ``renumber`` changes the order of the released particles.
    ``number`` is the position of each particle in the order of release. Methods that return a value for each particle
    use the order of release. Particles that are not released yet have the position and velocity of their release.
    """

    def __init__(self, schedule: Schedule, device: str, runs: int = 1) -> None:
        self.device, self.runs, self.particles_per_run = device, runs, schedule.particles
        self._released = schedule.released
        self._columns: list[wp.array] = []
        self.particles = particles = device_code.Particles()  # Struct of these arrays, which is passed to kernels
        zeros, full = partial(wp.zeros, device=device), partial(wp.full, device=device)
        count, per_run = self.count, schedule.particles
        none, position = np.zeros((per_run, 3)), schedule.position_mm * CM
        self.position = particles.position = _padded(np.pad(position, ((0, 0), (0, 1))), runs, wp.vec4, device)
        self.velocity = particles.velocity = _padded(schedule.velocity_mm_s * CM, runs, wp.vec3, device)
        self.earlier_velocity = particles.earlier_velocity = wp.clone(self.velocity)
        self.scaled_residual = particles.scaled_residual = _padded(none, runs, wp.vec3, device)
        self.density = particles.density = full(count, 1.0, float)
        self.volume_and_viscosity = particles.volume_and_viscosity = _padded(none[:, :2], runs, wp.vec2, device)
        self.pressed = particles.pressed = zeros(count, wp.vec4)
        self.wall = particles.wall = zeros(count, wp.vec4)
        self.free = particles.free = full(count, wp.vec4(*NOWHERE_FREE), wp.vec4)
        self.status = particles.status = full(count, int(device_code.WAITING), int)
        self.number = wp.array(np.arange(count), int, device=device)
        """Position of each particle in the order of release, over all runs."""
        self.index = wp.clone(self.number)
        """Index in memory of each particle, in the order of release."""
        self.release_frame = particles.release_frame = wp.array(np.tile(schedule.frame_of, runs), int, device=device)
        self.quiet_s = particles.quiet_s = zeros(count)
        self.fault = particles.fault = self.column(int)
        """Faults of each particle so far. Each kind of fault is one bit."""
        self.frame = particles.frame = full(1, -1, int)
        self.present = full(1, count, int)
        """Number of particles, counted from the first particle, that may have been released. Launches process only
        these particles."""
        particles.mover_count = zeros(1, int)
        self.swelling = particles.swelling = full(runs, 1.0, float)
        particles.per_run = per_run
        particles.moved = self.scaled_residual
        particles.previous_position = wp.array(np.tile(position, (runs, 1)), wp.vec3, device=device)
        particles.density_before = self.column(float)
        self._columns += [particles.previous_position, self.scaled_residual, *self.lasting().values()]

    @property
    def count(self) -> int:
        """Number of all particles, released or not. As an index, it is the dummy particle after the last particle."""
        return self.runs * self.particles_per_run

    def own(self, run: int) -> slice:
        """Return the slice of a run's particles."""
        return slice(run * self.particles_per_run, (run + 1) * self.particles_per_run)

    def released(self, frame: int) -> int:
        """Return the number of particles of a run that are released up to and including a frame."""
        return int(self._released[min(frame, len(self._released) - 1)])

    def lasting(self) -> dict[str, Any]:
        """Return the arrays that later substeps need, by name."""
        return {name: getattr(self, name) for name in KEPT}

    def column(self, dtype: type) -> Any:
        """Return an array of zeros with one value per particle. The array is renumbered together with the particles."""
        self._columns.append(wp.zeros(self.count, dtype, self.device))
        return self._columns[-1]

    def renumber(self, order: Integers) -> None:
        """Move particle ``order[k]`` to index k, for each k from 0 to n - 1.

        ``order`` is (n,). Particles stay within the indices of their run.
        """
        for column in self._columns:
            column[: len(order)].assign(column.numpy().take(order, axis=0))
        self.find_places()

    def find_places(self) -> None:
        """Compute ``index``, the inverse of ``number``."""
        index = np.empty(self.count, np.int32)
        index[np.asarray(self.number.numpy(), np.int64)] = np.arange(self.count, dtype=np.int32)
        self.index.assign(index)

    def by_release(self, column: wp.array) -> Any:
        """Return a copy of an array that has a value for each particle, sorted into the order of release."""
        values, release_index = column.numpy(), np.asarray(self.number.numpy(), np.int64)
        ordered = np.empty_like(values)
        ordered[release_index] = values
        return ordered

    def position_mm(self) -> Floats:
        """Return the positions of all particles in mm, (count, 3)."""
        return self.by_release(self.position)[:, :3].astype(float) / CM

    def velocity_mm_s(self) -> Floats:
        """Return the velocities of all particles in mm/s, (count, 3)."""
        return self.by_release(self.velocity).astype(float) / CM

    def status_of(self) -> Integers:
        """Return the status of all particles, (count,), as numbers of ``kernels.status``."""
        return self.by_release(self.status).astype(np.int64)


def _padded(rows: Floats, runs: int, dtype: type, device: str) -> Any:
    """Return an array with ``rows`` repeated ``runs`` times, and readable entries after its end."""
    spare = np.full((SPARE, rows.shape[1]), NOWHERE_CM if dtype is wp.vec4 else 0.0)
    whole = wp.array(np.concatenate([np.tile(rows, (runs, 1)), spare]), dtype, device=device)
    return whole[: runs * len(rows)]


class MoversList:
    """List of the particles that move. The list is made anew in each frame, because particles start and stop moving."""

    def __init__(self, state: State, launcher: Launcher, in_order: bool | None = None) -> None:
        """Prepare the list. ``in_order`` is True if one thread processes all particles in order, as on a CPU.

        If None, this depends on the device.
        """
        device = state.device
        self._state, self.sorted = state, False
        self._in_order = device == "cpu" if in_order is None else in_order
        state.particles.mover = wp.zeros(state.count, int, device)
        self._count = reader(state.particles.mover_count)
        state.particles.first_row = wp.zeros(state.runs + 1, int, device)
        self._order = listing.Order()
        self._order.row = wp.zeros(0 if self._in_order else state.count, int, device)
        by_cell, moving = (0, 1), state.particles
        if self._in_order:
            # There is only one slice, with any number of threads.
            whole = Extent(state.present, state.count)
            self._list = [
                launcher.bind(listing.list_in_order, moving, self._order, way, extent=whole) for way in by_cell
            ]
        else:
            self._mark = [launcher.bind_first(listing.mark_movers, moving, self._order, way) for way in by_cell]
            self._list_marked = [launcher.bind_first(listing.list_marked, moving, self._order, way) for way in by_cell]

    def find(self, count: int) -> None:
        """List the moving particles among the first ``count`` particles of all runs, in the order of memory."""
        # On a GPU, the number of movers is computed at the last particle.
        self._list_first(count if self._in_order else self._state.count, by_cell=False)

    def sort(self, number: wp.array, count: int) -> None:
        """Sort a new list of moving particles by cells. ``number`` has the first ``count`` particles, cell by cell.

        Successive rows then have common neighbours, which are still in a processor's cache. The order is kept for the
        whole frame, in which particles move little.
        """
        self._order.number = number
        self._list_first(count, by_cell=True)

    def _list_first(self, count: int, *, by_cell: bool) -> None:
        if self._in_order:
            # At least one row is needed. Without rows, the list would not be updated.
            self._list[by_cell](max(count, 1))
            return
        self._mark[by_cell](count)
        row: Any = self._order.row[:count]
        array_scan(row, row, inclusive=False)
        self._list_marked[by_cell](count)

    def number(self) -> int:
        """Return the number of moving particles of all runs."""
        return int(self._count()[0])
