"""Emulated scans of sealed cracks for ``benchmarks.scans``: sample, surface of the sealant, and file of the scan.

No scan was taken. A case is a winding crack, the height z(x, y) of the surface that a scanner sees from above, and a
file of points, triangles or heights with noise, outliers, holes and an unknown position. Same number, same case.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d, map_coordinates
from scipy.spatial import KDTree

from digitise.geometry.polyline import left_normals
from digitise.settings import CrackShape, Tilt
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats, Outline, Solid
from tests.support.shapes import CLOSED, CUT, outline_between

FORMATS = ("binary.ply", "ascii.ply", "points.xyz", "points.csv", "mesh.stl", "mesh.ply", "map.png", "map.tiff")
NOISE_MM, NOISE_OVER_MM, TEXTURE_MM, OUTLIERS = 0.05, 1.0, 0.03, 0.05
MAP_Z_MM, COUNT_MM = 20.0, 0.001
TRUTH_STEP_MM = 0.2


@dataclass(frozen=True)
class Sealed:
    """Sample with a sealed crack. Arrays have a value for each point of the centreline."""

    outline: Outline
    solid: Solid
    halves_mm: Floats  # Distances of the left and the right wall from the centreline, (n, 2)
    level_mm: Floats  # Mean across the crack
    curve_mm: Floats  # Height of the sealant at the walls above its height in the middle
    reach_mm: Floats  # Width of the spills on the left and on the right, (2,)
    shear: Floats  # Shift of leaning walls for each mm of depth, (2,)
    narrowing: float  # Shift of each wall of a funnel for each mm of depth

    def local_mm(self, points_mm: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return arc length, distance to the left of the mouth's middle, half of its width, and shear to the left."""
        line_mm = self.outline.centreline_mm
        normal = left_normals(line_mm)
        nearest = KDTree(line_mm).query(points_mm)[1]
        offset, to_left = points_mm - line_mm[nearest], normal[nearest]
        s_mm = self.outline.s_mm[nearest] + offset[:, 0] * to_left[:, 1] - offset[:, 1] * to_left[:, 0]
        left_mm, right_mm = (np.interp(s_mm, self.outline.s_mm, half) for half in self.halves_mm.T)
        return (
            s_mm,
            (offset * to_left).sum(axis=1) - (left_mm - right_mm) / 2,
            (left_mm + right_mm) / 2,
            (to_left @ self.shear),
        )

    def sealant_mm(self, points_mm: Floats) -> Floats:
        """Return z of the sealant's surface between the walls, also below an overhanging wall."""
        depth_mm = np.maximum(-np.interp(self.local_mm(points_mm)[0], self.outline.s_mm, self.level_mm), 0.0)
        s_mm, across_mm, half_mm, _ = self.local_mm(points_mm - depth_mm[:, None] * self.shear)
        level_mm, curve_mm = (np.interp(s_mm, self.outline.s_mm, row) for row in (self.level_mm, self.curve_mm))
        share = np.clip(across_mm / np.maximum(half_mm - depth_mm * self.narrowing, 1e-6), -1.0, 1.0)
        return level_mm + curve_mm * (share**2 - 1 / 3)

    def beside_mm(self, points_mm: Floats) -> Floats:
        """Return the distance from the mouth, 0 inside."""
        s_mm, across_mm, half_mm, _ = self.local_mm(points_mm)
        beyond_mm = np.maximum(0.0, np.maximum(-s_mm, s_mm - self.outline.length_mm))
        return np.hypot(np.maximum(np.abs(across_mm) - half_mm, 0.0), beyond_mm)

    def seen_mm(self, points_mm: Floats) -> Floats:
        """Return z of the surface that is seen from above: face, spill, sealant or wall."""
        s_mm, across_mm, half_mm, shear = self.local_mm(points_mm)
        beside_mm = self.beside_mm(points_mm)
        edge_mm = np.interp(s_mm, self.outline.s_mm, self.level_mm + self.curve_mm * 2 / 3)
        reach_mm = np.where(across_mm > 0, *self.reach_mm)
        spill_mm = np.maximum(edge_mm, 0.0) * np.maximum(1 - (beside_mm / reach_mm) ** 2, 0.0)
        z_mm = self.sealant_mm(points_mm)
        for slope, from_wall_mm in ((shear, half_mm + across_mm), (-shear, half_mm - across_mm)):
            depth_mm = from_wall_mm / np.maximum(slope + self.narrowing, 1e-6)
            z_mm = np.where(depth_mm < -z_mm, -depth_mm, z_mm)
        return np.where(beside_mm > 0, spill_mm, z_mm)

    def level_at_mm(self, s_mm: Floats) -> Floats:
        """Return the mean of the sealant's z between the walls at stations."""
        line_mm, shares = self.outline.centreline_mm, (np.arange(40) + 0.5) / 20 - 1
        rows = (*line_mm.T, *left_normals(line_mm).T, *self.halves_mm.T, self.level_mm)
        x_mm, y_mm, to_x, to_y, left_mm, right_mm, level_mm = (np.interp(s_mm, self.outline.s_mm, row) for row in rows)
        depth_mm = np.maximum(-level_mm, 0.0)
        half_mm = (left_mm + right_mm) / 2 - depth_mm * self.narrowing
        across_mm = (left_mm - right_mm)[:, None] / 2 + half_mm[:, None] * shares
        middle_mm = np.column_stack([x_mm, y_mm]) + depth_mm[:, None] * self.shear
        points_mm = middle_mm[:, None] + across_mm[:, :, None] * np.column_stack([to_x, to_y])[:, None]
        return self.sealant_mm(points_mm.reshape(-1, 2)).reshape(across_mm.shape).mean(axis=1)

    def over_face_mm3(self) -> float:
        """Return the volume of heaps and spills above the plane of the face."""
        return float(np.maximum(self.seen_mm(self.grid_mm(TRUTH_STEP_MM)), 0.0).sum() * TRUTH_STEP_MM**2)

    def grid_mm(self, step_mm: float) -> Floats:
        """Return a regular grid on the face, (n, 2)."""
        _, _, x_mm, y_mm = self.solid.block_mm
        axes = np.arange(step_mm / 2, x_mm, step_mm), np.arange(step_mm / 2, y_mm, step_mm)
        return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)


