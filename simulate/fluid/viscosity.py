"""The viscosity of a substep: Eq. 5 by backward Euler (one linear solve), or in q explicit passes as printed.

With a yield stress or a flow index the viscosity is K gamma^(n - 1) + tau / gamma, divided by the density. gamma is the
shear rate of the last substep (one lagged Picard pass). The same holds between the fluid and rough walls.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from simulate.fluid.cell_grid import NEIGHBOURS, pairs_of
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import SPARE, State
from simulate.kernels import conjugate_gradients as code
from simulate.kernels.viscosity import ViscosityKernels
from simulate.setup.rheology import DAMPS, Rheology, kinematic_viscosity, no_slip_weight

OF_THE_RIGHT = 2e-2  # Largest residual over the right side: a fifth of the error of a coarser time step
OF_THE_CHANGE = 1e-2
"""Largest residual, as a share of the residual of the velocity without viscosity. With more, the solve would end before
a thin fluid is slowed."""
ITERATIONS_AT_MOST = 5000  # Limit of the conjugate gradients; paste of 10,000 Pa takes up to 1,300
STABLE = 0.9  # Largest part of a velocity that one explicit pass may remove: above 1 it overshoots, at 2 it explodes
AT_WALLS = 5.0  # Largest part of a velocity that walls on three sides remove, over D / h
FRESH_SHEAR = 10.0  # Shear in 1/s of a particle just released: its neighbours are from an earlier release


def explicit_parts(
    paste: Rheology, support: float, frame_s: float, substeps: int, *, shears_per_s: tuple[float, float], lasts_s: float
) -> tuple[float, float, float]:
    """Return the fractions of a velocity that viscosity, yield stress and D each remove in one explicit substep.

    They are the largest, and may exceed 1. ``shears_per_s`` are the slowest shear rate and that of a jet. Lengths are
    in cm.
    """
    step_s = frame_s / substeps
    per_viscosity = DAMPS * step_s / support**2
    if paste.sticks:
        per_viscosity += AT_WALLS * no_slip_weight(1.0, support, step_s) / support
    thick = kinematic_viscosity(float(paste.course[:, 0].max()), support, frame_s)
    thick *= max(shear ** (paste.flow_index - 1) for shear in shears_per_s)
    stiff = paste.reached_cm2_s2(lasts_s) / shears_per_s[0]
    return thick * per_viscosity, stiff * per_viscosity, AT_WALLS * paste.wall_weight_cm / substeps / support


class Viscosity:
    """Both solves of the viscosity, with the same weights of pairs. All runs are solved at once, independently."""

    def __init__(
        self,
        state: State,
        lists: Any,
        paste: Any,
        pairs: ViscosityKernels,
        launcher: Launcher,
        *,
        support: float,
        mass: float,
        frame_s: float,
    ) -> None:
        rows, runs, device = len(lists.fluid_count), state.runs, state.device
        self._state, self._lists, self._paste, self._support = state, lists, paste, support
        self._pairs, self._launcher = pairs, launcher
        self._particles = state.particles
        viscosity = np.repeat(paste.by_age.numpy()[:, 0, 0], state.particles_per_run)
        state.volume_and_viscosity.assign(np.column_stack([np.full(state.count, mass), viscosity]).astype(np.float32))
        sticks = np.repeat(paste.sticks.numpy() * paste.wall_share.numpy(), state.particles_per_run)
        self.system, self._search = code.System(), code.Search()
        """The linear system that was solved last, and its search."""
        self.links, self.system.links = pairs_of(lists, NEIGHBOURS, wp.vec3h)
        self.system.at_walls, self.system.shear = state.column(float), state.column(float)
        self.system.at_walls.assign((sticks * viscosity).astype(np.float32))
        self.system.inverse = wp.zeros(rows, dtype=code.Symmetric, device=device)
        for name in ("drag", "restraint"):
            setattr(self.system, name, wp.zeros(rows, dtype=float, device=device))
        for name in ("residual", "product", "direction", "pull"):
            setattr(self._search, name, wp.zeros(rows, dtype=wp.vec3, device=device))
        self._search.curvature = wp.zeros(rows, dtype=float, device=device)
        for name in ("error", "length", "turn", "goal", "holds"):
            setattr(self._search, name, wp.zeros(runs, dtype=float, device=device))
        for name in ("iterations", "unsolved"):
            setattr(self._search, name, wp.zeros(runs, dtype=int, device=device))
        self._search.left = wp.zeros((runs, int(code.CHUNKS)), dtype=float, device=device)
        self._search.partial = wp.zeros((runs, int(code.CHUNKS)), dtype=code.Sums, device=device)
        self._search.more = wp.zeros(1, dtype=int, device=device)
        self._other: Any = None  # The second velocity of explicit passes

        fresh = (FRESH_SHEAR, frame_s)
        self.measure_shear = launcher.bind(
            pairs.measure_shear, self._particles, lists, support, paste, *fresh, self.system, shared=True
        )
        """Measure the shear rates from the velocities of the last substep, before they change."""
        self.bind_weights(lists)
        self._bind_search()

    @property
    def unsolved(self) -> Any:
        """Return an array by run: 1 if a solve of the run ended above its goal."""
        return self._search.unsolved

    def make_room(self, lists: Any) -> None:
        """Give the links of pairs as much room as the lists of neighbours have."""
        if lists is not self._lists:
            raise RuntimeError("the viscosity has other lists, which get no new stores")
        self.links, self.system.links = pairs_of(lists, NEIGHBOURS, wp.vec3h)

    def bind_weights(self, lists: Any) -> None:
        """Use ``lists`` for the pairs' weights and the walls' drag."""
        self._lists = lists
        around = (self._particles, lists, self._support)
        self.weigh_pairs = self._launcher.bind(
            self._pairs.weigh_pairs, *around, self._paste, self.system, self._search, shared=True
        )
        """Compute the matrix, and the residuals of the velocity without viscosity and of the guess."""

    def _bind_search(self) -> None:
        particles, system, search = self._particles, self.system, self._search
        by_parts, moving = self._bind_by_parts, (particles, system, search)
        goals = (OF_THE_RIGHT, OF_THE_CHANGE, ITERATIONS_AT_MOST)
        find_turn = self._launcher.bind(code.find_turn, ITERATIONS_AT_MOST, search, lanes=code.LANES)
        self.apply_matrix = self._launcher.bind(
            self._pairs.apply_matrix, particles, self._lists, system, search, shared=True
        )
        self._begin = [by_parts(code.sum_residuals, *moving), by_parts(code.start_search, *goals, *moving)]
        self._step = [
            by_parts(code.sum_curvature, particles, search),
            by_parts(code.advance_search, *moving),
            lambda rows: find_turn(self._state.runs),
        ]
        self._end = [by_parts(code.sum_left, particles, search), by_parts(code.shift_all, particles, search)]

    def _bind_by_parts(self, kernel: Any, *inputs: object) -> Callable[[int], None]:
        """Return a launch over the parts of all runs. Its argument is the number of rows."""
        parts = self._state.runs * int(code.CHUNKS)
        launch = self._launcher.bind(kernel, *inputs, lanes=code.LANES)
        return lambda rows: launch(parts, rows / parts)

    def solve_implicit(self, rows: int) -> None:
        """Solve backward Euler on Eq. 5, (I + A) v_new = v, by conjugate gradients, until every run is solved.

        The device decides on further iterations, so that a recorded solve takes as many as it needs.
        """
        self.weigh_pairs(rows)
        _launch_all(self._begin, rows)
        wp.capture_while(self._search.more, self._iterate, rows=rows)
        _launch_all(self._end, rows)

    def iterations(self) -> Any:
        """Return the number of iterations of the last solve, by run."""
        return self._search.iterations.numpy().copy()

    def _iterate(self, rows: int) -> None:
        self.apply_matrix(rows)
        _launch_all(self._step, rows)

    def pass_explicit(self, rows: int) -> int:
        """Apply Eq. 5 as printed, v - (A / q) v, in the fewest stable passes; return their number."""
        state = self._state
        if self._other is None:
            self._other = wp.zeros(state.count + SPARE, dtype=wp.vec3, device=state.device)[: state.count]
        # Copied, so that particles at rest have no speed in either array.
        wp.copy(self._other, state.velocity)
        before, after = state.velocity, self._other
        self.pass_once(before, after, 1, rows)
        passes = max(1, math.ceil(self.system.restraint.numpy()[:rows].max(initial=0.0) / STABLE))
        if passes == 1:
            before = after
        else:
            for _ in range(passes):
                self.pass_once(before, after, passes, rows)
                before, after = after, before
        wp.copy(state.velocity, before)
        return passes

    def pass_once(self, before: Any, after: Any, passes: float, rows: int) -> None:
        """Make one of q passes. It is stable if the diagonal of A is at most about 1.95 q."""
        kernel = self._pairs.pass_velocity
        inputs = (self._lists, self._support, self._paste, self.system, passes, before, after)
        self._launcher.bind(kernel, self._particles, *inputs, shared=True)(rows)


def _launch_all(launches: Sequence[Callable[[int], None]], rows: int) -> None:
    for launch in launches:
        launch(rows)
