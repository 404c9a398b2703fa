"""Paste on a plate, in particles. The plate is the floor of a wide, flat hollow."""

from collections.abc import Mapping, Sequence

import numpy as np

from sealtwin.core.records import Floats
from simulate.bead_law import Bead
from simulate.hollow import Box, Hollow
from simulate.loose_fluid import LooseFluid, all_at_once, scattered, substep_s
from simulate.settings import Fluid, Solver, particle_volume
from simulate.setup.signed_distance import CLEARANCE, CM
from simulate.setup_checks import rheology_of
from simulate.spread_law import Cone

HEADROOM = 1.1  # Depth of the hollow over the paste's height: all paste is then below the face


def paste_on_plate(
    shape: Cone | Bead,
    radius_mm: float,
    reach_mm: float,
    density_kg_m3: float,
    curve: Mapping[str, Sequence[float]],
) -> LooseFluid:
    """Put paste of a shape in the middle of a plate of half side ``reach_mm``.

    ``curve`` is the viscosity and the yield stress of the paste over age.
    """
    corner = (-reach_mm, -reach_mm, 0.0), (reach_mm, reach_mm, HEADROOM * shape.height_mm)
    fluid = Fluid.model_validate({"density_kg_m3": density_kg_m3, "curve": dict(curve), "freeze_after_s": "never"})
    paste = rheology_of(fluid, 4 * radius_mm * CM, substep_s(radius_mm))
    return LooseFluid.put(
        Hollow(Box(*corner)),
        all_at_once(_filled(shape, radius_mm), radius_mm),
        paste,
        Solver(radius_mm=radius_mm),
    )


def _filled(shape: Cone | Bead, radius_mm: float) -> Floats:
    """Return the particles of a shape on z = 0, (n, 3): a lattice with the density of paste, and some scatter."""
    side = float(np.cbrt(particle_volume(radius_mm)))
    points = shape.lattice_mm(side, CLEARANCE * radius_mm)
    # The lattice ends at its sides with a rounding error; stretching makes its volume exact.
    points *= (shape.volume_mm3 / (len(points) * side**3)) ** (1 / 3)
    return scattered(points, side)
