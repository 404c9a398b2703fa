"""Thin lines out of a map of what may be crack: each place votes for the way on which it is reached (geodesic voting).

After Rouchdy and Cohen 2013. Ways merge on the cracks, so that these gather votes, bridge their gaps and lose their
side hairs; the lines are as exact as the map of strength, not as what voted.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.graph import MCP_Geometric

from digitise.finding.pieces import larger_pieces
from sealtwin.records import Floats, Integers

LEAST_VOTES = 11
"""Cells: a side hair shorter than this gathers fewer."""
LONGEST_BRIDGE_PX = 20
"""Cells that a line may run where nobody voted: a gap at a coarse grain or a stain."""
FAR_PX = 6.0
"""Cells: voters farther than this from any line are a line that closes a loop."""


def voted_lines(voters: NDArray[np.bool_], region: NDArray[np.bool_], cost: Floats) -> NDArray[np.bool_]:
    """Lines one cell wide along which the voters are linked at least cost.

    ``region`` is where a line is seen: outside it one may run for ``LONGEST_BRIDGE_PX`` only.
    """
    if not voters.any():
        return voters
    votes = _votes(voters, cost)
    lines = votes >= LEAST_VOTES
    around = cv2.dilate(region.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    lines &= ~larger_pieces(lines & ~around, LONGEST_BRIDGE_PX)
    away = cv2.distanceTransform((~lines).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return lines | larger_pieces(voters & (away > FAR_PX), LEAST_VOTES)


def _votes(voters: NDArray[np.bool_], cost: Floats) -> Integers:
    """How many voters' cheapest way to the cheapest of them leads over each cell."""
    cheapest = np.flatnonzero(voters & (cost == cost[voters].min()))
    # Many cost the same; the first of them would be the tip of whatever lies highest in the picture, be it a hair.
    root = int(cheapest[len(cheapest) // 2])
    search = MCP_Geometric(np.where(np.isfinite(cost), cost, -1), fully_connected=True)
    _, came_by = search.find_costs([np.unravel_index(root, cost.shape)])
    steps = np.array(search.offsets, dtype=np.int64) @ (cost.shape[1], 1)
    votes = np.zeros(cost.size, dtype=np.int64)
    place = np.flatnonzero(voters)
    place = place[came_by.ravel()[place] >= 0]
    carried = np.ones(len(place), dtype=np.int64)
    while len(place):
        votes[place] += carried
        moving = place != root
        place, merged = np.unique(place[moving] - steps[came_by.ravel()[place[moving]]], return_inverse=True)
        carried = np.bincount(merged, weights=carried[moving], minlength=len(place)).astype(np.int64)
    return votes.reshape(cost.shape)
