"""One substep in the order of the paper's Algorithm 1: predict, find neighbours, project, update velocity."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers
from simulate.fluid.cell_grid import MOST_ROOM, CellGrid, make_room, neighbour_lists
from simulate.fluid.coarse_pressure import CoarsePressure
from simulate.fluid.fault_checks import FaultChecks
from simulate.fluid.launcher import Launcher
from simulate.fluid.pressure import Iterations, Pressure, iterations_of, smoothing_of
from simulate.fluid.state import MoversList, State
from simulate.fluid.viscosity import Viscosity
from simulate.kernels import movers, neighbours, pressure, sleep, status
from simulate.kernels.lanes import WARP
from simulate.kernels.pair_kernels import pair_kernels
from simulate.settings import LEVEL, Solver, particle_volume
from simulate.setup.rheology import FALL, Rheology, paste_on_device
from simulate.setup.signed_distance import Barrier
from simulate.setup.wall_particles import WallParticles, calibrated_wall_mass, source_wall_mass

SHORT_FALL = 0.03
"""``FALL`` where pressure begins at zero: a fluid freezing by age is compressed by a tenth in longer substeps, and by
two-level pressure it boils.
"""
MORE_ROOM = 9 / 8  # Room of packed lists over that which did not suffice
GRAVITY_CM_S2 = 981.0
SLOWEST_SHEAR = 0.002
"""Shear in 1/s below which paste with a yield stress creeps at constant viscosity: the least that float32 allows."""
QUIET_SHEAR = 0.015
"""Shear in 1/s below which paste may fall asleep, and times h the speed: it then moves by 0.06 R in a second. At 0.1 /s
paste that flows back along a slope falls asleep on its way, and stands up to 1.4 mm off (``benchmarks/sleep.py``).
"""
PATIENCE_S = 0.5
"""Time of quiet before sleep. After 0.45 s, paste of 20 Pa whose pressure carries over falls asleep as it sags, and a
bed of it stands 0.14 mm off, for 0.06 (``benchmarks/sleep.py``).
"""
AGAIN_S = 0.15  # The same for a particle that was woken: quiet paste beside a flow shall not stay awake with it
WAKING_CM_S = 0.5  # Speed of a neighbour that wakes a particle (prototype)
RESTLESS_S = 0.1  # Time for which a slower neighbour flows before it wakes a particle
RENUMBERED = 50_000
"""Particles of a run from which they are renumbered by cells: the arrays of fewer stay in a processor's cache."""
RENUMBER_EVERY = 32  # Frames; with 16 a frame takes as long, with 256 a tenth longer
ROWS_ALIKE = 128  # Rows are recorded in such steps, for some that stay empty cost less than another recording
MOST_SHARED = 30_000
"""Rows up to which a GPU's warps share them: on an H200 a frame of 24,750 rows takes 8.9 ms by warps and 9.7 ms by
threads, one of 49,500 rows 15.2 ms and 13.0 ms.
"""
MOST_RECORDED = 8000  # Rows from which launches by the host cost a substep less than a fiftieth


class Domain(NamedTuple):
    """Box of the neighbour search, cm."""

    low: Floats
    high: Floats


def substeps_for(settings: Solver, fluid: Rheology, frame_s: float) -> int:
    """The user's number of substeps, or as many as keep the fall in one of them short.

    Raises InputError where the number is smaller than that and the pressure has two levels.
    """
    few, many = (
        max(1, math.ceil(frame_s / math.sqrt(fall * 4 * settings.size_mm / 10 / GRAVITY_CM_S2)))
        for fall in (FALL, SHORT_FALL)
    )
    if settings.substeps is not None:
        if settings.substeps < many and settings.pressure == "two-level":
            raise InputError(
                f'solver.substeps is {settings.substeps}: with solver.pressure = "two-level" frames of '
                f"{frame_s * 1e3:.3g} ms need at least {many}, or the fluid boils. Give as many, or leave it out."
            )
        return settings.substeps
    return few if iterations_for(settings, fluid, frame_s, few).carried else many


def iterations_for(settings: Solver, fluid: Rheology, frame_s: float, substeps: int) -> Iterations:
    """The user's number of pressure iterations in a substep, or as few as the fluid allows."""
    alone = settings.scheme.iterations
    if not (settings.carries_pressure and fluid.moves_as_solved):
        return Iterations(0.0, alone)
    found = iterations_of(fluid.damping(4 * settings.size_mm / 10, frame_s, substeps), alone)
    return found if settings.iterations is None else found._replace(number=alone)


