"""Shaded picture of a mesh in parallel projection, without a display or GL.

Hidden surfaces are removed pixel by pixel: mplot3d sorts whole triangles, and drew the far dam through the near one.
"""

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.records import Floats, Integers

LIGHT = np.array([-0.36, 0.48, 0.8])
"""Unit vector to the light. Its components point to the right and up in the picture, and toward the viewer."""
DARKEST = 0.55  # Brightness without light; the colour can still be compared with its scale
SMOOTHING = 2  # Samples along each side of a pixel, averaged for smooth edges
MOST_AT_ONCE = 1_000_000  # Samples in the bounding boxes of facets that are computed together, in 100 MB
FLAT = 1e-9  # Least width of a row, in samples, over which nearness may change


def render(
    vertices_mm: Floats,
    faces: Integers,
    face_colour: Floats,
    azimuth_deg: float,
    elevation_deg: float,
    width_px: int,
    face_normal: Floats | None = None,
) -> NDArray[np.uint8]:
    """Return an RGBA picture of a mesh, ``width_px`` wide, transparent around it.

    At ``azimuth_deg`` 0 the view is along +y, at ``elevation_deg`` 90 straight down. ``face_colour`` is (f, 3) in 0 to
    1; ``face_normal`` (f, 3) replaces the facets' own normals in the shading. Facets that face away are drawn too.
    """
    right, up, toward = view_axes(azimuth_deg, elevation_deg)
    used, corner = np.unique(faces, return_inverse=True)
    # To the right and down in the picture, and toward the viewer, in samples.
    place = vertices_mm[used] @ np.column_stack([right, -up, toward])
    place -= place.min(axis=0)
    place *= width_px * SMOOTHING / place[:, 0].max()
    width, height = width_px * SMOOTHING, int(np.ceil(place[:, 1].max() / SMOOTHING)) * SMOOTHING

    normal = facet_normals(vertices_mm, faces) if face_normal is None else face_normal
    # Facets that face away are lit from their back.
    normal = np.copysign(1.0, normal @ toward)[:, None] * normal
    shade = DARKEST + (1 - DARKEST) * np.clip(normal @ (LIGHT @ np.array([right, up, toward])), 0.0, 1.0)
    triangle, owner = place[corner.reshape(faces.shape)], np.full(height * width, -1)
    nearest = np.full(height * width, -np.inf)
    samples = np.cumsum(np.prod(np.ptp(triangle[..., :2], axis=1) + 1, axis=1))
    batches = np.searchsorted(samples, np.arange(MOST_AT_ONCE, samples[-1], MOST_AT_ONCE))
    for part in np.split(np.arange(len(faces)), np.unique(batches)):
        facet, sample, nearness = _covered(triangle[part], width, height)
        np.maximum.at(nearest, sample, nearness)
        front = nearness == nearest[sample]
        owner[sample[front]] = part[facet[front]]
    # The last row is the colour of samples that no facet covers.
    colour = np.zeros((len(faces) + 1, 4), dtype=np.float32)
    colour[:-1, :3] = face_colour * shade[:, None]
    colour[:-1, 3] = 1.0
    shape = height // SMOOTHING, SMOOTHING, width // SMOOTHING, SMOOTHING
    mean = colour[owner].reshape(*shape, 4).mean(axis=(1, 3))
    # The average is over covered samples only, or edges would darken.
    mean[..., :3] /= np.where(mean[..., 3:] > 0, mean[..., 3:], 1.0)
    return np.round(255 * np.clip(mean, 0, 1)).astype(np.uint8)


def view_axes(azimuth_deg: float, elevation_deg: float) -> tuple[Floats, Floats, Floats]:
    """Return unit vectors to the right and up in the picture, and toward the viewer."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    right = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    away = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    toward = -np.cos(elevation) * away + np.array([0.0, 0.0, np.sin(elevation)])
    return right, np.cross(toward, right), toward


def seen_from(vertices_mm: Floats, faces: Integers, azimuth_deg: float, elevation_deg: float) -> NDArray[np.bool_]:
    """Return the mask, (f,), of the facets whose outside faces the viewer."""
    _, _, toward = view_axes(azimuth_deg, elevation_deg)
    return facet_normals(vertices_mm, faces) @ toward > 0


def facet_normals(vertices_mm: Floats, faces: Integers) -> Floats:
    """Return the outward unit normal of each facet, (f, 3). It is zero for a facet without area."""
    a, b, c = (vertices_mm[faces[:, k]] for k in range(3))
    return unit(np.cross(b - a, c - a))


def unit(vectors: Floats) -> Floats:
    """Return vectors (n, 3) scaled to unit length. A zero vector remains zero."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(size > 0, size, 1.0)


def _covered(corner: Floats, width: int, height: int) -> tuple[Integers, Integers, Floats]:
    """Return triangle, sample and nearness, (n,) each, for the samples that triangles cover.

    ``corner`` is (f, 3, 3): the corners' places to the right, down and toward the viewer. Triangles are filled row by
    row, so that slivers cost little.
    """
    y = corner[..., 1]
    first = np.maximum(np.ceil(y.min(axis=1) - 0.5), 0).astype(int)
    last = np.minimum(np.floor(y.max(axis=1) - 0.5), height - 1).astype(int)
    triangle, row = _counted_up(np.maximum(last - first + 1, 0), first)
    # A row's middle crosses two of the three edges of its triangle, or ends at a corner of two edges.
    start, step = corner[triangle], np.roll(corner, -1, axis=1)[triangle] - corner[triangle]
    share = (row[:, None] + 0.5 - start[..., 1]) / np.where(step[..., 1] == 0, np.nan, step[..., 1])
    crosses = (share >= 0) & (share <= 1)
    crossing = start + np.where(crosses, share, 0.0)[..., None] * step
    rows = np.arange(len(row))
    left = crossing[rows, np.where(crosses, crossing[..., 0], np.inf).argmin(axis=1)]
    right = crossing[rows, np.where(crosses, crossing[..., 0], -np.inf).argmax(axis=1)]
    begin = np.clip(np.ceil(left[:, 0] - 0.5), 0, width).astype(int)
    end = np.clip(np.floor(right[:, 0] - 0.5), -1, width - 1).astype(int)
    span, column = _counted_up(np.where(crosses.any(axis=1), np.maximum(end - begin + 1, 0), 0), begin)
    slope = (right[:, 2] - left[:, 2]) / np.maximum(right[:, 0] - left[:, 0], FLAT)
    nearness = left[span, 2] + slope[span] * (column + 0.5 - left[span, 0])
    return triangle[span], row[span] * width + column, nearness


def _counted_up(count: Integers, first: Integers) -> tuple[Integers, Integers]:
    """Return ``count[k]`` copies of each index k, and for the copies the numbers first[k], first[k] + 1, and so on."""
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - first, count)
