"""Detect faults that end a run.

The device marks the particles at fault, and the host reports the faults of each run.
"""

from typing import NamedTuple

import numpy as np
import warp as wp

from simulate.fluid.cell_grid import NEIGHBOURS, WALL_NEIGHBOURS
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import State, reader
from simulate.fluid.viscosity import ITERATIONS_AT_MOST
from simulate.kernels import neighbours, pressure
from simulate.setup.signed_distance import Barrier

FASTEST_CM_S = 2000.0  # Speed after a fall of 20 m. Faster particles have gained energy by numerical errors.
DENSEST = 2.5
"""Largest allowed density, divided by the rest density. Correct runs, also with overfull cracks and thick sealant, stay
below 1.5. Slightly above this limit, lists of 128 neighbours are full."""
UNSOLVED = 0  # Kind of fault if the viscosity of a run was not solved. The kernels define the other kinds.
SENTENCES = {
    UNSOLVED: f"The viscosity solve did not converge in {ITERATIONS_AT_MOST} iterations.",
    int(neighbours.NEIGHBOURS_FULL): f"A particle has more than {NEIGHBOURS} neighbours: the fluid collapsed.",
    int(neighbours.WALLS_FULL): f"A particle has more than {WALL_NEIGHBOURS} wall particles around it.",
    int(pressure.NOT_FINITE): "A position, speed or density is not finite.",
    int(pressure.TOO_FAST): f"A particle is faster than {FASTEST_CM_S / 100:g} m/s.",
    int(pressure.TOO_DENSE): f"A particle's density is over {DENSEST:g} times the rest density.",
}


class RunFault(NamedTuple):
    """A fault that ended a run."""

    kind: int
    particle: int | None
    """Number of the first particle with the fault, counted within the run. None for a fault of the whole run."""


class FaultChecks:
    """Checks that mark particles that spilled or escaped, and that record the faults of particles and runs."""

    def __init__(self, state: State, launcher: Launcher, barrier: Barrier, unsolved: wp.array, support: float) -> None:
        """Bind the checks. ``unsolved`` is 1 for each run whose viscosity was not solved."""
        self._state, self._unsolved = state, unsolved
        self._faults, self._runs_unsolved = reader(state.fault), reader(unsolved)
        self.look = launcher.bind(
            pressure.inspect,
            state.particles,
            FASTEST_CM_S,
            DENSEST,
            support,
            barrier.grid,
        )
        """Launch that checks the moving particles. Its argument is the number of moving particles."""

    def found(self) -> dict[int, RunFault]:
        """Return the first fault of each run that has a fault. The keys are run numbers."""
        faults = {int(run): RunFault(UNSOLVED, None) for run in np.flatnonzero(self._runs_unsolved())}
        if self._faults().any():
            for run, bits in enumerate(self._state.by_release(self._state.fault).reshape(self._state.runs, -1)):
                if kinds := np.bitwise_or.reduce(bits):
                    kind = int(kinds & -kinds)
                    faults[run] = RunFault(kind, int(np.argmax(bits & kind > 0)))
        return faults

    def forget(self, run: int) -> None:
        """Delete the faults of a run that is no longer computed."""
        self._state.fault[self._state.own(run)].fill_(0)
        self._unsolved[run : run + 1].fill_(0)
