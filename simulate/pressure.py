"""The pressure of a substep: particles go where their density pushes them, in a few iterations (Eqs 1 to 3)."""

import math
from typing import Any

import warp as wp

from simulate import kernels
from simulate.coarse_pressure import CoarsePressure
from simulate.distance import Barrier
from simulate.launch import Launcher
from simulate.movers import MoversList
from simulate.neighbours import NeighbourLists
from simulate.settings import Scheme
from simulate.state import State
from simulate.walls import Walls

LONGEST_CORRECTION = 0.25
"""Of one iteration over h."""


class Pressure:
    """On one level or, with ``coarse``, on two; for all runs at once."""

    def __init__(
        self,
        state: State,
        movers: MoversList,
        lists: NeighbourLists,
        walls: Walls,
        barrier: Barrier,
        pairs: kernels.PressureKernels,
        launcher: Launcher,
        *,
        smoothing: Any,
        scheme: Scheme,
        coarse: CoarsePressure | None,
    ) -> None:
        self._state, self._movers, self._lists = state, movers, lists
        self._walls, self._barrier, self._pairs, self._launch = walls, barrier, pairs, launcher
        self.smoothing, self._scheme, self.coarse = smoothing, scheme, coarse
        rows = len(lists.fluid_count)
        self._wall_slope = wp.zeros(rows, dtype=wp.vec3, device=state.device)
        self._correction = wp.zeros(rows, dtype=wp.vec3, device=state.device)

    def solve(self, rows: int) -> None:
        """All iterations of a substep."""
        if self.coarse:
            self.coarse.begin(rows)
        for iteration in range(self._scheme.iterations):
            if self.coarse:
                self.measure_terms(rows, self.coarse)
                self.coarse.change(iteration, rows)
            else:
                self.measure_density(rows)
            self.correct(rows)

    def measure_density(self, rows: int) -> None:
        """Densities, volumes, and each mover's multiplier."""
        state = self._state
        self._rows(self._pairs.measure_density, rows, *self._around(), state.density, state.bulk)

    def measure_terms(self, rows: int, coarse: CoarsePressure) -> None:
        """The same without multipliers, which the coarse level changes."""
        state = self._state
        terms = (coarse.slope, coarse.yielding)
        self._rows(self._pairs.measure_terms, rows, *self._around(), state.density, state.bulk, *terms)

    def correct(self, rows: int) -> None:
        """Move by Eq. 3, as far as walls allow."""
        state, lists = self._state, self._lists
        self._rows(
            self._pairs.correct,
            rows,
            self.smoothing,
            LONGEST_CORRECTION * self.smoothing.support,
            self._scheme.frozen_answer,
            lists.fluid,
            lists.fluid_count,
            self._wall_slope,
            state.place,
            self._correction,
        )
        barrier = self._barrier
        self._rows(kernels.shift, rows, barrier.clearance, barrier.grid, self._correction, state.place)

    def _around(self) -> tuple[Any, ...]:
        lists, walls = self._lists, self._walls
        return (
            self.smoothing,
            lists.fluid,
            lists.fluid_count,
            walls.place,
            lists.wall,
            lists.wall_count,
            self._state.place,
            self._wall_slope,
        )

    def _rows(self, kernel: Any, rows: int, *inputs: object) -> None:
        self._launch.rows(kernel.key, kernel, rows, self._movers.movers, *inputs)


def smoothing_of(support: float, mass: float, wall_mass: float, relaxation: float) -> Any:
    """The constants of Eqs 1 to 3: h, the masses over the rest density in cm3, and epsilon h^2."""
    poly6, spiky = 315 / (64 * math.pi * support**9), -45 / (math.pi * support**6)
    smoothing = kernels.Smoothing()
    smoothing.support, smoothing.mass = support, mass
    smoothing.density, smoothing.slope = mass * poly6, mass * spiky
    smoothing.wall_density, smoothing.wall_slope = wall_mass * poly6, wall_mass * spiky
    smoothing.relaxation = relaxation / support**2
    return smoothing
