"""Compute the pressure of a substep: iterations that move particles towards the rest density (Eqs 1 to 3)."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from simulate.fluid.launcher import Launcher
from simulate.fluid.state import State
from simulate.kernels import pressure
from simulate.kernels.pair_kernels import PairKernels
from simulate.settings import PresetConstants
from simulate.setup.signed_distance import Barrier

LONGEST_CORRECTION = 0.25  # Longest correction of one iteration, divided by h
CARRIED_OVER = int(pressure.CARRIED_OVER)
CARRIED = 0.5
"""Fraction of the multipliers that is carried over to the next substep. A larger fraction delays the response. With
0.7, a column of water oscillates with growing amplitude, and with 0.8 also a column of a fluid of 300 mm2/s."""
VISCOUS, THICK = 1.0, 100.0
"""Smallest and largest damping at which pressure is carried over. Fluids with less damping would not come to rest.
Thick sealant under the nozzle collapses from a damping of 340 on, but not at 190."""
CARRYING = 3
"""Number of iterations if pressure is carried over. With three, the fluid is as calm as with 4 iterations that start at
zero, and is compressed two thirds as much. With two, the fluid is not calm."""


class Iterations(NamedTuple):
    """Pressure iterations of a run in a substep: fraction that is carried over, and number of iterations."""

    carried: float  # Fraction of the last substep's multipliers with which the iterations start
    number: int


def iterations_of(damping: float, alone: int) -> Iterations:
    """Return the iterations for a ``Rheology.damping``. ``alone`` is their number if pressure is not carried over."""
    if not VISCOUS <= damping <= THICK:
        return Iterations(0.0, alone)
    return Iterations(CARRIED, min(alone, CARRYING))


class Pressure:
    """Computes the pressure of all runs."""

    def __init__(
        self,
        state: State,
        lists: Any,
        barrier: Barrier,
        pairs: PairKernels,
        launcher: Launcher,
        *,
        smoothing: Any,
        moves_after_viscosity: Sequence[bool],
        scheme: PresetConstants,
        iterations: Sequence[Iterations],
    ) -> None:
        """Bind the kernels. ``iterations`` and ``moves_after_viscosity`` have one item per run.

        ``moves_after_viscosity`` is True for a run whose particles move after the viscosity has been solved.
        """
        self.smoothing = smoothing
        carried, numbers = zip(*iterations, strict=True)
        self._carries, self._most = any(carried), max(numbers)
        self.iteration_state = iteration_state = pressure.IterationState()
        iteration_state.carried = wp.array(carried, float, device=state.device)
        iteration_state.iterations = wp.array(numbers, int, device=state.device)
        iteration_state.moves_after_viscosity = wp.array(np.array(moves_after_viscosity), float, device=state.device)
        iteration_state.correction = wp.zeros(len(lists.fluid_count), wp.vec3, state.device)
        self._densities, self._corrections, self._shifts = {}, {}, {}
        for iteration in (CARRIED_OVER, *range(self._most)):
            self._densities[iteration] = launcher.bind(
                pairs.measure_density,
                state.particles,
                lists,
                smoothing,
                iteration_state,
                iteration,
                shared=True,
            )
            self._corrections[iteration] = launcher.bind(
                pairs.correct,
                state.particles,
                lists,
                smoothing,
                LONGEST_CORRECTION * smoothing.support,
                scheme.frozen_answer,
                iteration_state,
                iteration,
                shared=True,
            )
            self._shifts[iteration] = launcher.bind(
                pressure.shift,
                state.particles,
                iteration_state,
                iteration,
                barrier.grid,
            )

    def solve(self, rows: int) -> None:
        """Compute all iterations of a substep."""
        if self._carries:
            self.correct(rows, CARRIED_OVER)
        for iteration in range(self._most):
            self.measure_density(rows, iteration)
            self.correct(rows, iteration)

    def measure_density(self, rows: int, iteration: int = 0) -> None:
        """Measure densities and volumes, and compute the change of each moving particle's multiplier."""
        self._densities[iteration](rows)

    def correct(self, rows: int, iteration: int | None = None) -> None:
        """Move particles by Eq. 3.

        In the last iteration (default), the walls limit the motion. In other iterations, the nearest plane limits it.
        """
        number = self._most - 1 if iteration is None else iteration
        self._corrections[number](rows)
        self._shifts[number](rows)


def smoothing_of(support: float, mass: float, wall_mass: float, relaxation: float) -> Any:
    """Return the constants of Eqs 1 to 3.

    ``support`` is h in cm. Masses are divided by the rest density, in cm3. ``relaxation`` is epsilon h^2.
    """
    poly6, spiky = 315 / (64 * math.pi * support**9), -45 / (math.pi * support**6)
    smoothing = pressure.KernelConstants()
    smoothing.support, smoothing.mass = support, mass
    smoothing.density, smoothing.slope = mass * poly6, mass * spiky
    smoothing.wall_density, smoothing.wall_slope = wall_mass * poly6, wall_mass * spiky
    smoothing.relaxation = relaxation / support**2
    return smoothing
