"""The error of the model at the ends of the path, where two models of the same paste differ most.

Where the nozzle stops a mound of up to 4 tau / rho g stays, and where it starts paste creeps back. Two computations of
the same physics differ there by as much as the mound, and by a quarter of it elsewhere, since the volume is the same.
Sizes are from particles against a continuum model on pours that no band was judged on.
"""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Run, Trajectory
from sealtwin.core.regime import GRAVITY_M_S2
from validate.uncertainty.budget import Component, draws_for, normals

LAST, FIRST = 0.7, 0.35  # Standard deviation of the level at the path's last and first place, over the mound's height
REACH_MM = 6.0  # Distance from these places over which it falls to 1/e
MOUND = 4.0  # Height of a mound over tau / rho g


@dataclass(frozen=True)
class BedEnds:
    """First and last place of the nozzle with flow, and the height of a mound."""

    first_mm: float
    last_mm: float
    mound_mm: float

    @classmethod
    def of(cls, trajectory: Trajectory, run: Run) -> "BedEnds | None":
        """Return the ends of a run's path; None for a fluid without a yield stress, which levels out."""
        stress_pa, density_kg_m3 = run.health.yield_stress_pa, run.density_kg_m3
        if not stress_pa or density_kg_m3 is None or trajectory.dispensed_mm3 <= 0:
            return None
        places_mm = trajectory.s_mm[trajectory.giving]
        held_mm = 1e3 * stress_pa / (density_kg_m3 * GRAVITY_M_S2)
        return cls(float(places_mm[0]), float(places_mm[-1]), MOUND * held_mm)

    def errors(self, s_mm: Floats) -> Component:
        """Return the error at places along the whole crack. Its mean over them is 0: no volume is gained."""
        draws = normals("ends of the bed", 2, draws_for(len(s_mm)))
        total = np.zeros((len(draws), len(s_mm)))
        for z, place_mm, share in zip(draws.T, (self.first_mm, self.last_mm), (FIRST, LAST), strict=True):
            shape = np.exp(-np.abs(s_mm - place_mm) / REACH_MM)
            total += np.outer(z, share * self.mound_mm * (shape - shape.mean()))
        return Component("bed at the ends of the path", "assumed", total, shared=True, kind="model")