def waves(rng: np.random.Generator, t_mm: Floats, longest_mm: float) -> Floats:
    """Return a smooth random line of standard deviation 1, of waves from 18 mm to the longest."""
    lengths_mm = np.geomspace(18.0, longest_mm, 4)
    phases = rng.uniform(0, 2 * np.pi, 4)
    line = (lengths_mm * rng.uniform(0.5, 1.5, 4) * np.sin(2 * np.pi * t_mm[:, None] / lengths_mm + phases)).sum(axis=1)
    return line / line.std()


def sealed_crack(number: int) -> Sealed:
    rng = np.random.default_rng([2024, number])
    length_mm, width_mm = rng.uniform(60, 140), rng.uniform(3, 12)
    t_mm = np.linspace(0.0, length_mm, round(length_mm / 0.2) + 1)
    wander_mm = rng.uniform(0.8, 2.0) * min(1.0, 6 / width_mm) * waves(rng, t_mm, length_mm)
    line_mm = np.column_stack([15 + t_mm, 25 + wander_mm - wander_mm.mean() + rng.uniform(-0.1, 0.1) * t_mm])
    line_mm[:, 1] -= line_mm[:, 1].mean() - 25
    rough_mm = gaussian_filter1d(rng.standard_normal((len(t_mm), 2)), 3.0, axis=0) * rng.uniform(0.1, 0.4)
    halves_mm = width_mm / 2 * (1 + 0.12 * np.column_stack([waves(rng, t_mm, 60), waves(rng, t_mm, 60)])) + rough_mm
    closed = number % 2 == 1
    if closed:
        halves_mm *= np.clip(np.minimum(t_mm, length_mm - t_mm) / (2 * width_mm), 1e-4, 1.0)[:, None] ** 0.5
    normal = left_normals(line_mm)
    left_mm, right_mm = line_mm + halves_mm[:, :1] * normal, line_mm - halves_mm[:, 1:] * normal
    face_mm = (0.0, 0.0, length_mm + 30, 50.0)
    outline = outline_between(line_mm, left_mm, right_mm, CLOSED if closed else CUT, face_mm)
    tilt: Tilt = ("vertical", "lean", "funnel")[number // 5 % 3]
    angle_deg = 0.0 if tilt == "vertical" else rng.uniform(1, 5)
    shape = CrackShape(depth_mm=rng.uniform(8, 25), tilt=tilt, wall_angle_deg=angle_deg or 1.0)
    chord, slope = line_mm[-1] - line_mm[0], np.tan(np.radians(angle_deg))
    low_mm = rng.uniform(-4, -0.5)
    high_mm = rng.uniform(low_mm + 0.5, 2.0)
    level_mm = low_mm + (high_mm - low_mm) * np.clip(0.5 + 0.3 * waves(rng, t_mm, length_mm), 0, 1)
    edge_mm = np.maximum(level_mm, 0.0) * np.clip(0.2 + 0.3 * waves(rng, t_mm, 40), 0, 0.6)
    # The sealant is curved as drawn below the face, and keeps to the rim, or to the spill, above it.
    curve_mm = np.minimum(rng.choice([0.0, rng.uniform(0.1, 0.8), -rng.uniform(0.1, 0.5)]), 1.5 * (edge_mm - level_mm))
    return Sealed(
        outline,
        build_solid(outline, shape),
        halves_mm,
        level_mm,
        curve_mm,
        rng.uniform(1, 5, 2) * rng.choice([0.02, 1.0], 2),
        (tilt == "lean") * slope * np.array([-chord[1], chord[0]]) / np.linalg.norm(chord),
        (tilt == "funnel") * float(slope),
    )


def rough(rng: np.random.Generator, points_mm: Floats, over_mm: float) -> Floats:
    """Return noise of standard deviation 1, whose correlation has fallen to 1/e at a distance."""
    cells = (points_mm - points_mm.min(axis=0)) * 4 / over_mm
    field = gaussian_filter(rng.standard_normal(np.ceil(cells.max(axis=0)).astype(int) + 2), 2.0)
    return map_coordinates(field / field.std(), cells.T, order=1)
