"""Default sizes of particles and substeps for each preset."""

import math
from typing import NamedTuple

from simulate.settings import Nozzle


class Resolution(NamedTuple):
    """Sizes of particles and substeps in a run for which the user does not give them."""

    abreast: float = 4.0
    """Number of particles from wall to wall for radius "auto". The paper has four. With fewer particles, fluid bridges
    the walls. With more, runs take long."""
    fall: float = 0.035
    """Largest value of g dt^2, divided by h, if pressure is carried over. dt is the substep. A larger value compresses
    columns of fluid. With 0.035, the shipped trial has 3 substeps per frame."""
    fall_alone: float = 0.03
    """The same limit if pressure starts at zero in each substep. With longer substeps, a fluid that freezes by age is
    compressed by a tenth."""
    shear_by_frame: bool = False  # True to measure shear rates once in a frame instead of in each substep
    pairs_below: float = 1.0
    """Factor for the radius with which two particles just fit side by side into the nozzle. A radius "auto" between
    that radius and this multiple of it is reduced, because one particle per release would need twice as many frames."""

    def radius_mm(self, width_mm: float, nozzle: Nozzle) -> float:
        """Return the radius in mm for "auto" in a crack of this mean width. It is at most the radius of the nozzle."""
        pair_mm = nozzle.size_mm / 4
        radius_mm = min(width_mm / self.abreast / 2, nozzle.size_mm / 2)
        if pair_mm < radius_mm < self.pairs_below * pair_mm:
            return math.floor(1e3 * pair_mm) / 1e3
        return float(f"{radius_mm:.3g}")


ACCURATE_RESOLUTION = Resolution()
RESOLUTIONS = {
    "accurate": ACCURATE_RESOLUTION,
    "draft": Resolution(abreast=2.6, fall=0.05, fall_alone=0.05, shear_by_frame=True, pairs_below=1.1),
    "paper": ACCURATE_RESOLUTION,
}
