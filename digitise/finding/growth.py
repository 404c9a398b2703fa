"""From the middle lines of cracks to all that is crack: sideways, as far as it stays dark."""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median

from digitise.finding.medial import radius
from digitise.finding.pieces import pieces
from digitise.pictures.raster import Map, blurred

GROWN_AT = 0.7
"""Of the darkness in the middle. More than half, for grain is dark too."""
ALONG_PX = 3.0
"""Cells: sigma of the mean along a line that its darkness is, so that no single grain decides how wide it is."""
WIDEST_PX = 40
"""Cells from wall to wall; wider is no crack on a copy of this size."""
SWELLING = 3.0
"""Times its typical half width, a crack reaches sideways at most: there begins a stain or a pore that it runs into."""
LEAST_HALF_PX = 1.5
"""Cells to either side of a line that are always its own: its middle is not known better."""


def grown(lines: NDArray[np.bool_], dark: Map, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells that hang together with a line and are nearly as dark as it is where it is nearest."""
    if not lines.any():
        return lines
    away, nearest = cv2.distanceTransformWithLabels(
        (~lines).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = nearest.astype(np.int64)
    near_line = away <= LEAST_HALF_PX
    dark_enough = dark > GROWN_AT * _of_nearest(_middle(lines, dark), lines, nearest)
    crack = (dark_enough & (away <= WIDEST_PX / 2) | near_line) & allowed
    number, area = pieces(lines)
    half_px = median(radius(crack), number, np.arange(len(area)))
    reach_px = SWELLING * np.maximum(half_px[number], LEAST_HALF_PX)
    crack &= away <= _of_nearest(reach_px, lines, nearest)
    piece, area = pieces(crack)
    kept = np.zeros(len(area), dtype=bool)
    kept[piece[lines]] = True
    return crack & kept[piece]


def _middle(lines: NDArray[np.bool_], dark: Map) -> Map:
    """Darkness on the lines; one runs a cell beside the darkest place here and there."""
    darkest = np.asarray(cv2.dilate(dark, np.ones((3, 3), np.uint8)), dtype=np.float32)
    weight = blurred(lines.astype(np.float32), ALONG_PX)
    total = blurred(np.where(lines, darkest, 0).astype(np.float32), ALONG_PX)
    return (total / np.maximum(weight, 1e-6)).astype(np.float32)


def _of_nearest(value: Map, lines: NDArray[np.bool_], nearest: NDArray[np.int64]) -> Map:
    """At each cell the value of the cell of a line that is nearest."""
    by_line = np.zeros(int(nearest.max()) + 1, dtype=np.float32)
    by_line[nearest[lines]] = value[lines]
    return by_line[nearest]
