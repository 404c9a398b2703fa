"""Sizes of particles and of substeps that a run has if they are not given, by its preset."""

import math
from typing import NamedTuple

from simulate.settings import Nozzle


class Resolution(NamedTuple):
    """Sizes of particles and substeps if they are not given."""

    abreast: float = 4.0
    """Particles from wall to wall for radius "auto". Four are the paper's. Fewer bridge the walls, more take long."""
    fall: float = 0.035
    """Largest fall from rest in one substep, g dt^2 over h, if pressure carries over. A larger one compresses the
    column. 0.035 gives the shipped trial 3 substeps."""
    fall_alone: float = 0.03
    """The same if pressure starts at zero in each substep. In longer substeps a fluid that freezes by age is compressed
    by a tenth."""
    shear_by_frame: bool = False  # True if shear rates are measured once in a frame, not in each substep
    pairs_below: float = 1.0
    """Radius "auto" below which two particles leave the nozzle together, over the radius of two that just fit. Lone
    particles take twice the frames."""

    def radius_mm(self, width_mm: float, nozzle: Nozzle) -> float:
        """Return radius "auto" for a crack of this mean width. It is at most the nozzle's."""
        pair_mm = nozzle.diameter_mm / 4
        radius_mm = min(width_mm / self.abreast / 2, nozzle.diameter_mm / 2)
        if pair_mm < radius_mm < self.pairs_below * pair_mm:
            return math.floor(1e3 * pair_mm) / 1e3
        return float(f"{radius_mm:.3g}")


ACCURATE_RESOLUTION = Resolution()
RESOLUTIONS = {
    "accurate": ACCURATE_RESOLUTION,
    "draft": Resolution(abreast=2.6, fall=0.05, fall_alone=0.05, shear_by_frame=True, pairs_below=1.1),
    "paper": ACCURATE_RESOLUTION,
}
