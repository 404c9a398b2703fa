"""One substep in the order of the paper's Algorithm 1: predict, find neighbours, project, update velocity."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from sealtwin.errors import InputError
from sealtwin.records import Floats, Integers
from simulate import kernels, kernels_rest
from simulate.cells import CellGrid
from simulate.coarse_pressure import CoarsePressure
from simulate.distance import Barrier
from simulate.faults import FaultWatch
from simulate.launch import Launcher
from simulate.movers import MoversList
from simulate.neighbours import NeighbourLists
from simulate.pairs import pair_kernels
from simulate.paste import Rheology, paste_on_device
from simulate.pressure import Pressure, smoothing_of
from simulate.settings import Solver, particle_volume
from simulate.state import State
from simulate.viscosity import Viscosity
from simulate.walls import Walls, calibrated_wall_mass, source_wall_mass

LIST_REACH = 1.04
"""Of a list over h: what can come within h while the pressure iterations move particles."""
FALL = 0.03
"""Of a particle at rest in one substep, g dt^2 over h: more compresses the column (4 substeps in the paper's trial)."""
CREEP = 5.0
"""Times the slowest shear: below it the stress is under 5/6 of the yield stress, and paste may fall asleep."""
PATIENCE_S = 0.3
"""Of quiet before sleep (prototype)."""
WAKING_CM_S = 0.5
"""Of a neighbour (prototype)."""


class Domain(NamedTuple):
    """Box of the neighbour search, cm."""

    low: Floats
    high: Floats


def substeps_for(settings: Solver, frame_s: float) -> int:
    """The user's number, or as many as keep the fall in one of them short.

    Raises InputError where the number is smaller than that and the pressure has two levels.
    """
    support = 4 * settings.size_mm / 10
    short = max(1, math.ceil(frame_s / math.sqrt(FALL * support / 981.0)))
    if settings.substeps is not None and settings.substeps < short and settings.pressure == "two-level":
        raise InputError(
            f'solver.substeps is {settings.substeps}: with solver.pressure = "two-level" frames of '
            f"{frame_s * 1e3:.3g} ms need at least {short}, or the fluid boils. Give as many, or leave it out."
        )
    return settings.substeps or short


class FluidSolver:
    """One run, or several at once that share geometry and schedule: everything that a substep needs.

    Touches no files, prints nothing.
    """

    def __init__(
        self,
        state: State,
        walls: Walls,
        barrier: Barrier,
        domain: Domain,
        settings: Solver,
        fluids: Sequence[Rheology],
        *,
        frame_s: float,
        substeps: int,
        rows: int,
        centreline: Floats,
        threads: int = 1,
        native: bool | None = None,
    ) -> None:
        """``rows`` may move at one time. ``centreline`` is the crack's, (n, 2), cm.

        ``native``: loops for CPUs; None is what suits the device.
        """
        radius = settings.size_mm / 10
        device = state.device
        self.state, self.walls, self.barrier, self.settings = state, walls, barrier, settings
        self.scheme, self.substeps = settings.scheme, substeps
        self.step_s = frame_s / substeps
        self._support = 4 * radius
        self.mass = self.scheme.volume_factor * particle_volume(radius)
        wall_mass = {"calibrated": calibrated_wall_mass, "source": source_wall_mass}[self.scheme.wall]
        self._launch = Launcher(device, threads if device == "cpu" else 1)
        self.movers, self.lists = MoversList(state, self._launch), NeighbourLists(rows, device)
        self._kernels = pair_kernels(device == "cpu" if native is None else native)
        self._yields = any(fluid.yields for fluid in fluids)
        self._sleeps = self._yields and settings.sleep
        slowest = settings.slowest_shear_per_s
        self._slowest_shear = slowest
        self.paste = paste_on_device(fluids, self._support, self.step_s, substeps, slowest, device)
        self.viscosity = Viscosity(
            state,
            self.movers,
            self.lists,
            walls,
            self.paste,
            self._kernels,
            self._launch,
            support=self._support,
            mass=self.mass,
            frame_s=frame_s,
        )
        reach = LIST_REACH * self._support
        self.fluid_cells = CellGrid(domain.low, domain.high, reach, state.points_a_run, device, state.runs)
        self.wall_cells = CellGrid(domain.low, domain.high, reach, len(walls.place), device)
        all_there = wp.zeros(len(walls.place), dtype=int, device=device)
        self.wall_cells.fill(walls.place, all_there, len(walls.place))
        coarse: CoarsePressure | None = None
        if settings.pressure == "two-level":
            coarse = CoarsePressure(
                state,
                self.movers,
                self._launch,
                centreline,
                domain.low,
                domain.high,
                # Wall particles lie a radius deep.
                floor=float(walls.place.numpy()[:, 2].min()) + radius,
                rows=rows,
                support=self._support,
            )
        self.pressure = Pressure(
            state,
            self.movers,
            self.lists,
            walls,
            barrier,
            self._kernels.pressure,
            self._launch,
            smoothing=smoothing_of(self._support, self.mass, wall_mass(radius), settings.relaxation),
            scheme=self.scheme,
            coarse=coarse,
        )
        self.watch = FaultWatch(state, self.movers, self._launch, barrier, self.viscosity.unsolved, self._support)
        self._quiet_s = wp.zeros(state.count, dtype=float, device=device)
        self._frames_to_freeze = wp.array([fluid.frames_to_freeze for fluid in fluids], dtype=int, device=device)
        self._out = state.count
        # Explicit passes are counted by the host, in each substep.
        self.replays = device != "cpu" and settings.viscosity_solve == "implicit"
        """Whether frames are recorded, and the host is told nothing within them."""
        self._recorded: Any = None
        self.kernels_a_frame = 0
        """Launched in the last frame that was not replayed."""
        self.rows = 0
        """Of a launch: as many as move now, or where frames are replayed, as ever may."""

    @property
    def recorded(self) -> bool:
        """Whether frames are replayed by now."""
        return self._recorded is not None

    def advance(self, frame: int) -> list[Integers]:
        """One frame: release, freeze, all substeps, a look for faults; what each substep's viscosity took.

        On a GPU a frame is recorded once and replayed, without a word to the host in between; it returns nothing.
        """
        if self.replays and self._recorded is None and self.kernels_a_frame:
            # The frame before has loaded every kernel, which a recording must not do; and least of all those of CPUs.
            with wp.ScopedCapture(device=self.state.device, force_module_load=False) as capture:
                self._run_frame(frame)
            self._recorded = capture.graph
        if self._recorded is not None:
            wp.capture_launch(self._recorded)
            return []
        return self._run_frame(frame)

    def _run_frame(self, frame: int) -> list[Integers]:
        before = self._launch.kernels
        self.begin_frame(frame)
        solves = [self.step() for _ in range(self.substeps)] if self.rows else []
        if self.rows:
            self.watch.look(self.rows)
        self.kernels_a_frame = self._launch.kernels - before
        return [] if self.replays else solves

    def begin_frame(self, frame: int) -> None:
        """Release what comes out in it, and freeze what has grown too old."""
        state = self.state
        # One run's particles lie in the order of release; those of several, or what a GPU does, are all sorted.
        if state.runs == 1 and not self.replays:
            self._out = state.released(frame)
        self._launch.all("count frame", kernels_rest.count_frame, 1, state.frame)
        self._launch.all("release", kernels_rest.release, state.count, state.frame, state.frame_of, state.fate)
        self._launch.all(
            "freeze",
            kernels_rest.freeze,
            state.count,
            state.frame,
            state.points_a_run,
            self._frames_to_freeze,
            state.frame_of,
            state.fate,
            state.place,
            state.velocity,
            state.direction,
        )
        self.find_movers()

    def step(self) -> Integers:
        """Advance the moving particles by one substep; how many iterations or passes the viscosity took, by run.

        Where frames are replayed nobody is told, and these are 0.
        """
        runs = self.state.runs
        self.predict()
        self.find_neighbours()
        if self._yields:
            self.viscosity.measure_shear(self.rows)
        self.pressure.solve(self.rows)
        self.update_velocity()
        if self.settings.viscosity_solve == "implicit":
            self.viscosity.solve_implicit(self.rows)
            iterations = np.zeros(runs, dtype=np.int64) if self.replays else self.viscosity.searches()
        else:
            iterations = np.full(runs, self.viscosity.pass_explicit(self.rows))
        if self._yields:
            self.go_as_solved()
        if self._sleeps:
            self.rest()
        return iterations

    def lasting(self) -> dict[str, Any]:
        """Arrays that a substep takes over from the one before, by name; all others are made anew in each."""
        return {**self.state.lasting(), "quiet_s": self._quiet_s}

    def go_on_from(self, done: int) -> None:
        """After arrays were put back to where they stood when ``done`` frames were."""
        self.state.frame.fill_(done - 1)
        self.find_movers()

    def find_movers(self) -> None:
        self.movers.find()
        self.rows = len(self.lists.fluid_count) if self.replays else self.count_movers()

    def count_movers(self) -> int:
        """How many move now, for which the host waits. Raises RuntimeError where there is no room for as many."""
        moving, room = self.movers.number(), len(self.lists.fluid_count)
        if moving > room:
            raise RuntimeError(f"{moving} particles move where there is room for {room}.")
        return moving

    def predict(self) -> None:
        state = self.state
        self._rows(
            kernels.predict,
            self.step_s,
            self.settings.damping_per_s,
            self.barrier.clearance,
            self.barrier.grid,
            state.velocity,
            state.place,
            state.start,
        )

    def find_neighbours(self) -> None:
        """Among all that are out, resting ones included, and among the walls."""
        state, lists = self.state, self.lists
        self.fluid_cells.fill(state.place, state.fate, self._out)
        with self._launch.slice_by_slice():
            self._list("fluid", self.fluid_cells, kernels.NEIGHBOURS_FULL, state.nobody, lists.fluid, lists.fluid_count)
            self._list("wall", self.wall_cells, kernels.WALLS_FULL, len(self.walls.place), lists.wall, lists.wall_count)

    def update_velocity(self) -> None:
        state = self.state
        self._rows(kernels.update_velocity, self.step_s, state.start, state.place, state.velocity)

    def go_as_solved(self) -> None:
        state = self.state
        self._rows(
            kernels.go_as_solved,
            state.points_a_run,
            self.paste.yields_at_most,
            self.step_s,
            self.barrier.clearance,
            self.barrier.grid,
            state.start,
            state.velocity,
            state.place,
        )

    def rest(self) -> None:
        """Wake and put to sleep; the list of movers follows."""
        state, lists = self.state, self.lists
        yields = (state.points_a_run, self.paste.yields_at_most)
        self._rows(
            kernels_rest.wake,
            *yields,
            WAKING_CM_S,
            state.velocity,
            lists.fluid,
            lists.fluid_count,
            state.fate,
            self._quiet_s,
        )
        self._rows(
            kernels_rest.fall_asleep,
            *yields,
            self.step_s,
            PATIENCE_S,
            CREEP * self._slowest_shear,
            CREEP * self._slowest_shear * self._support,
            self.viscosity.shear,
            self._quiet_s,
            state.fate,
            state.place,
            state.velocity,
            state.direction,
        )
        self.find_movers()

    def give_up(self, run: int) -> None:
        """Take a run out for good, those of its particles that are still to come included."""
        state = self.state
        state.fate[state.own(run)].fill_(int(kernels_rest.GIVEN_UP))
        self.watch.forget(run)
        self.find_movers()

    def _list(self, of: str, grid: CellGrid, full: int, nobody: int, listed: wp.array, count: wp.array) -> None:
        self._launch.rows(
            f"list {of}",
            self._kernels.list_neighbours,
            self.rows,
            self.movers.movers,
            grid.cells,
            int(of == "fluid"),
            LIST_REACH * self._support,
            full,
            nobody,
            self.state.place,
            listed,
            count,
            self.watch.by_particle,
        )

    def _rows(self, kernel: Any, *inputs: object) -> None:
        self._launch.rows(kernel.key, kernel, self.rows, self.movers.movers, *inputs)
