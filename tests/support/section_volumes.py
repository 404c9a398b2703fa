"""Volume of a cavity as the integral of its horizontal sections: a second way to it, beside the mesh."""

from itertools import pairwise

import numpy as np

from digitise.settings import CrackShape, Tilt
from digitise.solid.footprint import Footprint
from digitise.solid.sections import Slicer

# Gauss-Legendre, over the depth: 70 ppm
NODES: dict[Tilt, int] = {"vertical": 1, "lean": 8, "flare": 8, "undercut": 8, "funnel": 24}
FLOOR_NODES = 16  # Nodes for a floor of changing depth, with a bend of the area at every station: within 400 ppm


def cavity_volume_mm3(footprint: Footprint, shape: CrackShape, finer: int = 1) -> float:
    """Integrate the horizontal sections over the depth, with ``finer`` times the default number of nodes."""
    slicer, reach_mm = Slicer(footprint, shape), shape.deepest_mm
    # A narrow funnel ends far above its floor; place the nodes where it is open.
    while shape.tilt == "funnel" and slicer.between_walls(0.9 * reach_mm).is_empty():
        reach_mm *= 0.9
    stretches_mm, nodes = [(0.0, reach_mm)], NODES[shape.tilt]
    if footprint.floor is not None:
        # At the depth of a level stretch of floor the area of the sections jumps.
        station_mm = shape.depth_at_mm(shape.depth_stations_mm)
        levels_mm = np.unique([*station_mm[:-1][np.diff(station_mm) == 0], *station_mm[[0, -1]]])
        steps_mm = levels_mm[levels_mm < reach_mm]
        stretches_mm, nodes = list(pairwise([0.0, *steps_mm, reach_mm])), FLOOR_NODES
    at, weight = np.polynomial.legendre.leggauss(finer * nodes)
    return sum(
        (below_mm - above_mm) / 2 * w * slicer.cavity(above_mm + (below_mm - above_mm) * (1 + x) / 2).area()
        for above_mm, below_mm in stretches_mm
        for x, w in zip(at, weight, strict=True)
    )
