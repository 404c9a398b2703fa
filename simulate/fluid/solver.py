"""Compute the substep of the paper's Algorithm 1 (``FluidSolver.step``), and frames that consist of substeps."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from sealtwin.core.records import Floats, Integers
from simulate.fluid.cell_grid import MAX_ROOM, CellGrid, make_room, neighbour_lists
from simulate.fluid.fault_checks import FaultChecks
from simulate.fluid.launcher import Launcher, record
from simulate.fluid.pressure import Iterations, Pressure, iterations_of, smoothing_of
from simulate.fluid.state import MoversList, State, reader
from simulate.fluid.viscosity import Viscosity
from simulate.fluid.walk import Extent, fixed
from simulate.kernels import movers, neighbours, pressure, status
from simulate.kernels.lanes import WARP
from simulate.kernels.pair_kernels import pair_kernels
from simulate.settings import LEVEL, Solver, particle_volume
from simulate.setup.resolution import RESOLUTIONS
from simulate.setup.rheology import Rheology, paste_on_device
from simulate.setup.signed_distance import Barrier
from simulate.setup.wall_particles import WallParticles, calibrated_wall_mass, source_wall_mass

MORE_ROOM = 9 / 8  # Factor by which the room of packed lists is enlarged if it is too small
GRAVITY_CM_S2 = 981.0
SLOWEST_SHEAR = 0.002
"""Shear rate in 1/s below which the viscosity of paste with a yield stress is constant. With a lower value, float32
would be too coarse."""
QUIET_SHEAR = 0.015
"""Shear rate in 1/s below which a particle may sleep. The particle's speed must also be below this rate times h, which
is 0.06 particle radii per second. With 0.1, paste that flows back along a slope falls asleep too early, up to 1.4 mm
from its final position."""
PATIENCE_S = 0.5
"""Time in s for which a particle must be below ``QUIET_SHEAR`` before it sleeps. With 0.45, paste with a yield stress
of 20 Pa and carried-over pressure falls asleep while it sags, and its settled level is off by 0.14 and not 0.06 mm."""
AGAIN_S = 0.15  # The same time for a woken particle. It is shorter, so that paste beside a flow soon sleeps again.
WAKING_CM_S = 0.5  # Speed of a neighbour that wakes a particle, as in the prototype
RESTLESS_S = 0.1  # A slower neighbour wakes a particle if it has moved for this time in s
ROWS_TOGETHER = 16  # Number of rows that a loop processes at a time
RENUMBER_EVERY = 32
"""Number of frames after which the particles are renumbered by cells. With 16, a frame of 50,000 particles takes the
same time. With 256, it takes a tenth longer."""
MAX_SHARED = 30_000
"""Largest number of rows for which each row gets a warp of GPU threads. With more rows, each row has one thread. On an
H200 a frame of 24,750 rows takes 8.9 ms with warps and 9.7 ms with threads. A frame of 49,500 rows takes 15.2 ms and
13.0 ms."""


class Domain(NamedTuple):
    """Box of the neighbour search, in cm."""

    low: Floats
    high: Floats


def substeps_for(settings: Solver, fluid: Rheology, frame_s: float) -> int:
    """Return the number of substeps of a frame: the user's number or, by default, the number for the preset.

    By default, a substep is so short that particles fall only a small fraction of h in it.
    """
    if settings.substeps is not None:
        return settings.substeps
    few, many = (
        max(1, math.ceil(frame_s / math.sqrt(fall * 4 * settings.size_mm / 10 / GRAVITY_CM_S2)))
        for fall in (RESOLUTIONS[settings.preset].fall, RESOLUTIONS[settings.preset].fall_alone)
    )
    return few if iterations_for(settings, fluid, frame_s, few).carried else many


def iterations_for(settings: Solver, fluid: Rheology, frame_s: float, substeps: int) -> Iterations:
    """Return the pressure iterations of a substep: the user's number or, by default, the smallest suitable number."""
    alone = settings.scheme.iterations
    if settings.preset == "paper" or not fluid.moves_after_viscosity:
        return Iterations(0.0, alone)
    iterations = iterations_of(fluid.damping(4 * settings.size_mm / 10, frame_s, substeps), alone)
    return iterations if settings.iterations is None else iterations._replace(number=alone)


