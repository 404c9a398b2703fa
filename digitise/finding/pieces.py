"""Connected pieces of a mask."""

import cv2
import numpy as np
from numpy.typing import NDArray

from sealtwin.records import Integers


def pieces(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int32], Integers]:
    """Number of the piece that each cell belongs to, from 1, and how many cells each has; 0 is what is no piece.

    Cells that touch at a corner hang together.
    """
    _, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    area = stats[:, cv2.CC_STAT_AREA].astype(np.int64)
    area[0] = 0
    return label.astype(np.int32), area


def larger_pieces(mask: NDArray[np.bool_], least: float) -> NDArray[np.bool_]:
    """The mask less its pieces of fewer than ``least`` cells."""
    label, area = pieces(mask)
    return mask & (area >= least)[label]
