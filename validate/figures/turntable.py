"""The fill in three dimensions: a mesh that the reader of a page can turn.

Only facets that face the viewer are drawn. The near wall of the crack faces away, so it does not hide the sealant.
"""

import base64
import json
from dataclasses import dataclass
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from scipy import ndimage
from skimage.measure import marching_cubes

from sealtwin.core.arrays import normals
from sealtwin.core.records import FaceLabel, Floats, Integers, Run, Solid, unit
from validate.figures.theme import AGES, GROUND, ON_GROUND

FACE_COLOURS = np.array([to_rgb(colour) for colour in (GROUND, "#5b87a6", "#35566e", "#8fb0c6", "#ada497")])
"""Colours of a solid's facets, in the order of ``FaceLabel``."""
INSIDE = (FaceLabel.WALL, FaceLabel.FLOOR)  # Labels of the facets of the cavity
LIGHT = np.array([-0.36, 0.48, 0.8])
"""Unit vector towards the light. Its components point to the right and up in the picture, and towards the viewer."""
DARKEST = 0.55  # Brightness of a facet without light. Its colour can still be compared with the colour scale.

# Sizes of the model in 3-D. They change its look and the page's size, but no figure of a result. Blur and limits were
# chosen by counting vertices and bytes, and by the density of a lattice of particles. The view was chosen by eye.
BLUR = 0.6
"""Standard deviation of the blur, in particle spacings. At this value, the density of a regular lattice varies by 0.1
%, and a layer of one particle is still above the threshold of one half. A larger blur rounds edges and loses thin
layers."""
HALF_FULL = 0.5
"""The surface is where this fraction of the space is filled. At one half, sealant that ends at a plane has its surface
in that plane."""
MAX_VERTICES = 24_000
"""Largest number of vertices of the surface. A finer surface looks no better, and each vertex takes 12 bytes of a
page."""
COARSER_SURFACE, COARSER_WALLS = 1.15, 1.3
"""Factors by which the cells of the surface and of the walls are enlarged, repeatedly, until there are few enough
vertices."""
MERGED_CELL = 1 / 2000
"""Size of the cells in which wall vertices are first merged if there are too many, as a fraction of the solid's
extent."""
ASIDE_DEG, DOWN_DEG = 28.0, 32.0
"""Angles of the first view in degrees. The first angle turns the view away from the right angle to the crack, which
shows the crack's width. The second angle is the downward tilt from the horizontal."""
RIM_MM = 0.35  # Width of the line around the crack's mouth
STEPS = 65_535  # Number of steps across the largest extent, which 16 bits can count: 2 µm each for 160 mm
MAX_CORNERS = STEPS + 1 - MAX_VERTICES
"""Largest number of vertices of walls and rim, because indices have 16 bits. The paper's trial has 7,000 such vertices,
and a scan has millions."""


@dataclass(frozen=True)
class Turntable:
    """Mesh whose facets are drawn only if the viewer sees their outer side."""

    vertices_mm: Floats  # (v, 3)
    faces: Integers  # (f, 3), counter-clockwise from outside
    normal: Floats  # (v, 3)
    colour: Floats  # (v, 3), 0 to 1
    azimuth_deg: float
    elevation_deg: float
    oldest_s: float  # Upper end of the scale of ages, which begins at 0

    def packed(self) -> str:
        """Return JSON for the page's script, with the mesh in base64, little-endian.

        A vertex has 12 bytes: its position as three 16-bit numbers of steps of ``step_mm`` from ``low_mm``, its normal
        as three signed bytes, and its colour as three bytes. A facet has the three 16-bit indices of its vertices.
        """
        low_mm, high_mm = self.vertices_mm.min(axis=0), self.vertices_mm.max(axis=0)
        step_mm = float((high_mm - low_mm).max()) / STEPS
        vertex = np.empty(len(self.vertices_mm), [("place", "<u2", 3), ("normal", "i1", 3), ("colour", "u1", 3)])
        vertex["place"] = np.round((self.vertices_mm - low_mm) / step_mm)
        vertex["normal"] = np.round(127 * self.normal)
        vertex["colour"] = np.round(255 * self.colour)
        return json.dumps(
            {
                "low_mm": low_mm.tolist(),
                "step_mm": step_mm,
                "middle_mm": ((low_mm + high_mm) / 2).tolist(),
                "reach_mm": float(np.linalg.norm(high_mm - low_mm)),
                "azimuth_deg": self.azimuth_deg,
                "elevation_deg": self.elevation_deg,
                "light": LIGHT.tolist(),
                "darkest": DARKEST,
                "vertices": base64.b64encode(vertex.tobytes()).decode(),
                "faces": base64.b64encode(self.faces.astype("<u2").tobytes()).decode(),
            }
        )