class FluidSolver:
    """Solver of one run, or of several runs that are computed together, with the same geometry and release schedule.

    The solver reads and writes no files and prints nothing.
    """

    def __init__(
        self,
        state: State,
        walls: WallParticles,
        barrier: Barrier,
        domain: Domain,
        settings: Solver,
        fluids: Sequence[Rheology],
        *,
        frame_s: float,
        substeps: int,
        rows: int,
        down: Sequence[float] = LEVEL.down,
        threads: int = 1,
        native: bool | None = None,
    ) -> None:
        """Bind all kernels. ``rows`` is the largest number of particles that move at the same time.

        ``down`` is the direction of gravity in the sample's coordinates. ``native`` is True to use the inner loops and
        packed lists for CPUs. If None, this depends on the device.
        """
        radius, device = settings.size_mm / 10, state.device
        self.state, self.walls, self.barrier, self.settings = state, walls, barrier, settings
        self.scheme, self.substeps, self.step_s = settings.scheme, substeps, frame_s / substeps
        self._frame_s = frame_s
        self._support = support = 4 * radius
        self.mass = self.scheme.volume_factor * particle_volume(radius)
        # On a GPU, the threads of a warp compute the sums of a particle together, unless there are very many particles.
        lanes = int(WARP) if device != "cpu" and rows <= MAX_SHARED else 1
        rows_of_movers = Extent(state.particles.mover_count, ROWS_TOGETHER)
        self.launcher = launcher = Launcher(device, rows_of_movers, threads, lanes)
        native = device == "cpu" if native is None else native
        kernels = pair_kernels(native)
        self.movers = MoversList(state, launcher)
        self.lists = neighbour_lists(rows, walls.position_and_share, device, packed=native, lanes=launcher.lanes)
        self._lacking = reader(self.lists.lacking)
        self.can_sleep = any(fluid.yields for fluid in fluids) and settings.sleep
        self.needs_shear_rate = any(
            fluid.yields or fluid.flow_index != 1 or fluid.by_age is not None for fluid in fluids
        )
        """True if the viscosity of particles depends on their shear rate or age. The viscosity is then computed in each
        substep."""
        self.iterations = [iterations_for(settings, fluid, frame_s, substeps) for fluid in fluids]
        """Pressure iterations of each run."""
        self.paste = paste_on_device(fluids, support, self.step_s, substeps, SLOWEST_SHEAR, device)
        wall_mass = {"calibrated": calibrated_wall_mass, "source": source_wall_mass}[self.scheme.wall]
        self.pressure = Pressure(
            state,
            self.lists,
            barrier,
            kernels,
            launcher,
            smoothing=smoothing_of(support, self.mass, wall_mass(radius), settings.relaxation),
            moves_after_viscosity=[fluid.moves_after_viscosity for fluid in fluids],
            scheme=self.scheme,
            iterations=self.iterations,
        )
        self.viscosity = Viscosity(
            state,
            self.lists,
            self.paste,
            kernels,
            launcher,
            support=support,
            mass=self.mass,
            explicit=settings.viscosity_solve == "explicit",
        )
        self.faults = FaultChecks(state, launcher, barrier, self.viscosity.search.unsolved, support)
        self._bind_lists(kernels.list_neighbours, domain)
        self._bind_moves(down)
        self._bind_frame()
        self._released = state.count
        # With explicit passes, the host must act in each substep.
        self.uses_recordings = device != "cpu" and settings.viscosity_solve == "implicit"
        """True if frames are recorded and replayed. The host then gets no data during a frame."""
        self._recorded: Any = None  # The recording of a frame
        self.kernels_a_frame = 0  # Launches by the host in the last frame that was not replayed
        self.rows = 0  # Rows of a launch: number of moving particles, or the largest number if frames are replayed

    def _bind_lists(self, kernel: Any, domain: Domain) -> None:
        state, walls, launcher = self.state, self.lists.wall_particle, self.launcher
        # Particles that come closer than h during the pressure iterations are listed only in the next substep. The
        # error is small, since kernels vanish at h.
        low, high, size = domain.low, domain.high, self._support
        points = state.position, state.status
        self.fluid_cells = CellGrid(
            low, high, size, *points, launcher, state.runs, index=state.index, present=state.present
        )
        wall_cells = CellGrid(low, high, size, walls, wp.zeros(len(walls), int, state.device), launcher)
        wall_cells.fill(len(walls))
        self._list = launcher.bind(
            kernel,
            state.particles,
            self.fluid_cells.cells,
            wall_cells.cells,
            self.lists,
            shared=True,
            extent=Extent(state.particles.mover_count, int(neighbours.BLOCK)),
        )

    def _bind_moves(self, down: Sequence[float]) -> None:
        particles = self.state.particles
        self.predict: Callable[[int], None] = self.launcher.bind(
            pressure.predict,
            particles,
            self.step_s,
            self.settings.damping_per_s,
            wp.vec3(*(GRAVITY_CM_S2 * part for part in down)),
            self.pressure.iteration_state,
            self.barrier.grid,
        )
        """Launch that moves particles by velocity and gravity, as far as walls allow (Eq. 4)."""
        self.update_velocity: Callable[[int], None] = self.launcher.bind(
            pressure.update_velocity,
            particles,
            self.step_s,
        )
        self.move_after_viscosity = self.launcher.bind(
            pressure.move_after_viscosity,
            particles,
            self.pressure.iteration_state,
            self.step_s,
            self.barrier.grid,
        )
        """Launch that moves particles by the velocity after viscosity, in runs with ``moves_after_viscosity``."""

    def _bind_frame(self) -> None:
        """Bind the kernels that are launched once in a frame."""
        particles, paste, launcher = self.state.particles, self.paste, self.launcher
        self._count_frame = launcher.bind(movers.count_frame, particles, extent=fixed(1, self.state.device))
        present = Extent(self.state.present, ROWS_TOGETHER)
        self._grow_older = launcher.bind(movers.grow_older, particles, paste, extent=present)
        self._wake = launcher.bind(
            movers.wake,
            particles,
            paste,
            WAKING_CM_S,
            RESTLESS_S,
            PATIENCE_S - AGAIN_S,
            self.lists,
            self.viscosity.system,
        )
        self._fall_asleep = launcher.bind(
            movers.fall_asleep,
            particles,
            paste,
            self.viscosity.system,
            self._frame_s,
            PATIENCE_S,
            QUIET_SHEAR,
            QUIET_SHEAR * self._support,
        )

    def step(self, *, measures_shear: bool = True) -> None:
        """Advance the moving particles by one substep, in the order of the paper's Algorithm 1.

        If ``measures_shear`` is False, the shear rates of an earlier substep are used.
        """
        self.find_neighbours(self.predict)  # Eq. 4
        parts = [self.pressure.solve, self.update_velocity]  # Eqs 1 to 3
        if self.needs_shear_rate and measures_shear:
            parts.insert(0, self.viscosity.measure_shear)
        if self.viscosity.explicit:  # Eq. 5
            self._launch(*parts)
            self.viscosity.pass_explicit(self.rows)
            self._launch(self.move_after_viscosity)
        else:
            self._launch(*parts, self.viscosity.solve_implicit, self.move_after_viscosity)

    def find_neighbours(self, *before: Callable[[int], object]) -> None:
        """List the neighbours of moving particles among the walls and all released particles, including those at rest.

        The launches ``before`` come first.
        """
        sort = [] if self.movers.sorted else [self._sort_movers]
        self._launch(*before, self._fill_cells, *sort, self._list)
        self.movers.sorted = True
        # On a GPU, the lists are always large enough, and recordings cannot wait for the host.
        while self.lists.room and self._lacking()[0]:
            self.make_room(self.lists.room * MORE_ROOM)
            self._launch(self._list)

    def _age(self, _rows: int) -> None:
        self._count_frame(1)
        self._grow_older(self._released)

    def _find_movers(self, _rows: int) -> None:
        self.movers.find(self._released)

    def _fill_cells(self, _rows: int) -> None:
        self.fluid_cells.fill(self._released)

    def _sort_movers(self, _rows: int) -> None:
        self.movers.sort(self.fluid_cells.cells.number, self._released)

    def _launch(self, *parts: Callable[[int], object]) -> None:
        """Launch parts of a frame over the moving particles, in order.

        If frames are recorded, parts are launched one by one.
        """
        if self.uses_recordings:
            for part in parts:
                part(self.rows)
        else:
            self.launcher.walk(parts, self.rows)

    def make_room(self, room: float) -> None:
        """Enlarge each block of packed lists to 16 times ``room`` entries. The lists are then empty."""
        if self.lists.room:
            self.launcher.forget_walks()
            make_room(self.lists, int(room))
            self.viscosity.make_room(self.lists)

    @property
    def _released(self) -> int:
        """Number of particles, counted from the first particle, that may have been released."""
        return self._present

    @_released.setter
    def _released(self, present: int) -> None:
        self._present = present
        if self.state.device == "cpu":
            self.state.present.fill_(present)

    @property
    def recorded(self) -> bool:
        """True if a frame has been recorded. Later frames are then replayed."""
        return self._recorded is not None

    def advance(self, frame: int) -> list[Integers]:
        """Compute a frame: release, freezing, all substeps, fault checks.

        Returns the number of viscosity iterations of each run, (runs,), for each substep.

        On a GPU, a frame is recorded once and then replayed, without data for the host. The list is then empty.
        """
        if self.state.device == "cpu" and frame % RENUMBER_EVERY == 0:
            self._renumber()
        if self.uses_recordings and not self.recorded and self.kernels_a_frame:
            # A recording contains the addresses of the lists, so the lists cannot be enlarged afterwards.
            self.make_room(MAX_ROOM)
            self._recorded = record(self.state.device, lambda: self._run_frame(frame))
        if not self.recorded:
            return self._run_frame(frame)
        wp.capture_launch(self._recorded)
        return []

    def _run_frame(self, frame: int) -> list[Integers]:
        before = self.launcher.kernels
        self.begin_frame(frame)
        solves: list[Integers] = []
        if self.rows:
            by_frame = RESOLUTIONS[self.settings.preset].shear_by_frame
            for number in range(self.substeps):
                self.step(measures_shear=not (by_frame and number))
                if not self.uses_recordings:
                    solves.append(self.viscosity.iterations())
            self._launch(self.faults.look)
            self.rest()
        self.kernels_a_frame = self.launcher.kernels - before
        return solves

    def _renumber(self) -> None:
        """Renumber the released particles by cells, so that neighbours are close in memory.

        Threads then rarely write to the same cache line. Call this before the frame's moving particles are listed.
        """
        self.fluid_cells.fill(self._released)
        order = self.fluid_cells.cells.number.numpy()[: self._released]
        # Particles are sorted run by run. Particles without a cell come last in their old order, so that particles that
        # are not released do not move.
        self.state.renumber(order[np.argsort(order // self.state.particles_per_run, kind="stable")])

    def begin_frame(self, frame: int) -> None:
        """Release the particles of a frame, and freeze particles that reach the freezing age."""
        state = self.state
        # For one run on a CPU, only the released particles are processed. Otherwise, all particles are processed.
        if state.runs == 1 and not self.uses_recordings:
            self._released = state.released(frame)
        self._launch(self._age)
        self.find_movers()

    def rest(self) -> None:
        """Wake particles beside a flow, and put quiet particles to sleep. This is called once in a frame."""
        if self.can_sleep:
            self._launch(self._wake, self._fall_asleep)
            self.find_movers()

    def find_movers(self) -> None:
        self._launch(self._find_movers)
        self.movers.sorted = False
        self.rows = len(self.lists.fluid_count) if self.uses_recordings else self.count_movers()

    def count_movers(self) -> int:
        """Return the current number of moving particles. The host waits for this number.

        Raises RuntimeError if there are more moving particles than rows.
        """
        moving, room = self.movers.number(), len(self.lists.fluid_count)
        if moving > room:
            raise RuntimeError(f"{moving} particles move, but there is room for only {room}.")
        return moving

    def lasting(self) -> dict[str, Any]:
        """Return the arrays that a substep needs from earlier substeps, by their names in a checkpoint."""
        return {**self.state.lasting(), "swelling": self.state.swelling}

    def resume(self, done: int) -> None:
        """Continue after ``done`` frames. Restore the lasting arrays before the call."""
        self.state.frame.fill_(done - 1)
        self.state.find_places()
        # Particles at rest must have no residual, and residuals from before may belong to other particles.
        self.state.scaled_residual.zero_()
        # The number of released particles is set when a frame begins.
        self._released = self.state.count
        self.find_movers()

    def give_up(self, run: int) -> None:
        """Remove a run permanently, including its particles that are not released yet."""
        state = self.state
        state.status[state.own(run)].fill_(int(status.GIVEN_UP))
        self.faults.forget(run)
        self.find_movers()
