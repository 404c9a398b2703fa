"""A camera above a face: where each place on the face falls in its photo, the bending of the lens included."""

from dataclasses import dataclass

import numpy as np

from digitise.geometry.polyline import project
from sealtwin.records import Floats

STRAIGHT_MM = 1.0
"""A straight piece this long is bent by less than 0.01 px, by a lens of k1 = -0.2 at 260 mm."""


@dataclass(frozen=True)
class Camera:
    """A pinhole with one radial term: x_d = x_u (1 + k1 r²), r being |x_u| over the focal length."""

    homography: Floats
    """From the face (mm, y up) to the photo (px, y down) of a lens that bends nothing, (3, 3)."""
    focal_px: float
    lens_k1: float
    """x_u and x_d count from the photo's centre; negative is the barrel of a wide lens."""
    size_px: tuple[int, int]
    """Width and height of the photo."""

    def to_px(self, points_mm: Floats) -> Floats:
        """(n, 2) to (n, 2)."""
        straight_px = project(self.homography, points_mm)
        if self.lens_k1 == 0:
            return straight_px
        centre_px = (np.array(self.size_px) - 1) / 2
        away_px = straight_px - centre_px
        stretch = 1 + self.lens_k1 * (away_px**2).sum(axis=1, keepdims=True) / self.focal_px**2
        return centre_px + away_px * stretch

    def ring_px(self, ring_mm: Floats) -> Floats:
        """A ring, with more points where the lens bends its sides."""
        if self.lens_k1 == 0:
            return self.to_px(ring_mm)
        sides = zip(ring_mm, np.roll(ring_mm, -1, axis=0), strict=True)
        return self.to_px(np.concatenate([_pieces(start, end) for start, end in sides]))


def camera_above(
    face_mm: tuple[float, float],
    frame_mm: float,
    mm_per_px: float,
    distance_mm: float,
    tilt_deg: float,
    lens_k1: float,
) -> Camera:
    """Over the middle of a face, seeing ``frame_mm`` around it; tilted about x, and half as much about y."""
    size_px = tuple(round((side + 2 * frame_mm) / mm_per_px) for side in face_mm)
    focal_px = distance_mm / mm_per_px
    about_x, about_y = np.radians(tilt_deg), np.radians(tilt_deg / 2)
    rotation_x = np.array([[1, 0, 0], [0, np.cos(about_x), -np.sin(about_x)], [0, np.sin(about_x), np.cos(about_x)]])
    rotation_y = np.array([[np.cos(about_y), 0, np.sin(about_y)], [0, 1, 0], [-np.sin(about_y), 0, np.cos(about_y)]])
    rotation = rotation_y @ rotation_x
    lens = np.array([[focal_px, 0, (size_px[0] - 1) / 2], [0, focal_px, (size_px[1] - 1) / 2], [0.0, 0.0, 1.0]])
    pose = np.column_stack([rotation[:, 0], rotation[:, 1], [0, 0, distance_mm]])
    to_camera = np.array([[1, 0, -face_mm[0] / 2], [0, -1, face_mm[1] / 2], [0, 0, 1]])
    homography = lens @ pose @ to_camera
    return Camera(homography / homography[2, 2], focal_px, lens_k1, (size_px[0], size_px[1]))


def _pieces(start: Floats, end: Floats) -> Floats:
    """Points from ``start`` up to but not at ``end``."""
    count = max(1, int(np.ceil(np.linalg.norm(end - start) / STRAIGHT_MM)))
    return start + np.outer(np.arange(count) / count, end - start)
