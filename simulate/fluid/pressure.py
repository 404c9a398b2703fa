"""The pressure of a substep: particles move where their density pushes them, in a few iterations (Eqs 1 to 3)."""

import itertools
import math
from typing import Any

import warp as wp

from simulate.fluid.coarse_pressure import CoarsePressure
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import MoversList, State
from simulate.kernels import pressure
from simulate.settings import Scheme
from simulate.setup.signed_distance import Barrier

LONGEST_CORRECTION = 0.25  # Longest correction of one iteration, over h


class Pressure:
    """The pressure of all runs, on one level or, with ``coarse``, on two."""

    def __init__(
        self,
        state: State,
        movers: MoversList,
        lists: Any,
        barrier: Barrier,
        pairs: pressure.PressureKernels,
        launcher: Launcher,
        *,
        smoothing: Any,
        as_solved: wp.array,
        scheme: Scheme,
        coarse: CoarsePressure | None,
    ) -> None:
        self.smoothing, self.coarse, self._iterations = smoothing, coarse, scheme.iterations
        rows = len(lists.fluid_count)
        wall_slope, correction = (wp.zeros(rows, dtype=wp.vec3, device=state.device) for _ in range(2))
        moving = (movers.movers, state.particles)
        around = (*moving, lists, smoothing)
        self.measure_density = launcher.bind(pairs.measure_density, *around, wall_slope)
        """Densities, volumes, and each mover's multiplier."""
        if coarse:
            self.measure_terms = launcher.bind(pairs.measure_terms, *around, wall_slope, coarse.rows)
            """The same without multipliers, which the coarse level changes."""
        longest = LONGEST_CORRECTION * smoothing.support
        self._correct = launcher.bind(pairs.correct, *around, longest, scheme.frozen_answer, wall_slope, correction)
        walls = (barrier.clearance, barrier.grid, correction)
        self._shifts = {
            part: launcher.bind(pressure.shift, *moving, as_solved, *part, *walls)
            for part in itertools.product((False, True), repeat=2)
        }
        """Moves, by whether they are the first and the last of a substep."""

    def solve(self, rows: int) -> None:
        """All iterations of a substep."""
        if self.coarse:
            self.coarse.begin(rows)
        for iteration in range(self._iterations):
            if self.coarse:
                self.measure_terms(rows)
                self.coarse.change(iteration, rows)
            else:
                self.measure_density(rows)
            self.correct(rows, first=iteration == 0, last=iteration == self._iterations - 1)

    def correct(self, rows: int, *, first: bool = False, last: bool = True) -> None:
        """Move by Eq. 3; the ``last`` of a substep as far as walls allow, the others as far as their planes do."""
        self._correct(rows)
        self._shifts[first, last](rows)


def smoothing_of(support: float, mass: float, wall_mass: float, relaxation: float) -> Any:
    """The constants of Eqs 1 to 3: h, the masses over the rest density in cm3, and epsilon h^2."""
    poly6, spiky = 315 / (64 * math.pi * support**9), -45 / (math.pi * support**6)
    smoothing = pressure.Smoothing()
    smoothing.support, smoothing.mass = support, mass
    smoothing.density, smoothing.slope = mass * poly6, mass * spiky
    smoothing.wall_density, smoothing.wall_slope = wall_mass * poly6, wall_mass * spiky
    smoothing.relaxation = relaxation / support**2
    return smoothing
