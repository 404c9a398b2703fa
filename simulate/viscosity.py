"""The viscosity of a substep: Eq. 5 by backward Euler (one linear solve), or in q explicit passes as printed."""

import math
from typing import Any

import numpy as np
import warp as wp
from warp.utils import array_inner

from sealtwin.errors import NumericalError
from simulate import kernels_viscosity as device_code
from simulate.state import NEIGHBOURS, State
from simulate.walls import Walls

OF_THE_WHOLE = 1e-3
"""Largest residual over the right hand side: a hundredth of what a coarser step in time changes."""
OF_THE_CHANGE = 1e-2
"""Largest residual over that of no viscosity at all: without it the solve would end before a thin fluid is slowed."""
SEARCHES_AT_MOST = 500
"""The prototype's worst case takes 24."""
STABLE = 0.9
"""Largest part of a velocity that one explicit pass may take away: above 1 it overshoots, at 2 it explodes."""
LAW = 0.1185
"""nu = LAW U h^4 / dt: half the second moment of the weight over h^4, lengths in cm. Held to 5 % by shear waves."""


def kinematic_viscosity(weight: float, support: float, step_s: float) -> float:
    """What Eq. 5 with U = ``weight``, once in ``step_s``, amounts to; cm2/s."""
    return LAW * weight * support**4 / step_s


def viscous_weight(kinematic: float, support: float, step_s: float) -> float:
    """U for a kinematic viscosity in cm2/s."""
    return kinematic * step_s / (LAW * support**4)


class Viscosity:
    """Both solves on the same weights of pairs. ``weights`` are U and D (cm) of one substep."""

    def __init__(self, state: State, walls: Walls, support: float, mass: float, weights: tuple[float, float]) -> None:
        rows, device = len(state.neighbour_count), state.device
        self._state, self._walls = state, walls
        self._support, self._mass = support, mass
        self._fluid_weight, self._wall_weight = weights
        self._coupling = wp.zeros((rows, NEIGHBOURS), dtype=float, device=device)
        self.resistance = wp.zeros(rows, dtype=float, device=device)
        self.volume = wp.zeros(rows, dtype=float, device=device)
        self._vectors = [wp.zeros(rows, dtype=wp.vec3, device=device) for _ in range(5)]
        self._scalars = [wp.zeros(1, dtype=float, device=device) for _ in range(3)]

    def solve_implicit(self) -> int:
        """Backward Euler on Eq. 5, (I + A) v_new = v, by conjugate gradients; how many iterations it took.

        Raises NumericalError where it does not converge.
        """
        solution, residual, scaled, direction, product = self._vectors
        error, error_before, curvature = self._scalars
        diagonal = [self.resistance, self.volume]
        state = self._state
        self._weigh()
        self._launch(device_code.start_search, [state.first, *diagonal, state.velocity, solution, residual, scaled])
        self._dot(residual, scaled, error)
        whole = error.numpy()[0]
        self._apply(solution, product)
        self._launch(device_code.first_residual, [*diagonal, product, residual, scaled, direction])
        self._dot(residual, scaled, error)
        goal = min(OF_THE_WHOLE**2 * whole, OF_THE_CHANGE**2 * error.numpy()[0])
        iterations = 0
        while error.numpy()[0] > goal:
            if iterations == SEARCHES_AT_MOST:
                raise NumericalError(f"The viscosity solve did not converge in {iterations} iterations.")
            self._apply(direction, product)
            self._dot(direction, product, curvature)
            self._launch(
                device_code.advance_search,
                [error, curvature, *diagonal, direction, product, solution, residual, scaled],
            )
            error, error_before = error_before, error
            self._dot(residual, scaled, error)
            self._launch(device_code.turn_search, [error, error_before, scaled, direction])
            iterations += 1
        wp.copy(state.velocity, solution, state.first, 0, state.moving)
        return iterations

    def pass_explicit(self) -> int:
        """Eq. 5 as printed, v - (A / q) v, in the fewest passes that are stable; how many these were."""
        before, after, *_ = self._vectors
        state = self._state
        self._weigh()
        share = self.resistance.numpy()[: state.moving] / self.volume.numpy()[: state.moving]
        passes = max(1, math.ceil(np.max(share) / STABLE))
        wp.copy(before, state.velocity, 0, state.first, state.moving)
        for _ in range(passes):
            self.pass_once(before, after, passes)
            before, after = after, before
        wp.copy(state.velocity, before, state.first, 0, state.moving)
        return passes

    def pass_once(self, before: wp.array, after: wp.array, passes: float) -> None:
        """One of q passes; stable up to a largest diagonal of A of about 1.95 q."""
        state = self._state
        self._launch(
            device_code.pass_velocity,
            [
                state.first,
                passes,
                state.neighbour,
                state.neighbour_count,
                self._coupling,
                self.resistance,
                self.volume,
                before,
                after,
            ],
        )

    def _apply(self, vector: wp.array, product: wp.array) -> None:
        state = self._state
        pairs = [state.neighbour, state.neighbour_count, self._coupling, self.resistance, self.volume]
        self._launch(device_code.apply_matrix, [state.first, *pairs, vector, product])

    def _weigh(self) -> None:
        state, walls = self._state, self._walls
        self._launch(
            device_code.weigh_pairs,
            [
                state.first,
                self._support,
                self._mass,
                self._fluid_weight,
                self._wall_weight,
                state.position,
                state.density,
                state.neighbour,
                state.neighbour_count,
                walls.point,
                walls.share,
                state.wall_neighbour,
                state.wall_count,
                self._coupling,
                self.resistance,
                self.volume,
            ],
        )

    def _launch(self, kernel: Any, inputs: list) -> None:
        wp.launch(kernel, self._state.moving, inputs=inputs, device=self._state.device)

    def _dot(self, a: wp.array, b: wp.array, out: wp.array) -> None:
        array_inner(a, b, out=out, count=self._state.moving)
