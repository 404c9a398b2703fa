"""Whether a line is the edge of something, dark against one side only: a patch, paint, a shadow."""

import cv2
import numpy as np

from digitise.geometry.polyline import left_normals, smoothed
from digitise.pictures.raster import Map
from sealtwin.records import Floats, Integers

BESIDE_PX = (2.0, 3.0, 4.0)
"""Cells from the rim of the line to where its two sides are seen."""
ALONG_PX = 6.0
"""Cells: sigma of the mean along the line, so that no grain decides."""
STRAIGHTENED_PX = 3.0
"""Cells: sigma along the line before its normals are taken; a chain of cells has only eight directions."""


def edge_share(even: Map, line: Integers, half_width: float) -> float:
    """Share of a line, cell after cell, along which its sides differ by more than it is darker than the darker one."""
    middle_line = smoothed(line[:, ::-1].astype(float), STRAIGHTENED_PX)
    across = (half_width + np.array(BESIDE_PX))[:, None, None] * left_normals(middle_line)
    left, right = (_seen(even, middle_line + side * across).mean(axis=0) for side in (1, -1))
    middle = _seen(even, middle_line)
    left, right, middle = (smoothed(light, ALONG_PX, returns=0) for light in (left, right, middle))
    return float(np.mean(np.abs(left - right) > np.minimum(left, right) - middle))


def _seen(even: Map, places: Floats) -> Floats:
    """Brightness at places (..., 2), x and y."""
    x, y = np.moveaxis(places.astype(np.float32), -1, 0)
    light = cv2.remap(even, np.atleast_2d(x), np.atleast_2d(y), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(light, dtype=float).reshape(x.shape)
