"""Where along the crack a place lies: its arc length on the centreline, read from a map that kernels can ask."""

import math
from typing import Any

import numpy as np
import warp as wp
from scipy.spatial import KDTree

from sealtwin.records import Floats, arc_length
from simulate import kernels_coarse as device_code


def map_stations(centreline: Floats, low: Floats, high: Floats, spacing: float, device: str) -> tuple[Any, Floats]:
    """The map of the rectangle from ``low`` to ``high``, (2,) each, and the least and largest arc length in it.

    A place belongs to the nearest point of the centreline, (n, 2), whose first and last piece run straight on. All in
    one unit. The direction is that of the line over ``spacing``, so that a traced line's roughness does not count.
    """
    pieces = max(1, math.ceil(arc_length(centreline)[-1] / (spacing / 2)))
    even = np.linspace(0.0, arc_length(centreline)[-1], pieces + 1)
    line = np.column_stack([np.interp(even, arc_length(centreline), column) for column in centreline.T])
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    count = np.ceil((high - low) / spacing).astype(int) + 1
    nodes = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 2)
    place = low + spacing * nodes
    _, nearest = KDTree(line).query(place)
    station = even[nearest] + np.einsum("ij,ij->i", place - line[nearest], along[nearest])
    stations = device_code.Stations()
    stations.corner = wp.vec2(*low)
    stations.spacing = spacing
    stations.count = wp.vec2i(*map(int, count))
    table = np.column_stack([station, along[nearest]])
    stations.at = wp.array(table, dtype=wp.vec3, device=device)
    return stations, np.array([station.min(), station.max()])
