"""The surface of the sealant, read from its particles as a closed mesh of triangles."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from skimage.measure import marching_cubes

from sealtwin.records import Floats, Integers

BLUR = 0.6
"""Standard deviation of the blur over the particles' spacing: a lattice keeps 0.1 % of its grain, and a layer one
particle thick still fills more than half of the space it is in."""
HALF_FULL = 0.5
"""Of the space: at an even surface, exactly where the sealant ends."""
MOST_VERTICES = 24_000
"""A finer surface is no better to look at, and 12 bytes a vertex is what a page has to carry."""
COARSER = 1.15
"""From one try to the next where a surface has more."""


@dataclass(frozen=True)
class Surface:
    vertices_mm: Floats  # (v, 3)
    faces: Integers  # (f, 3), counter-clockwise seen from outside
    normal: Floats  # (v, 3), outward
    value: Floats  # (v,): mean of the particles around


NOTHING = Surface(np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3)), np.empty(0))


def fluid_surface(position_mm: Floats, particle_volume_mm3: float, value: Floats) -> Surface:
    """Where half of the space is sealant: the colour field of Müller, Charypar and Gross 2003, its particles blurred.

    ``position_mm`` is (n, 3), ``value`` (n,) what colours them. The mesh is closed, and as fine as half the spacing of
    the particles or as ``MOST_VERTICES`` allows. Particles that fly or lie alone fill no space and leave nothing.
    """
    if not len(position_mm):
        return NOTHING
    spacing_mm = float(np.cbrt(particle_volume_mm3))
    cell_mm = spacing_mm / 2
    while True:
        surface = _at(position_mm, particle_volume_mm3, value, cell_mm, BLUR * max(spacing_mm, cell_mm))
        if len(surface.vertices_mm) <= MOST_VERTICES:
            return surface
        cell_mm *= COARSER


def _at(position_mm: Floats, volume_mm3: float, value: Floats, cell_mm: float, blur_mm: float) -> Surface:
    margin_mm = 4 * blur_mm + cell_mm
    low_mm = position_mm.min(axis=0) - margin_mm
    place = (position_mm - low_mm) / cell_mm
    shape = tuple(np.ceil(place.max(axis=0) + margin_mm / cell_mm).astype(int) + 2)
    filled = ndimage.gaussian_filter(_spread(place, np.ones(len(place)), shape), blur_mm / cell_mm)
    filled *= volume_mm3 / cell_mm**3
    if filled.max() <= HALF_FULL:
        return NOTHING
    vertices, faces, normal, _ = marching_cubes(filled, HALF_FULL, gradient_direction="ascent")
    weighted = ndimage.gaussian_filter(_spread(place, value, shape), blur_mm / cell_mm) * volume_mm3 / cell_mm**3
    at = ndimage.map_coordinates(weighted, vertices.T, order=1) / ndimage.map_coordinates(filled, vertices.T, order=1)
    return Surface(vertices * cell_mm + low_mm, faces.astype(np.int64), normal.astype(float), at)


def _spread(place: Floats, weight: Floats, shape: tuple[int, ...]) -> Floats:
    """Weights shared out to the eight nodes around each place, by nearness."""
    base = np.floor(place).astype(np.int64)
    part = place - base
    grid = np.zeros(int(np.prod(shape)))
    for corner in np.ndindex(2, 2, 2):
        share = np.prod(np.where(corner, part, 1 - part), axis=1)
        node = np.ravel_multi_index(tuple((base + corner).T), shape)
        grid += np.bincount(node, share * weight, len(grid))
    return grid.reshape(shape)
