"""Solve the viscosity of a substep, Eq. 5, by backward Euler (one linear solve) or in q explicit passes (the paper).

With a yield stress tau or a flow index n, the kinematic viscosity is (K gamma^(n - 1) + tau / gamma) / rho. K is the
consistency, rho the density, and gamma the shear rate of the last substep (one lagged Picard pass). The same law
applies between the fluid and rough walls.
"""

import math
from functools import partial
from typing import Any

import numpy as np
import warp as wp

from sealtwin.core.records import Integers
from simulate.fluid.cell_grid import NEIGHBOURS, pairs_of
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import SPARE, State, reader
from simulate.fluid.walk import fixed
from simulate.kernels import conjugate_gradients as code
from simulate.kernels.pair_kernels import PairKernels
from simulate.setup.rheology import DAMPING_FACTOR, Rheology, no_slip_weight

OF_THE_RIGHT = 2e-2  # Largest residual, divided by the right side. A coarser time step has five times this error
OF_THE_CHANGE = 1e-2
"""Largest residual, divided by the residual of the velocity without viscosity. With a larger value, the solve would end
before a thin fluid is slowed."""
ITERATIONS_AT_MOST = 5000  # Largest number of iterations. A yield stress of 10,000 Pa takes up to 1,300
STABLE = 0.9  # Largest fraction of a velocity that a pass may remove. A pass overshoots above 1 and diverges above 2.
AT_WALLS = 5.0  # Largest fraction of a velocity that walls on three sides remove, divided by D / h
# Shear rate in 1/s of a newly released particle. It is not measured, as the neighbours are from an earlier release
RELEASE_SHEAR = 10.0


def explicit_passes(
    paste: Rheology, support: float, frame_s: float, substeps: int, *, shears_per_s: tuple[float, float], frames: int
) -> float:
    """Return the largest number of explicit passes that a paste needs in a substep, up to an age of ``frames`` frames.

    ``shears_per_s`` are the lowest shear rate and the shear rate of a jet. Lengths are in cm.
    """
    step_s = frame_s / substeps
    per_viscosity = DAMPING_FACTOR * step_s / support**2
    if paste.sticks:
        per_viscosity += AT_WALLS * no_slip_weight(1.0, support, step_s) / support
    viscosity = max(paste.apparent_cm2_s(shear, support, frame_s)[: frames + 1].max() for shear in shears_per_s)
    return (viscosity * per_viscosity + AT_WALLS * paste.wall_weight_cm / substeps / support) / STABLE


