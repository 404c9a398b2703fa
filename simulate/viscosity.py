"""The viscosity of a substep: Eq. 5 by backward Euler (one linear solve), or in q explicit passes as printed.

With a yield stress the solve is Bingham's: viscosity nu + tau / (rho (gamma + eps)), by the shear gamma that the last
substep left (one lagged Picard pass), and the same stress along rough walls.
"""

import math
from typing import Any

import numpy as np
import warp as wp

from simulate import kernels_viscosity as device_code
from simulate.launch import Launcher
from simulate.movers import MoversList
from simulate.neighbours import NEIGHBOURS, NeighbourLists, pairs_of
from simulate.pairs import PairKernels
from simulate.state import SPARE, State
from simulate.walls import Walls

OF_THE_WHOLE = 1e-3
"""Largest residual over the right hand side: a hundredth of what a coarser step in time changes."""
OF_THE_CHANGE = 1e-2
"""Largest residual over that of no viscosity at all: without it the solve would end before a thin fluid is slowed."""
SEARCHES_AT_MOST = 500
"""The prototype's worst case takes 24."""
STABLE = 0.9
"""Largest part of a velocity that one explicit pass may take away: above 1 it overshoots, at 2 it explodes."""
FRESH_SHEAR, FRESH_CM_S = 10.0, 5.0
"""1/s, cm/s: of what has just left the nozzle, whose neighbours are not its own yet."""


