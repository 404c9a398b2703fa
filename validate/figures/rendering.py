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
FLAT = 1e-9  # Doubled area, in samples, below which a triangle is regarded as a line


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
    vertices_mm = vertices_mm - vertices_mm[np.unique(faces)].mean(axis=0)
    place = np.column_stack([vertices_mm @ right, -(vertices_mm @ up)])
    shown = place[np.unique(faces)]
    place = (place - shown.min(axis=0)) * (width_px * SMOOTHING / np.ptp(shown[:, 0]))
    nearness = vertices_mm @ toward
    width, height = np.ceil(place[np.unique(faces)].max(axis=0) / SMOOTHING).astype(int) * SMOOTHING

    normal = facet_normals(vertices_mm, faces) if face_normal is None else face_normal
    # Facets that face away are lit from their back.
    normal = normal * np.where(normal @ toward < 0, -1.0, 1.0)[:, None]
    shade = DARKEST + (1 - DARKEST) * np.clip(normal @ (LIGHT @ np.array([right, up, toward])), 0.0, 1.0)
    nearest = np.full(height * width, -np.inf)
    owner = np.full(height * width, -1)
    samples = np.cumsum(np.prod(np.ptp(place[faces], axis=1) + 1, axis=1))
    batches = np.searchsorted(samples, np.arange(MOST_AT_ONCE, samples[-1], MOST_AT_ONCE))
    for part in np.split(np.arange(len(faces)), np.unique(batches)):
        index, pixel, depth = _covered(place[faces[part]], nearness[faces[part]], width, height)
        in_front = np.flatnonzero(depth > nearest[pixel])
        np.maximum.at(nearest, pixel[in_front], depth[in_front])
        # The value that is written last remains, so the order is reversed: of equally near facets the first one wins.
        last = in_front[depth[in_front] == nearest[pixel[in_front]]][::-1]
        owner[pixel[last]] = part[index[last]]
    # The last row is the colour of samples that no facet covers.
    colour = np.zeros((len(faces) + 1, 4), dtype=np.float32)
    colour[:-1, :3] = face_colour * shade[:, None]
    colour[:-1, 3] = 1.0
    owner = owner.reshape(height, width)
    corners = [colour[owner[row::SMOOTHING, column::SMOOTHING]] for row, column in np.ndindex(SMOOTHING, SMOOTHING)]
    mean = np.mean(corners, axis=0)
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


def _covered(corner: Floats, nearness: Floats, width: int, height: int) -> tuple[Integers, Integers, Floats]:
    """Return triangle index, sample index and nearness for each sample that a triangle (f, 3, 2) covers.

    Triangles are filled row by row, so that slivers cost little.
    """
    first = np.maximum(np.ceil(corner[:, :, 1].min(axis=1) - 0.5), 0).astype(int)
    last = np.minimum(np.floor(corner[:, :, 1].max(axis=1) - 0.5), height - 1).astype(int)
    (ax, ay), (bx, by), (cx, cy) = corner.transpose(1, 2, 0)
    doubled_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    flat = np.abs(doubled_area) < FLAT
    owner, row = _counted_up(np.where(flat, 0, np.maximum(last - first + 1, 0)), first)
    begin, end = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for one, other in ((0, 1), (1, 2), (2, 0)):
        (x0, y0), (x1, y1) = corner[owner, one].T, corner[owner, other].T
        along = (row + 0.5 - y0) / np.where(y0 == y1, np.nan, y1 - y0)
        x = np.where((along >= 0) & (along <= 1), x0 + along * (x1 - x0), np.nan)
        begin, end = np.fmin(begin, x), np.fmax(end, x)
    begin = np.clip(np.nan_to_num(np.ceil(begin - 0.5), posinf=width), 0, width).astype(int)
    end = np.clip(np.nan_to_num(np.floor(end - 0.5), neginf=-1), -1, width - 1).astype(int)
    # Nearness is linear on a triangle: one number at the beginning of each row, and one slope along it.
    a, to_b, to_c = nearness[:, 0], nearness[:, 1] - nearness[:, 0], nearness[:, 2] - nearness[:, 0]
    scale = 1 / np.where(flat, 1.0, doubled_area)
    across, down = scale * (to_b * (cy - ay) - to_c * (by - ay)), scale * (to_c * (bx - ax) - to_b * (cx - ax))
    at_begin = a[owner] + across[owner] * (begin + 0.5 - ax[owner]) + down[owner] * (row + 0.5 - ay[owner])
    count = np.maximum(end - begin + 1, 0)
    span, step = _counted_up(count, np.zeros_like(begin))
    return owner[span], (row * width + begin)[span] + step, at_begin[span] + across[owner][span] * step


def _counted_up(count: Integers, first: Integers) -> tuple[Integers, Integers]:
    """Return ``count[k]`` copies of each index k, and for the copies the numbers first[k], first[k] + 1, and so on."""
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - first, count)
