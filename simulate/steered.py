"""A run of particles along a given motion of the nozzle with a flow that is set during the run, to emulate control.

It runs on a CPU, because the host writes into the arrays, and needs a given volume factor: a run can only find one if
its volume is scheduled.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Bed, Outline, Profile, Solid, Trajectory
from simulate.device import start_warp
from simulate.injection import prepare
from simulate.profile import measure_profile
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver, particle_volume
from simulate.setup.release_schedule import Outlet
from simulate.setup.rheology import NEVER
from simulate.setup.signed_distance import CM


class SteeredPour:
    """A fluid run that is advanced step by step, each with the nozzle's present flow."""

    def __init__(
        self,
        solid: Solid,
        outline: Outline,
        motion: Trajectory,
        fluid: Fluid,
        solver: Solver,
        nozzle: Nozzle,
        *,
        most_mm3_s: float,
        seed: int,
        slope: SampleSlope = LEVEL,
    ) -> None:
        """Prepare a run along ``motion``, whose flow is ignored. The flow may never exceed ``most_mm3_s``.

        Raises InputError if solver.volume_factor is missing, or if the run cannot be prepared.
        """
        if solver.keeps_volume:
            raise InputError(
                "solver.volume_factor is missing: a steered pour needs the value that a run of the same trial records."
            )
        start_warp()
        ceiling = np.append(np.full(len(motion.t_s) - 1, most_mm3_s), 0.0)
        sample = solid, outline, replace(motion, flow_mm3_s=ceiling)
        self._run = prepare(*sample, [fluid], solver, nozzle, seed=seed, device="cpu", slope=slope)
        self._solid, self._motion, self._slope = solid, motion, slope
        self._volume_mm3 = particle_volume(self._run.solver.size_mm)
        self._outlet = Outlet(self._run.solver.size_mm, nozzle.diameter_mm, seed)
        self._outlet_mm2 = np.pi / 4 * nozzle.diameter_mm**2
        self._asked_mm3, self._out = 0.0, 0
        schedule = self._run.schedule
        self._released = np.zeros_like(schedule.released)
        self._run.schedule = replace(schedule, released=self._released, frame_of=np.full(schedule.particles, NEVER))
        self._run.engine.state.release_by(self._released, NEVER)

    @property
    def t_s(self) -> float:
        return self._motion.t_s[0] + self._run.t_s

    @property
    def given_mm3(self) -> float:
        return self._asked_mm3

    def advance(self, until_s: float, flow_mm3_s: Callable[[float], float]) -> None:
        """Compute frames up to a time, each with the flow at its middle. Raises NumericalError for a fault."""
        frame_s = self._run.schedule.frame_s
        while self.t_s + frame_s / 2 < until_s:
            self._release(flow_mm3_s(self.t_s + frame_s / 2), frame_s)
            self._run.advance()

    def level(self) -> Profile:
        """Return the present level along the crack."""
        self._run.wait()
        state, own = self._run.engine.state, slice(0, self._out)
        bed = Bed(
            state.position_mm()[own],
            state.velocity_mm_s()[own],
            np.zeros(self._out, dtype=bool),
            self._run.solver.size_mm,
            self._volume_mm3,
            self._slope.table,
        )
        return measure_profile(bed, self._run.outline, self._solid)

    def _release(self, flow_mm3_s: float, frame_s: float) -> None:
        """Release a disc of particles once the dispensed volume exceeds that of the released ones."""
        self._asked_mm3 += flow_mm3_s * frame_s
        frame, state = self._run.done, self._run.engine.state
        if flow_mm3_s > 0 and self._asked_mm3 / self._volume_mm3 > self._out + 1e-6:
            count = min(self._outlet.release, state.particles_per_run - self._out)
            own = slice(self._out, self._out + count)
            tip_mm = [np.interp(self.t_s, self._motion.t_s, values) for values in self._motion.position_mm.T]
            offset_mm = np.pad(self._outlet.places_mm(1)[0, :count], ((0, 0), (0, 1)))
            down_mm_s = np.array([0.0, 0.0, -flow_mm3_s / self._outlet_mm2])
            state.place(own, (tip_mm + offset_mm) * CM, down_mm_s * CM, frame)
            self._out += count
        self._released[frame:] = self._out
