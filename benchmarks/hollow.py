"""Hollows in a block: solids of any shape into which fluid is released, such as boxes, channels and plates."""

from dataclasses import dataclass
from functools import cached_property

import manifold3d
import numpy as np

from sealtwin.core.records import FaceLabel, Floats, Outline, Sections, Solid
from sealtwin.core.solid_figures import SolidFigures

RIM_MM = 5.0  # Thickness of the block around and below the hollow


@dataclass(frozen=True)
class Box:
    """Box along the axes, in mm. y is across, and z is upward from the floor."""

    low_mm: tuple[float, float, float]
    high_mm: tuple[float, float, float]

    @property
    def body(self) -> manifold3d.Manifold:
        size = np.subtract(self.high_mm, self.low_mm)
        return manifold3d.Manifold.cube(tuple(size)).translate(self.low_mm)


@dataclass(frozen=True)
class Hollow:
    """Box that is open at the top, with further walls on its floor. The floor is at z = 0."""

    room: Box
    walls: tuple[Box, ...] = ()

    @property
    def depth_mm(self) -> float:
        return self.room.high_mm[2]

    @property
    def reach_mm(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner of the hollow with its rim, in the solver's coordinates (upper face at z = 0)."""
        down = np.array([0.0, 0.0, self.depth_mm])
        return self.room.low_mm - down - RIM_MM, self.room.high_mm - down + RIM_MM

    @cached_property
    def solid(self) -> Solid:
        (x0, y0, _), (x1, y1, depth) = self.room.low_mm, self.room.high_mm
        block_mm = (x0 - RIM_MM, y0 - RIM_MM, x1 + RIM_MM, y1 + RIM_MM)
        body = Box((*block_mm[:2], -RIM_MM), (*block_mm[2:], depth)).body
        body -= Box(self.room.low_mm, (x1, y1, depth + 1)).body
        for wall in self.walls:
            body += wall.body
        return solid_of(body.translate((0, 0, -depth)), block_mm, depth)

    @cached_property
    def outline(self) -> Outline:
        """Edge of the hollow, and a line along its middle, since a run needs a path."""
        (x0, y0, _), (x1, y1, _) = self.room.low_mm, self.room.high_mm
        x_mm, middle_mm = np.linspace(x0, x1, 3), (y0 + y1) / 2
        line, left, right = (np.column_stack([x_mm, np.full(3, y_mm)]) for y_mm in (middle_mm, y1, y0))
        ring = np.vstack([right, left[::-1]])
        return Outline(
            line, left, right, ring, line, left, right, ring, ("cut", "cut"), None, 1.0, "given", None, "ends"
        )


def solid_of(body: manifold3d.Manifold, block_mm: tuple[float, float, float, float], depth_mm: float) -> Solid:
    """Return the solid of a block whose upper face is at z = 0.

    Its sides and underside are labelled OUTSIDE, its upper face TOP, and all other faces WALL.
    """
    mesh = body.to_mesh()
    vertices, faces = np.array(mesh.vert_properties[:, :3], float), np.array(mesh.tri_verts, np.int64)
    corner = vertices[faces]
    label = np.full(len(faces), FaceLabel.WALL)
    label[(np.abs(corner[:, :, 2]) < 1e-6).all(axis=1)] = FaceLabel.TOP
    bottom_mm = float(vertices[:, 2].min())
    sides = ((0, block_mm[0]), (1, block_mm[1]), (0, block_mm[2]), (1, block_mm[3]), (2, bottom_mm))
    for axis, at_mm in sides:
        label[(np.abs(corner[:, :, axis] - at_mm) < 1e-6).all(axis=1)] = FaceLabel.OUTSIDE
    whole_mm3 = (block_mm[2] - block_mm[0]) * (block_mm[3] - block_mm[1]) * -bottom_mm
    hollow_mm3, length_mm = whole_mm3 - body.volume(), block_mm[2] - block_mm[0]
    level = Sections(np.array([0.0, length_mm]), np.full(2, depth_mm), np.full(2, hollow_mm3 / length_mm))
    return Solid(vertices, faces, label, block_mm, depth_mm, "vertical", (0.0, 0.0), hollow_mm3, level, SolidFigures())
