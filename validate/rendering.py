"""A shaded picture of a mesh: parallel projection, hidden surfaces by depth. No display, no GL."""

import numpy as np
from numpy.typing import NDArray

from sealtwin.records import Floats, Integers

LIGHT = np.array([-0.35, -0.45, 0.82])
"""From the upper left of the viewer, in the world's axes."""
SMOOTHING = 2
"""Picture elements on each side of a pixel, averaged: smooth edges."""


def render(
    vertices_mm: Floats,
    faces: Integers,
    face_colour: Floats,
    azimuth_deg: float,
    elevation_deg: float,
    width_px: int,
) -> NDArray[np.uint8]:
    """The mesh as an RGBA picture, transparent around it, ``width_px`` wide.

    ``azimuth_deg`` turns the viewer about z, 0 looking along +y; ``elevation_deg`` is how far the viewer looks down.
    ``face_colour`` is (f, 3) in 0 to 1. Facets that look away are drawn all the same, hidden where others are nearer.
    """
    right, up, toward = _view(azimuth_deg, elevation_deg)
    vertices_mm = vertices_mm - vertices_mm[np.unique(faces)].mean(axis=0)
    place = np.column_stack([vertices_mm @ right, -(vertices_mm @ up)])
    shown = place[np.unique(faces)]
    place = (place - shown.min(axis=0)) * (width_px * SMOOTHING / np.ptp(shown[:, 0]))
    nearness = vertices_mm @ toward
    width, height = np.ceil(place[np.unique(faces)].max(axis=0) / SMOOTHING).astype(int) * SMOOTHING

    shade = _shade(vertices_mm, faces, toward)
    nearest = np.full(height * width, -np.inf)
    owner = np.full(height * width, -1)
    for index, face in enumerate(faces):
        pixel, depth = _covered(place[face], nearness[face], width, height)
        in_front = depth > nearest[pixel]
        nearest[pixel[in_front]] = depth[in_front]
        owner[pixel[in_front]] = index
    picture = np.zeros((height * width, 4), dtype=np.float32)
    seen = owner >= 0
    picture[seen, :3] = face_colour[owner[seen]] * shade[owner[seen], None]
    picture[seen, 3] = 1.0
    picture = picture.reshape(height // SMOOTHING, SMOOTHING, width // SMOOTHING, SMOOTHING, 4)
    mean = picture.mean(axis=(1, 3))
    # Averaged over what is seen only, or edges would darken.
    mean[..., :3] /= np.where(mean[..., 3:] > 0, mean[..., 3:], 1.0)
    return np.round(255 * np.clip(mean, 0, 1)).astype(np.uint8)


def _view(azimuth_deg: float, elevation_deg: float) -> tuple[Floats, Floats, Floats]:
    """Unit vectors to the right and up in the picture, and toward the viewer."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    right = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    away = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    toward = -np.cos(elevation) * away + np.array([0.0, 0.0, np.sin(elevation)])
    return right, np.cross(toward, right), toward


def _shade(vertices_mm: Floats, faces: Integers, toward: Floats) -> Floats:
    """Brightness of each facet, (f,); facets that look away are lit from their back."""
    a, b, c = (vertices_mm[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(size > 0, size, 1.0)
    normal *= np.where(normal @ toward < 0, -1.0, 1.0)[:, None]
    return 0.55 + 0.45 * np.clip(normal @ (LIGHT / np.linalg.norm(LIGHT)), 0.0, 1.0)


def _covered(corner: Floats, nearness: Floats, width: int, height: int) -> tuple[Integers, Floats]:
    """Pixels whose middles a triangle covers, and how near it is there; row by row, so that slivers cost little."""
    first = max(int(np.ceil(corner[:, 1].min() - 0.5)), 0)
    last = min(int(np.floor(corner[:, 1].max() - 0.5)), height - 1)
    rows = np.arange(first, last + 1)
    (ax, ay), (bx, by), (cx, cy) = corner
    doubled_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if not len(rows) or abs(doubled_area) < 1e-9:
        return np.empty(0, int), np.empty(0)
    begin, end = np.full(len(rows), np.inf), np.full(len(rows), -np.inf)
    for (x0, y0), (x1, y1) in ((corner[0], corner[1]), (corner[1], corner[2]), (corner[2], corner[0])):
        if y0 == y1:
            continue
        along = (rows + 0.5 - y0) / (y1 - y0)
        x = np.where((along >= 0) & (along <= 1), x0 + along * (x1 - x0), np.nan)
        begin, end = np.fmin(begin, x), np.fmax(end, x)
    begin = np.clip(np.nan_to_num(np.ceil(begin - 0.5), posinf=width), 0, width).astype(int)
    end = np.clip(np.nan_to_num(np.floor(end - 0.5), neginf=-1), -1, width - 1).astype(int)
    count = np.maximum(end - begin + 1, 0)
    row = np.repeat(rows, count)
    column = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + np.repeat(begin, count)
    to_b = ((column + 0.5 - ax) * (cy - ay) - (row + 0.5 - ay) * (cx - ax)) / doubled_area
    to_c = ((bx - ax) * (row + 0.5 - ay) - (by - ay) * (column + 0.5 - ax)) / doubled_area
    near = nearness[0] + to_b * (nearness[1] - nearness[0]) + to_c * (nearness[2] - nearness[0])
    return row * width + column, near