class Viscosity:
    """Both solves on the same weights of pairs, for all runs at once; each run is solved as if it were alone."""

    def __init__(
        self,
        state: State,
        movers: MoversList,
        lists: NeighbourLists,
        walls: Walls,
        paste: Any,
        kernels: PairKernels,
        launcher: Launcher,
        *,
        support: float,
        mass: float,
        frame_s: float,
    ) -> None:
        rows, device = len(lists.fluid_count), state.device
        self._state, self._movers, self._paste = state, movers, paste
        self._lists, self._walls = lists, walls
        self._support, self._frame_s = support, frame_s
        self._pairs, self._launch = kernels.viscosity, launcher
        self.shear = wp.zeros(state.count, dtype=float, device=device)
        """1/s, as the last substep left it; by particle."""
        thickness = np.repeat(paste.thin.numpy(), state.points_a_run)
        state.bulk.assign(np.column_stack([np.full(state.count, mass), thickness]).astype(np.float32))
        self._yields, self._slides = (wp.zeros(rows, dtype=float, device=device) for _ in range(2))
        self._coupling = pairs_of(rows, NEIGHBOURS, float, device)
        self.resistance = wp.zeros(rows, dtype=float, device=device)
        self._residual, self._scaled, self._product, self._whole = (
            wp.zeros(rows, dtype=wp.vec3, device=device) for _ in range(4)
        )
        self._partial = wp.zeros((state.runs, int(device_code.CHUNKS)), dtype=float, device=device)
        self._sums = {
            name: wp.zeros(state.runs, dtype=float, device=device)
            for name in ("whole", "error", "error_before", "curvature", "goal", "unused")
        }
        self._more = wp.zeros(1, dtype=int, device=device)
        self._searches = wp.zeros(state.runs, dtype=int, device=device)
        self.unsolved = wp.zeros(state.runs, dtype=int, device=device)
        """By run: 1 where a solve ended before its goal."""
        self._other: Any = wp.zeros(state.count + SPARE, dtype=wp.vec3, device=device)[: state.count]

    def measure_shear(self, rows: int) -> None:
        """Before a substep replaces the velocities that the last one left."""
        state, lists = self._state, self._lists
        self._launch.rows(
            "shear",
            self._pairs.measure_shear,
            rows,
            self._movers.movers,
            state.points_a_run,
            self._support,
            self._paste,
            FRESH_SHEAR,
            FRESH_CM_S,
            state.frame,
            self._frame_s,
            state.frame_of,
            state.place,
            state.velocity,
            lists.fluid,
            lists.fluid_count,
            state.bulk,
            self.shear,
            self._yields,
            self._slides,
        )

    def solve_implicit(self, rows: int) -> None:
        """Backward Euler on Eq. 5, (I + A) v_new = v, by conjugate gradients, until every run's is solved.

        The device itself asks whether to go on, so that a recorded solve takes as many iterations as any other.
        """
        state, sums = self._state, self._sums
        diagonal = (self.resistance, state.bulk)
        self._weigh(rows)
        self._apply("first product", rows, state.velocity)
        self._launch.rows(
            "start of search",
            device_code.start_search,
            rows,
            self._movers.movers,
            *diagonal,
            state.velocity,
            self._product,
            self._residual,
            self._scaled,
            state.direction,
            self._whole,
        )
        self._dot("whole", self._whole, self._whole, "whole", "unused")
        self._dot("error", self._residual, self._scaled, "error", "error_before")
        self._launch.all(
            "goal",
            device_code.set_goal,
            state.runs,
            OF_THE_WHOLE,
            OF_THE_CHANGE,
            sums["whole"],
            sums["error"],
            sums["goal"],
        )
        self._searches.zero_()
        self._ask_for_more()
        wp.capture_while(self._more, self._search, rows=rows)

    def searches(self) -> Any:
        """Iterations that the last solve took, by run."""
        return self._searches.numpy().copy()

    def _search(self, rows: int) -> None:
        state, sums = self._state, self._sums
        self._apply("product", rows, state.direction)
        self._dot("curvature", state.direction, self._product, "curvature", "unused")
        self._launch.rows(
            "advance of search",
            device_code.advance_search,
            rows,
            self._movers.movers,
            state.points_a_run,
            sums["error"],
            sums["goal"],
            sums["curvature"],
            self.resistance,
            state.bulk,
            state.direction,
            self._product,
            state.velocity,
            self._residual,
            self._scaled,
        )
        self._dot("error", self._residual, self._scaled, "error", "error_before")
        self._launch.rows(
            "turn of search",
            device_code.turn_search,
            rows,
            self._movers.movers,
            state.points_a_run,
            sums["error"],
            sums["error_before"],
            self._scaled,
            state.direction,
        )
        self._ask_for_more()

    def _ask_for_more(self) -> None:
        sums = self._sums
        self._more.zero_()
        self._launch.all(
            "more",
            device_code.ask_for_more,
            self._state.runs,
            SEARCHES_AT_MOST,
            sums["error"],
            sums["goal"],
            self._searches,
            self._more,
            self.unsolved,
        )

    def pass_explicit(self, rows: int) -> int:
        """Eq. 5 as printed, v - (A / q) v, in the fewest passes that are stable; how many these were."""
        state = self._state
        self._weigh(rows)
        who = self._movers.movers.who.numpy()[:rows]
        share = self.resistance.numpy()[:rows] / state.bulk.numpy()[who, 0]
        passes = max(1, math.ceil(share.max(initial=0.0) / STABLE))
        # Who rests has no speed, in both.
        wp.copy(self._other, state.velocity)
        before: Any = state.velocity
        after = self._other
        for _ in range(passes):
            self.pass_once(before, after, passes, rows)
            before, after = after, before
        wp.copy(state.velocity, before)
        return passes

    def pass_once(self, before: Any, after: Any, passes: float, rows: int) -> None:
        """One of q passes; stable up to a largest diagonal of A of about 1.95 q."""
        state, lists = self._state, self._lists
        self._launch.rows_once(
            self._pairs.pass_velocity,
            rows,
            self._movers.movers,
            passes,
            lists.fluid,
            lists.fluid_count,
            self._coupling,
            self.resistance,
            state.bulk,
            before,
            after,
        )

    def _weigh(self, rows: int) -> None:
        state, lists = self._state, self._lists
        self._launch.rows(
            "weights",
            self._pairs.weigh_pairs,
            rows,
            self._movers.movers,
            state.points_a_run,
            self._support,
            self._paste,
            state.place,
            self._slides,
            self._yields,
            state.bulk,
            lists.fluid,
            lists.fluid_count,
            self._walls.place,
            lists.wall,
            lists.wall_count,
            self._coupling,
            self.resistance,
        )

    def _apply(self, name: str, rows: int, vector: wp.array) -> None:
        lists = self._lists
        self._launch.rows(
            name,
            self._pairs.apply_matrix,
            rows,
            self._movers.movers,
            lists.fluid,
            lists.fluid_count,
            self._coupling,
            self.resistance,
            self._state.bulk,
            vector,
            self._product,
        )

    def _dot(self, name: str, a: wp.array, b: wp.array, total: str, before: str) -> None:
        """Of two vectors, the first by row like the second, or by particle."""
        runs, sums = self._state.runs, self._sums
        along = a is self._state.direction
        kernel = device_code.sum_chunks_along if along else device_code.sum_chunks
        dim = (runs, int(device_code.CHUNKS))
        self._launch.all(f"{name}, parts", kernel, dim, self._movers.movers, a, b, self._partial)
        self._launch.all(name, device_code.finish_sum, runs, self._partial, sums[total], sums[before])
