"""A drawn crack as a mesh: the sample's block less the crack, with upright walls and a level floor."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from manifold3d import CrossSection, Manifold, OpType

from digitise.drawing.read_dxf import DrawnLine
from digitise.geometry.polyline import signed_area
from digitise.geometry.region import box_region, traced_region
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers

FLOOR_MM, MARGIN_MM = 4.0, 12.0
"""Sample below the crack, and around it where no face is drawn: those of a photo's crack by default."""
FACE = "FACE"  # Layer with the edge of the sample, as 'sealtwin export' names it
OUTLINE, ISLANDS, WALLS = "OUTLINE", "ISLANDS", ("WALL_LEFT", "WALL_RIGHT")
"""Layers of 'sealtwin export', which are taken where none is named."""
SEGMENTS = 32  # Corners of the round ends of a line with a width
ABOVE_MM = 1.0  # Height by which the cut begins above the face, so that no skin is left on it


@dataclass(frozen=True)
class DrawnCrack:
    """The triangles of a sample with a drawn crack."""

    vertices_mm: Floats  # (v, 3), z = 0 on the face
    faces: Integers  # (f, 3)
    line_mm: Floats | None  # The drawn centreline, (n, 2), where there is one

    def as_obj(self) -> bytes:
        """Return the triangles in the text format OBJ, which keeps their digits."""
        corners = (f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in self.vertices_mm)
        triangles = (f"f {a} {b} {c}" for a, b, c in self.faces + 1)
        return "\n".join([*corners, *triangles, ""]).encode()


class DrawnLayers:
    """Lines of a drawing by layer, whatever the case of its name; refusals name both."""

    def __init__(self, drawing: Path, layers: Mapping[str, Sequence[DrawnLine]]) -> None:
        self._drawing = drawing
        self._layers = {name.upper(): (name, lines) for name, lines in layers.items()}

    def has(self, name: str) -> bool:
        return name.upper() in self._layers

    def rings(self, name: str) -> list[Floats]:
        """Return the closed lines of a layer, the largest first. Raises InputError where one is open or all lack."""
        lines = self._lines(name)
        if any(not line.closed for line in lines):
            raise InputError(f"{self._drawing}, layer {name}: has an open line; close it, or name walls or a line.")
        return sorted((line.points_mm for line in lines), key=lambda ring: -abs(signed_area(ring)))

    def way(self, name: str) -> Floats:
        """Return the one open line of a layer. Raises InputError where it has another one, or a closed one."""
        lines = self._lines(name)
        if len(lines) != 1 or lines[0].closed:
            found = f"{len(lines)} lines that do not meet" if len(lines) > 1 else "a closed line"
            raise InputError(f"{self._drawing}, layer {name}: {found}; draw one open line from end to end.")
        return lines[0].points_mm

    def _lines(self, name: str) -> Sequence[DrawnLine]:
        if not self.has(name):
            there = ", ".join(found for found, _ in self._layers.values()) or "none"
            raise InputError(f"{self._drawing}: no lines on a layer {name}; layers with lines: {there}.")
        return self._layers[name.upper()][1]


def drawn_crack(
    layers: DrawnLayers,
    depth_mm: float,
    *,
    outline: str | None = None,
    walls: tuple[str, str] | None = None,
    line: tuple[str, float] | None = None,
) -> DrawnCrack:
    """Cut a crack out of a block: inside an ``outline``, between ``walls``, or along a ``line`` of a width in mm.

    Without any of them it is that of the layers which 'sealtwin export' writes. The block's sides are the closed line
    of the layer FACE, where there is one. Raises InputError where a layer is missing or holds something else.
    """
    centre_mm = None
    if line is not None:
        centre_mm = layers.way(line[0])
        disc = CrossSection.circle(line[1] / 2, SEGMENTS)
        swept = [
            CrossSection.batch_hull([disc.translate(first), disc.translate(last)])
            for first, last in pairwise(centre_mm)
        ]
        crack = CrossSection.batch_boolean(swept, OpType.Add)
    elif walls is not None or (outline is None and not layers.has(OUTLINE)):
        left_mm, right_mm = map(layers.way, walls or WALLS)
        if np.linalg.norm(left_mm[-1] - right_mm[-1]) > np.linalg.norm(left_mm[-1] - right_mm[0]):
            right_mm = right_mm[::-1]
        crack, _ = traced_region(np.vstack([left_mm, right_mm[::-1]]))
    else:
        largest, *islands = layers.rings(outline or OUTLINE)
        islands += layers.rings(ISLANDS) if outline is None and layers.has(ISLANDS) else []
        crack, _ = traced_region(largest, islands)
    if layers.has(FACE):
        sides, _ = traced_region(layers.rings(FACE)[0])
    else:
        x_min, y_min, x_max, y_max = crack.bounds()
        sides = box_region((x_min - MARGIN_MM, y_min - MARGIN_MM, x_max + MARGIN_MM, y_max + MARGIN_MM))
    block = _extruded(sides, -depth_mm - FLOOR_MM, 0.0) - _extruded(crack, -depth_mm, ABOVE_MM)
    mesh = block.to_mesh64()
    vertices_mm = np.asarray(mesh.vert_properties, dtype=float)[:, :3]
    return DrawnCrack(vertices_mm, np.asarray(mesh.tri_verts, dtype=np.int64), centre_mm)


def _extruded(region: CrossSection, bottom_mm: float, top_mm: float) -> Manifold:
    return Manifold.extrude(region, top_mm - bottom_mm).translate((0.0, 0.0, bottom_mm))