class Viscosity:
    """Solves the viscosity, implicitly or in explicit passes, with the same pair weights.

    Several runs are solved at the same time, independently of each other.
    """

    def __init__(
        self,
        state: State,
        lists: Any,
        paste: Any,
        pairs: PairKernels,
        launcher: Launcher,
        *,
        support: float,
        mass: float,
        explicit: bool,
    ) -> None:
        """Bind the kernels."""
        self._state, self._paste, self._support = state, paste, support
        self._pairs, self._launcher, self.explicit = pairs, launcher, explicit
        viscosity = np.repeat(paste.by_age.numpy()[:, 0, 0], state.particles_per_run)
        state.volume_and_viscosity.assign(np.column_stack([np.full(state.count, mass), viscosity]).astype(np.float32))
        sticks = np.repeat(paste.sticks.numpy() * paste.wall_share.numpy(), state.particles_per_run)
        rows = len(lists.fluid_count)
        self.system = code.new_system(rows, state.column(float), state.column(float), state.device)
        """The linear system that was solved last."""
        self.make_room(lists)
        self.system.at_walls.assign((sticks * viscosity).astype(np.float32))
        self.search = code.new_search(rows, state.runs, state.device)
        """State of the last conjugate-gradient search. ``unsolved`` is 1 for a run in which a solve did not reach its
        goal."""
        self._iterations = reader(self.search.iterations)
        self._other: Any = None  # The second velocity of explicit passes
        self._passes = 0
        self.measure_shear = launcher.bind(
            pairs.measure_shear,
            state.particles,
            lists,
            support,
            paste,
            RELEASE_SHEAR,
            self.system,
            shared=True,
        )
        """Launch that measures the shear rates from the velocities of the last substep, before they change."""
        self.bind_weights(lists)
        self._bind_search()

    def make_room(self, lists: Any) -> None:
        """Make the arrays of the pairs' links as large as the neighbour lists."""
        self.links, self.system.links = pairs_of(lists, NEIGHBOURS, wp.vec3h)

    def bind_weights(self, lists: Any) -> None:
        """Use ``lists`` for the pairs' weights and the walls' drag."""
        self._lists = lists
        self.weigh_pairs = self._launcher.bind(
            self._pairs.weigh_pairs,
            self._state.particles,
            lists,
            self._support,
            self._paste,
            self.system,
            self.search,
            shared=True,
        )
        """Launch that computes the matrix, the residual of the velocity without viscosity, and the residual of the
        first guess."""

    def _bind_search(self) -> None:
        particles, system, search, device = self._state.particles, self.system, self.search, self._state.device
        self._parts = self._state.runs * int(code.CHUNKS)
        runs, parts = (fixed(number, device) for number in (self._state.runs, self._parts))
        by_parts = partial(self._launcher.bind, lanes=code.LANES, extent=parts)
        self.apply_matrix = self._launcher.bind(
            self._pairs.apply_matrix,
            particles,
            self._lists,
            system,
            search,
            shared=True,
        )
        self._sum_residuals = by_parts(code.sum_residuals, particles, system, search)
        self._start_search = by_parts(
            code.start_search,
            OF_THE_RIGHT,
            OF_THE_CHANGE,
            ITERATIONS_AT_MOST,
            particles,
            system,
            search,
        )
        self._sum_curvature = by_parts(code.sum_curvature, particles, search)
        self._advance_search = by_parts(code.advance_search, particles, system, search)
        self._find_turn = self._launcher.bind(code.find_turn, ITERATIONS_AT_MOST, search, lanes=code.LANES, extent=runs)
        self._sum_left = by_parts(code.sum_left, particles, search)
        self._shift_all = by_parts(code.shift_all, particles, search)

    def iterations(self) -> Integers:
        """Return the number of iterations, or of explicit passes, of the last solve for each run."""
        return np.full(self._state.runs, self._passes) if self.explicit else self._iterations().copy()

    def solve_implicit(self, rows: int) -> None:
        """Solve (I + A) v_new = v, backward Euler for Eq. 5, by conjugate gradients until every run is solved.

        The device decides whether another iteration is needed, also in a recorded frame.
        """
        self.weigh_pairs(rows)
        self._sum_residuals(self._parts)
        self._start_search(self._parts)
        self._launcher.repeat(self.search.more, partial(self._iterate, rows))
        self._sum_left(self._parts)
        self._shift_all(self._parts)

    def _iterate(self, rows: int) -> None:
        self.apply_matrix(rows)
        self._sum_curvature(self._parts)
        self._advance_search(self._parts)
        self._find_turn(self._state.runs)

    def pass_explicit(self, rows: int) -> int:
        """Apply Eq. 5 as in the paper: q times v - (A / q) v, with the smallest stable q. Returns q."""
        state = self._state
        if self._other is None:
            self._other = wp.zeros(state.count + SPARE, wp.vec3, state.device)[: state.count]
        # The velocities are copied, so that particles at rest have no speed in both arrays.
        wp.copy(self._other, state.velocity)
        before, after = state.velocity, self._other
        # The first pass measures the stability limit. Usually, no other pass is needed.
        self.pass_once(before, after, 1, rows)
        self._passes = max(1, math.ceil(self.system.restraint.numpy()[:rows].max(initial=0.0) / STABLE))
        for _ in range(self._passes):
            if self._passes > 1:
                self.pass_once(before, after, self._passes, rows)
            before, after = after, before
        wp.copy(state.velocity, before)
        return self._passes

    def pass_once(self, before: Any, after: Any, passes: float, rows: int) -> None:
        """Make one of ``passes`` (q) explicit passes. A pass is stable if the diagonal of A is at most about 1.95 q."""
        launch = self._launcher.bind(
            self._pairs.pass_velocity,
            self._state.particles,
            self._lists,
            self._support,
            self._paste,
            self.system,
            passes,
            before,
            after,
            shared=True,
        )
        launch(rows)
