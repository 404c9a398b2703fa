"""The viscosity of a substep: Eq. 5 by backward Euler (one linear solve), or in q explicit passes as printed.

With a yield stress the solve is Bingham's: viscosity nu + tau / (rho (gamma + eps)), by the shear gamma that the last
substep left (one lagged Picard pass), and the same stress along rough walls.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

from simulate.fluid.launcher import Launcher
from simulate.fluid.state import SPARE, MoversList, State
from simulate.kernels import viscosity as device_code
from simulate.setup.cell_grid import NEIGHBOURS, pairs_of

OF_THE_RIGHT = 1e-3  # Largest residual over the right side: a hundredth of what a coarser step in time changes
OF_THE_CHANGE = 1e-2
"""Largest residual over that of no viscosity at all: without it the solve would end before a thin fluid is slowed."""
ITERATIONS_AT_MOST = 500  # Limit of the conjugate gradients; the prototype's worst case takes 24
STABLE = 0.9  # Largest part of a velocity that one explicit pass may take away: above 1 it overshoots, at 2 it explodes
FRESH_SHEAR, FRESH_CM_S = 10.0, 5.0
"""Shear in 1/s and speed in cm/s of a particle just released, whose neighbours belong to an earlier release."""


class Viscosity:
    """Both solves on the same weights of pairs, for all runs at once; each run is solved as if it were alone."""

    def __init__(
        self,
        state: State,
        movers: MoversList,
        lists: Any,
        paste: Any,
        pairs: device_code.ViscosityKernels,
        launcher: Launcher,
        *,
        support: float,
        mass: float,
        frame_s: float,
    ) -> None:
        rows, runs, device = len(lists.fluid_count), state.runs, state.device
        self._state, self._lists, self._paste, self._support = state, lists, paste, support
        self._pairs, self._launcher = pairs, launcher
        self._moving = (movers.movers, state.particles)
        viscosity = np.repeat(paste.thin.numpy(), state.particles_per_run)
        state.volume_and_viscosity.assign(np.column_stack([np.full(state.count, mass), viscosity]).astype(np.float32))
        self.shear = wp.zeros(state.count, dtype=float, device=device)
        """Shear in 1/s, as the last substep left it; by particle."""
        self.unsolved = wp.zeros(runs, dtype=int, device=device)
        """1 for each run in which a solve ended before its goal."""
        self._system, self._search = device_code.System(), device_code.Search()
        self._system.coupling = pairs_of(rows, NEIGHBOURS, float, device)
        for name in ("resistance", "yields", "slides"):
            setattr(self._system, name, wp.zeros(rows, dtype=float, device=device))
        for name in ("residual", "scaled", "product", "right"):
            setattr(self._search, name, wp.zeros(rows, dtype=wp.vec3, device=device))
        for name in ("right_squared", "error", "previous_error", "curvature", "goal"):
            setattr(self._search, name, wp.zeros(runs, dtype=float, device=device))
        self._search.iterations = wp.zeros(runs, dtype=int, device=device)
        self._partial = wp.zeros((runs, int(device_code.CHUNKS)), dtype=float, device=device)
        self._more = wp.zeros(1, dtype=int, device=device)
        self._other: Any = wp.zeros(state.count + SPARE, dtype=wp.vec3, device=device)[: state.count]

        fresh = (FRESH_SHEAR, FRESH_CM_S, frame_s)
        self.measure_shear = launcher.bind(
            pairs.measure_shear, *self._moving, lists, support, paste, *fresh, self.shear, self._system
        )
        """Measure the shear before a substep replaces the velocities that the last one left."""
        self.bind_weights(lists)
        self._bind_search()

    @property
    def resistance(self) -> Any:
        """Sum of each mover's couplings and of the walls' drag, by row."""
        return self._system.resistance

    def bind_weights(self, lists: Any) -> None:
        """Take the pairs' weights and the walls' drag from ``lists``."""
        self._weigh = self._launcher.bind(
            self._pairs.weigh_pairs, *self._moving, lists, self._support, self._paste, self._system
        )

    def _bind_search(self) -> None:
        launcher, state, search, system = self._launcher, self._state, self._search, self._system
        apply = (self._pairs.apply_matrix, *self._moving, self._lists, system)
        direction, product = state.search_direction, search.product
        self.apply_to_velocity = launcher.bind(*apply, state.velocity, product)
        self.apply_to_direction = launcher.bind(*apply, direction, product)
        self._start = launcher.bind(device_code.start_search, *self._moving, system, search)
        self._advance = launcher.bind(device_code.advance_search, *self._moving, system, search)
        self._turn = launcher.bind(device_code.turn_search, *self._moving, search)
        self._measure_right = self._bind_dot(search.right, search.right, search.right_squared, search.right_squared)
        self._measure_error = self._bind_dot(search.residual, search.scaled, search.error, search.previous_error)
        self._measure_curvature = self._bind_dot(direction, product, search.curvature, search.curvature)
        self._set_goal = launcher.bind_whole(device_code.set_goal, state.runs, OF_THE_RIGHT, OF_THE_CHANGE, search)
        self._ask = launcher.bind_whole(
            device_code.ask_for_more, state.runs, ITERATIONS_AT_MOST, search, self._more, self.unsolved
        )

    def _bind_dot(self, a: wp.array, b: wp.array, total: wp.array, before: wp.array) -> Callable[[], None]:
        """A scalar product of two vectors by row, or of the search direction; ``before`` keeps the last one."""
        runs, by_particle = self._state.runs, int(a is self._state.search_direction)
        bind, chunks = self._launcher.bind_whole, (runs, int(device_code.CHUNKS))
        sum_parts = bind(device_code.sum_chunks, chunks, self._moving[0], by_particle, a, b, self._partial)
        finish = bind(device_code.finish_sum, runs, self._partial, total, before)

        def measure() -> None:
            sum_parts()
            finish()

        return measure

    def solve_implicit(self, rows: int) -> None:
        """Backward Euler on Eq. 5, (I + A) v_new = v, by conjugate gradients, until every run's is solved.

        The device itself decides on the next iteration, so that a recorded solve takes as many as any other.
        """
        self._weigh(rows)
        self.apply_to_velocity(rows)
        self._start(rows)
        self._measure_right()
        self._measure_error()
        self._set_goal()
        self._ask_for_more()
        wp.capture_while(self._more, self._iterate, rows=rows)

    def iterations(self) -> Any:
        """Number of iterations that the last solve took, by run."""
        return self._search.iterations.numpy().copy()

    def _iterate(self, rows: int) -> None:
        self.apply_to_direction(rows)
        self._measure_curvature()
        self._advance(rows)
        self._measure_error()
        self._turn(rows)
        self._ask_for_more()

    def _ask_for_more(self) -> None:
        self._more.zero_()
        self._ask()

    def pass_explicit(self, rows: int) -> int:
        """Eq. 5 as printed, v - (A / q) v, in the fewest passes that are stable; returns their number."""
        state = self._state
        self._weigh(rows)
        mover = self._moving[0].particle.numpy()[:rows]
        share = self.resistance.numpy()[:rows] / state.volume_and_viscosity.numpy()[mover, 0]
        passes = max(1, math.ceil(share.max(initial=0.0) / STABLE))
        # Particles at rest have no speed, in both arrays.
        wp.copy(self._other, state.velocity)
        before, after = state.velocity, self._other
        for _ in range(passes):
            self.pass_once(before, after, passes, rows)
            before, after = after, before
        wp.copy(state.velocity, before)
        return passes

    def pass_once(self, before: Any, after: Any, passes: float, rows: int) -> None:
        """One of q passes; stable up to a largest diagonal of A of about 1.95 q."""
        kernel = self._pairs.pass_velocity
        self._launcher.bind(kernel, *self._moving, self._lists, self._system, passes, before, after)(rows)