def build_turntable(run: Run, solid: Solid) -> Turntable:
    """Return a mesh of the crack's walls and floor, a line around its mouth, and the sealant, coloured by age."""
    stays = ~run.spilled
    oldest_s = max(float(run.age_s.max(initial=0.0)), 0.1)
    fluid = fluid_surface(run.position_mm[stays], run.particle_volume_mm3, run.age_s[stays])
    ages = matplotlib.colormaps[AGES](np.clip(fluid.value / oldest_s, 0.0, 1.0))[:, :3]
    faces, label, rim = _coarse_cavity(solid)
    parts = _walls(solid.vertices_mm, faces, label), _ribbon(solid.vertices_mm, rim), fluid._replace(value=ages)
    columns: Any = map(np.vstack, zip(*parts, strict=True))
    vertices_mm, faces, normal, colour = columns
    # Each part counts its own vertices from 0.
    before = np.cumsum([0, *(len(part.vertices_mm) for part in parts[:-1])])
    faces += np.repeat(before, [len(part.faces) for part in parts])[:, None]
    return Turntable(vertices_mm, faces, normal, colour, square_on(solid) - ASIDE_DEG, DOWN_DEG, oldest_s)


class Surface(NamedTuple):
    """Mesh of one part of the 3-D model."""

    vertices_mm: Floats  # (v, 3)
    faces: Integers  # (f, 3), counter-clockwise from outside
    normal: Floats  # (v, 3), outward
    value: Floats  # Colour, (v, 3). For the sealant, mean age of nearby particles, (v,).


def _cavity(solid: Solid, faces: Integers, label: Integers) -> tuple[Integers, Integers, Integers]:
    """Return the cavity's facets, (f, 3), their labels, (f,), and its rim.

    The rim consists of edges, (n, 2), with the face on their left.
    """
    # A dam at an open end would hide the sealant in the first view.
    inside = np.isin(label, INSIDE)
    edges, back = _directed_edges(faces[label == FaceLabel.TOP]), _directed_edges(faces[inside])[:, ::-1]
    key = [len(solid.vertices_mm), 1]
    return faces[inside], label[inside], edges[np.isin(edges @ key, back @ key)]


def _coarse_cavity(solid: Solid) -> tuple[Integers, Integers, Integers]:
    """Return the cavity of a solid. If it has more than ``MAX_CORNERS`` vertices, neighbouring vertices are merged."""
    faces, label, rim = _cavity(solid, solid.faces, solid.face_label)
    cell_mm = MERGED_CELL * float(np.ptp(solid.vertices_mm, axis=0).max())
    # Each facet has its own three vertices, and each edge of the rim becomes two facets.
    while 3 * (len(faces) + 2 * len(rim)) > MAX_CORNERS:
        cells = np.round(solid.vertices_mm / cell_mm).astype(np.int64)
        _, first, cell = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        merged = first[cell.ravel()][solid.faces]
        whole = (merged != merged[:, [1, 2, 0]]).all(axis=1)
        faces, label, rim = _cavity(solid, merged[whole], solid.face_label[whole])
        cell_mm *= COARSER_WALLS
    return faces, label, rim


def _walls(vertices_mm: Floats, faces: Integers, label: Integers) -> Surface:
    """Return the cavity's facets in the colours of their labels."""
    normal = facet_normals(vertices_mm, faces)
    whole = normal.any(axis=1)
    return _flat(vertices_mm[faces[whole]], normal[whole], FACE_COLOURS[label[whole]])


