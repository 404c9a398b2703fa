"""One substep in the order of the paper's Algorithm 1: predict, find neighbours, project, update velocity."""

import math
from typing import Any, NamedTuple

import warp as wp

from sealtwin.records import Floats
from simulate import kernels
from simulate.cells import CellGrid
from simulate.distance import Barrier
from simulate.settings import Solver, particle_volume
from simulate.state import State
from simulate.viscosity import Viscosity
from simulate.walls import Walls, calibrated_wall_mass, source_wall_mass

LIST_REACH = 1.04
"""Of a list over h: what can come within h while the pressure iterations move particles."""
LONGEST_CORRECTION = 0.25
"""Of one pressure iteration over h."""
FALL = 0.03
"""Of a particle at rest in one substep, g dt^2 over h: more compresses the column (4 substeps in the paper's trial)."""
FASTEST_CM_S = 2000.0
"""A fall from 20 m: whatever is faster gained its energy from the numbers."""
DENSEST = 2.5
"""Over rest density. Sound runs, overfull and thick ones included, stayed under 1.5; 128 neighbours come soon after."""


class Domain(NamedTuple):
    """Box of the neighbour search, cm."""

    low: Floats
    high: Floats


def substeps_for(settings: Solver, frame_s: float) -> int:
    """The user's number, or as many as keep the fall in one of them short."""
    support = 4 * settings.radius_mm / 10
    return settings.substeps or max(1, math.ceil(frame_s / math.sqrt(FALL * support / 981.0)))


class FluidSolver:
    """A state, its walls and settings: everything that a substep needs. Touches no files, prints nothing."""

    def __init__(
        self,
        state: State,
        walls: Walls,
        barrier: Barrier,
        domain: Domain,
        settings: Solver,
        *,
        step_s: float,
        weights: tuple[float, float],
    ) -> None:
        radius = settings.radius_mm / 10
        self.state = state
        self.walls, self.barrier, self.settings = walls, barrier, settings
        self.scheme = settings.scheme
        self._step_s = step_s
        self._support = 4 * radius
        self.smoothing = kernels.Smoothing()
        self.smoothing.support = self._support
        self.smoothing.poly6 = 315 / (64 * math.pi * self._support**9)
        self.smoothing.spiky = -45 / (math.pi * self._support**6)
        self.mass = self.scheme.volume_factor * particle_volume(radius)
        wall_mass = {"calibrated": calibrated_wall_mass, "source": source_wall_mass}
        self.wall_mass = wall_mass[self.scheme.wall](radius)
        self.viscosity = Viscosity(state, walls, self._support, self.mass, weights)
        reach = LIST_REACH * self._support
        self.fluid_cells = CellGrid(domain.low, domain.high, reach, len(state.position), state.device)
        self.wall_cells = CellGrid(domain.low, domain.high, reach, len(walls.point), state.device)
        all_in_play = wp.zeros(len(walls.point), dtype=int, device=state.device)
        self.wall_cells.fill(walls.point, all_in_play, len(walls.point))
        # No particle has the number of them all: none is at fault yet.
        self._fault = wp.full(int(kernels.FAULTS), len(state.position), dtype=int, device=state.device)

    def step(self) -> int:
        """Advance the moving particles by one substep; how many iterations or passes the viscosity took."""
        self.predict()
        self.find_neighbours()
        for _ in range(self.scheme.iterations):
            self.measure_density()
            self.correct()
        self.update_velocity()
        if self.settings.viscosity_solve == "implicit":
            return self.viscosity.solve_implicit()
        return self.viscosity.pass_explicit()

    def predict(self) -> None:
        state = self.state
        self._launch(
            kernels.predict,
            state.first,
            self._step_s,
            self.settings.damping_per_s,
            self.barrier.clearance,
            self.barrier.grid,
            state.fate,
            state.velocity,
            state.position,
            state.start,
        )

    def find_neighbours(self) -> None:
        """Among all that are out, frozen ones included, and among the walls."""
        state = self.state
        self.fluid_cells.fill(state.position, state.fate, state.end)
        self._list(self.fluid_cells, 0, kernels.NEIGHBOURS_FULL, state.neighbour, state.neighbour_count)
        self._list(self.wall_cells, 1, kernels.WALLS_FULL, state.wall_neighbour, state.wall_count)

    def measure_density(self) -> None:
        state, walls = self.state, self.walls
        self._launch(
            kernels.measure_density,
            state.first,
            self.smoothing,
            self.mass,
            self.wall_mass,
            self.settings.relaxation / self._support**2,
            state.position,
            state.neighbour,
            state.neighbour_count,
            walls.point,
            walls.share,
            state.wall_neighbour,
            state.wall_count,
            state.gradient,
            state.wall_gradient,
            state.density,
            state.multiplier,
        )

    def correct(self) -> None:
        state = self.state
        self._launch(
            kernels.correct,
            state.first,
            LONGEST_CORRECTION * self._support,
            self.scheme.frozen_answer,
            self.barrier.clearance,
            self.barrier.grid,
            state.multiplier,
            state.neighbour,
            state.neighbour_count,
            state.gradient,
            state.wall_gradient,
            state.position,
        )

    def update_velocity(self) -> None:
        state = self.state
        self._launch(kernels.update_velocity, state.first, self._step_s, state.start, state.position, state.velocity)

    def inspect(self) -> list[int]:
        """Mark what spilled; for each fault of kernels.py, the first particle that has it, or their number if none."""
        state = self.state
        self._launch(
            kernels.inspect,
            state.first,
            FASTEST_CM_S,
            DENSEST,
            self._support,
            self.barrier.grid,
            state.position,
            state.velocity,
            state.density,
            state.fate,
            self._fault,
        )
        return self._fault.numpy().tolist()

    def _list(self, grid: CellGrid, self_is_listed: int, full: int, neighbour: wp.array, count: wp.array) -> None:
        state = self.state
        self._launch(
            kernels.list_neighbours,
            state.first,
            grid.cells,
            LIST_REACH * self._support,
            self_is_listed,
            full,
            state.position,
            state.fate,
            neighbour,
            count,
            self._fault,
        )

    def _launch(self, kernel: Any, *inputs: object) -> None:
        wp.launch(kernel, self.state.moving, inputs=list(inputs), device=self.state.device)