def lanes_for(rows: int, device: str) -> int:
    """Threads that share a particle's sums: on a GPU a warp, unless there are enough particles for a thread each."""
    return int(WARP) if device != "cpu" and rows <= MOST_SHARED else 1


class FluidSolver:
    """The solver of one run, or of several at once that share geometry and schedule.

    It touches no files and prints nothing.
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
        centreline: Floats,
        down: Sequence[float] = LEVEL.down,
        threads: int = 1,
        native: bool | None = None,
    ) -> None:
        """``rows`` is the largest number of particles that move at one time. ``centreline`` is the crack's, (n, 2), cm.

        ``down`` is gravity's direction in the sample's frame. ``native`` chooses the inner loops and packed lists of
        CPUs; None asks the device.
        """
        radius, device = settings.size_mm / 10, state.device
        self.state, self.walls, self.barrier, self.settings = state, walls, barrier, settings
        self.gravity = wp.vec3(*(GRAVITY_CM_S2 * part for part in down))
        self.scheme, self.substeps, self.step_s = settings.scheme, substeps, frame_s / substeps
        self._frame_s = frame_s
        self._support = support = 4 * radius
        self.mass = self.scheme.volume_factor * particle_volume(radius)
        wall_mass = {"calibrated": calibrated_wall_mass, "source": source_wall_mass}[self.scheme.wall]
        self._launcher = launcher = Launcher(device, threads if device == "cpu" else 1, lanes_for(rows, device))
        wall_particles = walls.position_and_share
        native = device == "cpu" if native is None else native
        self.movers = MoversList(state, launcher)
        self.lists = neighbour_lists(rows, wall_particles, device, packed=native, lanes=launcher.lanes)
        shared = (state, self.lists)
        kernels = pair_kernels(native)
        self.sleeps = any(fluid.yields for fluid in fluids) and settings.sleep
        as_solved = [fluid.moves_as_solved for fluid in fluids]
        self._any_as_solved = any(as_solved)
        self.measures = any(fluid.thickens or fluid.by_age is not None for fluid in fluids)
        """Particles get a viscosity of their own in each substep, by their shear or by their age."""
        self.paste = paste_on_device(fluids, support, self.step_s, substeps, SLOWEST_SHEAR, device)
        self.viscosity = Viscosity(
            *shared,
            self.paste,
            kernels.viscosity,
            launcher,
            support=support,
            mass=self.mass,
            frame_s=frame_s,
        )
        coarse: CoarsePressure | None = None
        if settings.pressure == "two-level":
            coarse = CoarsePressure(
                state,
                launcher,
                centreline,
                domain.low,
                domain.high,
                # Wall particles lie a radius deep.
                floor=float(wall_particles.numpy()[:, 2].min()) + radius,
                rows=rows,
                support=support,
                iterations=self.scheme.iterations,
            )
        self.iterations = [iterations_for(settings, fluid, frame_s, substeps) for fluid in fluids]
        """Iterations of each run's pressure."""
        smoothing = smoothing_of(support, self.mass, wall_mass(radius), settings.relaxation)
        self.pressure = Pressure(
            *shared,
            barrier,
            kernels.pressure,
            launcher,
            smoothing=smoothing,
            as_solved=as_solved,
            scheme=self.scheme,
            iterations=self.iterations,
            coarse=coarse,
        )
        self.faults = FaultChecks(state, launcher, barrier, self.viscosity.unsolved, support)
        self._bind_lists(kernels.list_neighbours, domain)
        self._bind_frame()
        self._out = state.count
        # Explicit passes are counted by the host, in each substep.
        self.replays = device != "cpu" and settings.viscosity_solve == "implicit"
        """Frames are recorded and replayed, without reports to the host in between."""
        self._renumbers = device == "cpu" and state.particles_per_run >= RENUMBERED
        self._recorded: Any = None
        self._one_thread = device == "cpu" and threads == 1
        self._projections: dict[int, Any] = {}  # Recorded, by the number of rows
        self.kernels_a_frame = 0  # Launches by the host in the last frame that was not replayed
        self.rows = 0  # Rows of a launch: the present number of movers or, where frames are replayed, the largest ever

    def _bind_lists(self, kernel: Any, domain: Domain) -> None:
        state, lists, walls = self.state, self.lists, self.lists.wall_particle
        # What comes within h while the pressure iterations move it is listed in the next substep: kernels vanish at h.
        box = (domain.low, domain.high, self._support)
        self.fluid_cells = CellGrid(*box, state.position, state.status, self._launcher, state.runs)
        here = wp.zeros(len(walls), dtype=int, device=state.device)
        wall_cells = CellGrid(*box, walls, here, self._launcher)
        wall_cells.fill(len(walls))

        full = (pressure.NEIGHBOURS_FULL, pressure.WALLS_FULL)
        self._list = self._launcher.bind(
            kernel,
            state.particles,
            self.fluid_cells.cells,
            wall_cells.cells,
            *full,
            lists,
            shared=True,
        )

    def _bind_frame(self) -> None:
        """Bind all else that happens to particles in a frame."""
        state, lists, launcher, settings = self.state, self.lists, self._launcher, self.settings
        self._count_frame = launcher.bind_whole(movers.count_frame, 1, state.particles)
        self._grow_older = launcher.bind(movers.grow_older, state.particles, self.paste)
        moving, solid = state.particles, (self.barrier.clearance, self.barrier.grid)
        yielding = (moving, self.paste)
        falling = (self.step_s, settings.damping_per_s, self.gravity)
        self._predict = launcher.bind(pressure.predict, moving, *falling, self.pressure.effort, *solid)
        self._update_velocity = launcher.bind(pressure.update_velocity, moving, self.step_s)
        solved = (moving, self.pressure.effort, self.step_s, *solid)
        self._move_as_solved = launcher.bind(pressure.move_as_solved, *solved)
        limits = (self._frame_s, PATIENCE_S, QUIET_SHEAR, QUIET_SHEAR * self._support)
        waking = (WAKING_CM_S, RESTLESS_S, PATIENCE_S - AGAIN_S)
        system = self.viscosity.system
        self._wake = launcher.bind(sleep.wake, *yielding, *waking, lists, system)
        self._fall_asleep = launcher.bind(sleep.fall_asleep, *yielding, system, *limits)

    @property
    def recorded(self) -> bool:
        """A frame is recorded by now, and replayed."""
        return self._recorded is not None

    def advance(self, frame: int) -> list[Integers]:
        """One frame: release, freezing, all substeps, fault checks. Returns the viscosity's iterations by substep.

        On a GPU a frame is recorded once and replayed, without reports to the host in between; the list is then empty.
        """
        if self._renumbers and frame % RENUMBER_EVERY == 0:
            self._renumber()
        if self.replays and self._recorded is None and self.kernels_a_frame:
            # It keeps the addresses of the lists, and cannot give them more room on the way.
            self.make_room(MOST_ROOM)
            # A recording must load no module, least of all those for CPUs: all are loaded by now.
            with wp.ScopedCapture(device=self.state.device, force_module_load=False) as capture:
                self._run_frame(frame)
            self._recorded = capture.graph
        if self._recorded is not None:
            wp.capture_launch(self._recorded)
            return []
        return self._run_frame(frame)

    def _run_frame(self, frame: int) -> list[Integers]:
        before = self._launcher.kernels
        self.begin_frame(frame)
        solves: list[Integers] = []
        if self.rows:
            solves = [self.step(recorded=self.kernels_a_frame > 0) for _ in range(self.substeps)]
            self.faults.look(self.rows)
            self.rest()
        self.kernels_a_frame = self._launcher.kernels - before
        return [] if self.replays else solves

    def _renumber(self) -> None:
        """Give particles that are out the order of their cells: those that are near each other then share memory.

        A frame then begins with its list of movers.
        """
        self.fluid_cells.fill(self._out)
        order = self.fluid_cells.cells.number.numpy()[: self._out]
        # Run by run; what belongs to no cell follows in its old order, so that what waits keeps its place.
        self.state.renumber(order[np.argsort(order // self.state.particles_per_run, kind="stable")])

    def begin_frame(self, frame: int) -> None:
        """Release the particles of a frame, and freeze those that have grown too old."""
        state = self.state
        # One run's particles are looked at up to the last that is out; those of several runs, or on a GPU, all.
        if state.runs == 1 and not self.replays:
            self._out = state.released(frame)
        self._count_frame()
        self._grow_older(self._out)
        self.find_movers()

    def rest(self) -> None:
        """Once in a frame: wake what lies beside a flow, and let fall asleep what has been quiet."""
        if self.sleeps:
            self._wake(self.rows)
            self._fall_asleep(self.rows)
            self.find_movers()

    def step(self, *, recorded: bool = False) -> Integers:
        """Advance the movers by one substep; returns the viscosity's iterations or passes, by run.

        Where frames are replayed the host does not know these numbers, and they are 0. ``recorded`` says that a CPU may
        replay what follows the lists: kernels are loaded, and the solver's parts are its own.
        """
        self.predict()
        self.find_neighbours()
        if self.settings.viscosity_solve == "explicit":
            return self._project(self.rows)
        if recorded and self._one_thread and not self.replays and self.rows <= MOST_RECORDED:
            self._replay_projection()
        else:
            self._project(self.rows)
        return np.zeros(self.state.runs, dtype=np.int64) if self.replays else self.viscosity.iterations()

    def _project(self, rows: int) -> Integers:
        """All of a substep that follows the lists; returns the explicit passes, by run."""
        if self.measures:
            self.viscosity.measure_shear(rows)
        self.pressure.solve(rows)
        self._update_velocity(rows)
        passes = 0
        if self.settings.viscosity_solve == "implicit":
            self.viscosity.solve_implicit(rows)
        else:
            passes = self.viscosity.pass_explicit(rows)
        if self._any_as_solved:
            self._move_as_solved(rows)
        return np.full(self.state.runs, passes)

    def _replay_projection(self) -> None:
        """Sixty launches that a CPU's host need not make one by one; rows that do not move end at once."""
        rows = min(-(-self.rows // ROWS_ALIKE) * ROWS_ALIKE, len(self.lists.fluid_count))
        if rows not in self._projections:
            with wp.ScopedCapture(device=self.state.device, force_module_load=False) as capture:
                self._project(rows)
            self._projections[rows] = capture.graph
        wp.capture_launch(self._projections[rows])

    def lasting(self) -> dict[str, Any]:
        """Arrays that a substep takes over from the one before, by their names in a checkpoint."""
        return {**self.state.lasting(), "swelling": self.state.swelling}

    def resume(self, done: int) -> None:
        """Continue after ``done`` frames, once the lasting arrays were restored."""
        self.state.frame.fill_(done - 1)
        # Particles at rest have none, and those of a frame before may lie elsewhere.
        self.state.scaled_residual.zero_()
        # Those that are out are known again when a frame begins.
        self._out = self.state.count
        self.find_movers()

    def find_movers(self) -> None:
        self.movers.find(self._out)
        self.rows = len(self.lists.fluid_count) if self.replays else self.count_movers()

    def count_movers(self) -> int:
        """Present number of movers, for which the host waits. Raises RuntimeError where it exceeds the room."""
        moving, room = self.movers.number(), len(self.lists.fluid_count)
        if moving > room:
            raise RuntimeError(f"{moving} particles move where there is room for {room}.")
        return moving

    def predict(self) -> None:
        self._predict(self.rows)

    def find_neighbours(self) -> None:
        """List the neighbours among all particles that are out, resting ones included, and among the walls."""
        self.fluid_cells.fill(self._out)
        self.movers.sort(self.fluid_cells.cells.number, self._out)
        self._list(self.rows, block=int(neighbours.BLOCK))
        # A GPU's lists are never short of room, and a recording there must not wait for an answer.
        while self.lists.room and self.lists.lacking.numpy()[0]:
            self.make_room(self.lists.room * MORE_ROOM)
            self._list(self.rows, block=int(neighbours.BLOCK))

    def make_room(self, sixteens: float) -> None:
        """Give each block of packed lists room for so many sixteens of entries; what was listed is lost."""
        if self.lists.room:
            self._projections.clear()
            make_room(self.lists, int(sixteens))
            self.viscosity.make_room(self.lists)

    def update_velocity(self) -> None:
        self._update_velocity(self.rows)

    def give_up(self, run: int) -> None:
        """Take a run out for good, with its particles that are not released yet."""
        state = self.state
        state.status[state.own(run)].fill_(int(status.GIVEN_UP))
        self.faults.forget(run)
        self.find_movers()