def _ribbon(vertices_mm: Floats, rim: Integers) -> Surface:
    """Return a ribbon on the face along each edge between the face and a wall."""
    begin_mm, end_mm = vertices_mm[rim.T]
    ahead = end_mm - begin_mm
    onto_face = RIM_MM * unit(np.column_stack([-ahead[:, 1], ahead[:, 0], np.zeros(len(ahead))]))
    corner = np.stack([begin_mm, end_mm, end_mm + onto_face, begin_mm + onto_face], axis=1)
    triangle = corner[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    return _flat(triangle, np.array([0.0, 0.0, 1.0]), np.array(to_rgb(ON_GROUND)))


def _flat(triangle_mm: Floats, normal: Floats, colour: Floats) -> Surface:
    """Return triangles, (f, 3, 3), each with its own vertices, one normal and one colour."""
    corner = triangle_mm.reshape(-1, 3)
    shape = len(triangle_mm), 3
    normal, colour = (np.repeat(np.broadcast_to(values, shape), 3, axis=0) for values in (normal, colour))
    return Surface(corner, np.arange(len(corner)).reshape(shape), normal, colour)


def _directed_edges(faces: Integers) -> Integers:
    return np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


NOTHING = Surface(np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3)), np.empty(0))


def fluid_surface(position_mm: Floats, particle_volume_mm3: float, value: Floats) -> Surface:
    """Return the surface on which half of the space is sealant, from a blurred count of the particles in each cell.

    The method is the colour field of Müller, Charypar and Gross 2003. ``position_mm`` is (n, 3), ``value`` (n,). Cells
    are half as wide as the particles' spacing, or wider if the surface would have more than ``MAX_VERTICES`` vertices.
    Single particles have no surface.
    """
    if not len(position_mm):
        return NOTHING
    spacing_mm = float(np.cbrt(particle_volume_mm3))
    cell_mm = spacing_mm / 2
    while True:
        blur_mm = BLUR * max(spacing_mm, cell_mm)
        margin_mm = 4 * blur_mm + cell_mm
        low_mm = position_mm.min(axis=0) - margin_mm
        position = (position_mm - low_mm) / cell_mm
        shape = tuple(np.ceil(position.max(axis=0) + margin_mm / cell_mm).astype(int) + 2)
        share = particle_volume_mm3 / cell_mm**3
        filled = share * ndimage.gaussian_filter(_spread(position, np.ones(len(position)), shape), blur_mm / cell_mm)
        if filled.max() <= HALF_FULL:
            return NOTHING
        vertices, faces, normal, _ = marching_cubes(filled, HALF_FULL, gradient_direction="ascent")
        if len(vertices) <= MAX_VERTICES:
            break
        cell_mm *= COARSER_SURFACE
    weighted = share * ndimage.gaussian_filter(_spread(position, value, shape), blur_mm / cell_mm)
    sums, counts = (ndimage.map_coordinates(grid, vertices.T, order=1) for grid in (weighted, filled))
    return Surface(vertices * cell_mm + low_mm, faces.astype(np.int64), normal.astype(float), sums / counts)


def _spread(position: Floats, weight: Floats, shape: tuple[int, ...]) -> Floats:
    """Return weights on a grid of this shape. Each weight is distributed over the eight nodes around its position."""
    base, corners = np.floor(position).astype(np.int64), np.array([*np.ndindex(2, 2, 2)])
    part = (position - base)[:, None]
    share = np.prod(np.where(corners, part, 1 - part), axis=2) * weight[:, None]
    node = np.ravel_multi_index(tuple(np.moveaxis(base[:, None] + corners, 2, 0)), shape)
    return np.bincount(node.ravel(), share.ravel(), int(np.prod(shape))).reshape(shape).astype(float)


def square_on(solid: Solid) -> float:
    """Return the azimuth of a view at right angles to the cavity's long side."""
    cavity = np.unique(solid.faces[np.isin(solid.face_label, INSIDE)])
    plan = solid.vertices_mm[cavity, :2]
    _, _, axes = np.linalg.svd(plan - plan.mean(axis=0), full_matrices=False)
    azimuth_deg = float(np.degrees(np.arctan2(axes[0, 1], axes[0, 0])))
    return (azimuth_deg + 90) % 180 - 90


def facet_normals(vertices_mm: Floats, faces: Integers) -> Floats:
    """Return the outward unit normal of each facet, (f, 3). It is zero for a facet without area."""
    return unit(normals(vertices_mm[faces]))
