"""The plane of the cracked face in a mesh: the largest plane that looks up, however rough."""

from dataclasses import dataclass

import numpy as np

from digitise.modelled.repair import Surface
from sealtwin.errors import InputError
from sealtwin.records import Floats

SAMPLES, TRIES = 20_000, 300
"""Points on the surface, and planes through three of them: of a face that is half of all that looks up, one in eight
hits all three; 300 all miss it once in 10^17 meshes.
"""
STEEPEST_DEG = 45.0
"""Of a facet that counts as looking up, and of the face itself: more is another axis."""
ROUGHEST_MM = 1.0
"""How far grain and warp may lie off the plane of a face, at first: coarse asphalt has 1 mm."""
REFINEMENTS = 2
"""Of the plane by least squares: a third turns the plane of a rough scan by less than 0.0001 degrees."""
LEAST_SHARE = 0.5
"""Of all that looks up, that must lie in one plane to be a face."""
LEVEL_RAD = 1e-6
"""A face that falls by less than 0.2 µm over 160 mm is level: turning it would only cost exact coordinates."""


@dataclass(frozen=True)
class FacePlane:
    """Where the face lies, and how flat it is."""

    normal: Floats
    """Unit vector out of the face."""
    place_mm: Floats
    """A point of it, (3,)."""
    roughness_mm: float
    """RMS distance of the face from its plane."""

    @property
    def tilt_deg(self) -> float:
        return float(np.degrees(np.arccos(min(1.0, self.normal[2]))))

    def height_mm(self, points_mm: Floats) -> Floats:
        """Z of the plane at each x and y, (n,)."""
        x, y, z = self.normal
        return self.place_mm[2] - (points_mm - self.place_mm[:2]) @ np.array([x, y]) / z

    @property
    def to_level(self) -> Floats:
        """(4, 4): turns the plane level by the shortest way, and moves it to z = 0."""
        x, y, z = self.normal
        turn = np.eye(3)
        if np.hypot(x, y) > LEVEL_RAD:
            # Rodrigues' formula from the normal to the z axis.
            across = -x * y / (1 + z)
            turn = np.array([[z + y * y / (1 + z), across, -x], [across, z + x * x / (1 + z), -y], [x, y, z]])
        placed = np.eye(4)
        placed[:3, :3] = turn
        placed[2, 3] = -(turn @ self.place_mm)[2]
        return placed


def find_face(surface: Surface) -> FacePlane:
    """The plane with the most area of all that looks up: random samples (Fischler and Bolles 1981), then least squares.

    Raises InputError where less than half of what looks up lies in one plane.
    """
    points_mm = _points_that_look_up(surface)
    rng = np.random.default_rng(0)
    a, b, c = points_mm[rng.integers(len(points_mm), size=(3, TRIES))]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    normal *= (np.sign(normal[:, 2]) / np.where(length > 0, length, 1.0))[:, None]
    upright = normal[:, 2] >= np.cos(np.radians(STEEPEST_DEG))
    planes = list(zip(a[upright], normal[upright], strict=True))
    if not planes:
        raise _no_face(0.0)
    place_mm, up = max(planes, key=lambda plane: (np.abs((points_mm - plane[0]) @ plane[1]) < ROUGHEST_MM).sum())
    reach_mm = ROUGHEST_MM
    away_mm = points_mm @ up
    for _ in range(REFINEMENTS):
        held = points_mm[np.abs((points_mm - place_mm) @ up) <= reach_mm]
        place_mm = held.mean(axis=0)
        up = np.linalg.svd(held - place_mm, full_matrices=False)[2][2]
        up *= np.sign(up[2])
        away_mm = (held - place_mm) @ up
        # The median tells the face's own roughness where the edge of a crack is among the points.
        reach_mm = min(ROUGHEST_MM, max(4.5 * float(np.median(np.abs(away_mm))), 1e-9))
    held = np.abs((points_mm - place_mm) @ up) <= ROUGHEST_MM
    if (share := float(held.mean())) < LEAST_SHARE:
        raise _no_face(share)
    return FacePlane(up, place_mm, float(np.sqrt(np.mean(away_mm**2))))


def _points_that_look_up(surface: Surface) -> Floats:
    """Even over the area of all facets that look up, (SAMPLES, 3)."""
    corners_mm = surface.vertices_mm[surface.faces]
    across = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0])
    area = np.linalg.norm(across, axis=1)
    area[across[:, 2] < np.cos(np.radians(STEEPEST_DEG)) * area] = 0.0
    if not area.any():
        raise _no_face(0.0)
    rng = np.random.default_rng(0)
    chosen = corners_mm[
        np.searchsorted(np.cumsum(area), rng.uniform(0, area.sum(), SAMPLES), side="right").clip(max=len(area) - 1)
    ]
    u, v = np.sort(rng.uniform(size=(2, SAMPLES, 1)), axis=0)
    return u * chosen[:, 0] + (v - u) * chosen[:, 1] + (1 - v) * chosen[:, 2]


def _no_face(share: float) -> InputError:
    return InputError(
        f"Mesh has no plane face on its upper side: {share:.0%} of what looks up lies in one plane, {LEAST_SHARE:.0%} "
        "are needed. Check up, the axis that points out of the cracked face, and crop the mesh to the sample."
    )
