"""What ends a run: looked for by particle on the device, told by run on the host."""

from typing import NamedTuple

import numpy as np
import warp as wp

from simulate import kernels
from simulate.distance import Barrier
from simulate.launch import Launcher
from simulate.movers import MoversList
from simulate.neighbours import NEIGHBOURS, WALL_NEIGHBOURS
from simulate.state import State
from simulate.viscosity import SEARCHES_AT_MOST

FASTEST_CM_S = 2000.0
"""A fall from 20 m: whatever is faster gained its energy from the numbers."""
DENSEST = 2.5
"""Over rest density. Sound runs, overfull and thick ones included, stayed under 1.5; 128 neighbours come soon after."""
UNSOLVED = 0
"""Beside the kernels' faults, that of a run whose viscosity was not solved."""
SENTENCES = {
    UNSOLVED: f"The viscosity solve did not converge in {SEARCHES_AT_MOST} iterations.",
    int(kernels.NEIGHBOURS_FULL): f"A particle has more than {NEIGHBOURS} neighbours: the fluid collapsed.",
    int(kernels.WALLS_FULL): f"A particle has more than {WALL_NEIGHBOURS} wall particles around it.",
    int(kernels.NOT_FINITE): "A position, speed or density is no number any more.",
    int(kernels.TOO_FAST): f"A particle is faster than {FASTEST_CM_S / 100:g} m/s.",
    int(kernels.TOO_DENSE): f"A particle's density is over {DENSEST:g} times the rest density.",
}


class Fault(NamedTuple):
    """What ended a run."""

    kind: int
    particle: int | None
    """The first of the run's own that had it; None where it is the fault of none."""


class FaultWatch:
    """Marks what spilled or escaped, and keeps every fault until it is told."""

    def __init__(
        self, state: State, movers: MoversList, launcher: Launcher, barrier: Barrier, unsolved: wp.array, support: float
    ) -> None:
        """``unsolved`` is 1 for a run whose viscosity was not solved."""
        self._state, self._movers, self._launch = state, movers, launcher
        self._barrier, self._unsolved, self._support = barrier, unsolved, support
        self.by_particle = wp.zeros(state.count, dtype=int, device=state.device)
        """All that was ever wrong with it, a bit each."""

    def look(self, rows: int) -> None:
        state = self._state
        self._launch.rows(
            "inspect",
            kernels.inspect,
            rows,
            self._movers.movers,
            FASTEST_CM_S,
            DENSEST,
            self._support,
            self._barrier.grid,
            state.place,
            state.density,
            state.velocity,
            state.direction,
            state.fate,
            self.by_particle,
        )

    def found(self) -> dict[int, Fault]:
        """The first one of each run that had any, by the number of the run."""
        unsolved, fault = self._unsolved.numpy(), self.by_particle.numpy()
        found = {int(run): Fault(UNSOLVED, None) for run in np.flatnonzero(unsolved)}
        if fault.any():
            for run, own in enumerate(fault.reshape(self._state.runs, -1)):
                if kinds := np.bitwise_or.reduce(own):
                    kind = int(kinds & -kinds)
                    found[run] = Fault(kind, int(np.argmax(own & kind > 0)))
        return found

    def inspect(self, rows: int) -> dict[int, Fault]:
        """``look``, and what was ``found``."""
        self.look(rows)
        return self.found()

    def forget(self, run: int) -> None:
        """Of a run that is given up."""
        self.by_particle[self._state.own(run)].fill_(0)
        self._unsolved[run : run + 1].fill_(0)
