"""The dark board, cloth or air beside a sample that fills the photo but for a side or two."""

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.finding.pieces import pieces
from digitise.pictures.raster import Map

DARK = 0.3
"""Of the usual brightness as displayed. A hard shadow leaves 0.4 or more of it, black cloth 0.2 at most."""
USUAL = 60
"""Percentile of brightness that is the sample's: most of what is searched shows the sample."""
LEAST_SHARE = 0.02
"""Of the picture: smaller is a hole in the sample."""


def surroundings(around: Map) -> NDArray[np.bool_]:
    """Large dark regions that reach the picture's border.

    ``around`` is displayed brightness less all that is narrow, so that no crack is part of them.
    """
    label, area = pieces(around < DARK * np.percentile(around, USUAL))
    on_border = np.unique(np.concatenate([label[0], label[-1], label[:, 0], label[:, -1]]))
    beyond = np.zeros(len(area), dtype=bool)
    beyond[on_border] = area[on_border] >= LEAST_SHARE * around.size
    found = beyond[label] & (label > 0)
    # Lens and focus spread the sample's edge over a few cells.
    return cv2.dilate(found.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
