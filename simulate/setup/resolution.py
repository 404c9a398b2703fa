"""Default sizes of particles and substeps for each preset."""

import math
from typing import NamedTuple

from simulate.settings import Nozzle


class Resolution(NamedTuple):
    """Sizes of particles and substeps that a run has if the user does not give them."""

    abreast: float = 4.0
    """Number of particles from wall to wall for radius "auto". The paper has four. Fewer particles bridge the walls,
    and more take long."""
    fall: float = 0.035
    """Largest fall from rest in one substep if pressure is carried over, as g dt^2 divided by h. A larger fall
    compresses the column. 0.035 gives the shipped trial 3 substeps."""
    fall_alone: float = 0.03
    """Same limit as ``fall`` if pressure starts at zero in each substep. Longer substeps compress a fluid that freezes
    by age by a tenth."""
    shear_by_frame: bool = False  # True to measure shear rates once in a frame instead of in each substep
    pairs_below: float = 1.0
    """Largest radius "auto" that is lowered so that two particles fit the nozzle side by side, as a multiple of the
    radius at which two just fit. A single particle per release needs twice the frames."""

    def radius_mm(self, width_mm: float, nozzle: Nozzle) -> float:
        """Return the radius for "auto" in a crack of this mean width. It is at most the radius of the nozzle."""
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
