"""Make a mesh of a drawn crack: the sample's block less the crack, with upright walls and a level floor."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, OpType

from digitise.drawing.drawn_layers import DrawnLayers
from digitise.drawing.read_dxf import MM, Drawing
from digitise.geometry.region import box_region, prism, traced_region
from digitise.mesh_import.cavity_sections import strip_width_mm
from digitise.mesh_import.import_mesh import MOST_MM
from digitise.settings import CrackShape
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers
from sealtwin.core.settings import doubts_of

FLOOR_MM, MARGIN_MM = 4.0, 12.0
"""Thickness of the sample below the crack, and width around it if no face is drawn. A photo's crack has the same
defaults."""
FACE = "FACE"  # Layer with the edge of the sample, as 'sealtwin export' names it
OUTLINE, ISLANDS, WALLS = "OUTLINE", "ISLANDS", ("WALL_LEFT", "WALL_RIGHT")
"""Layers that 'sealtwin export' writes. They are read if no other layer is named."""
SEGMENTS = 32  # Corners of the round ends of a line with a width
MOST_SWEPT = 5000  # Most points of such a line, ten times a traced one's: the time grows with their square
LEAST_CRACK_MM = 3.0  # Least length of a crack: three widths of the finest crack that is injected
ABOVE_MM = 1.0  # Height by which the cut begins above the face, so that no skin remains on it


@dataclass(frozen=True)
class DrawnCrack:
    """The triangles of a sample with a drawn crack."""

    vertices_mm: Floats  # (v, 3), z = 0 on the face
    faces: Integers  # (f, 3)
    line_mm: Floats | None  # The drawn centreline, (n, 2), if there is one

    def as_obj(self) -> bytes:
        """Return the triangles in the text format OBJ, which keeps their digits."""
        corners = (f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in self.vertices_mm)
        triangles = (f"f {a} {b} {c}" for a, b, c in self.faces + 1)
        return "\n".join([*corners, *triangles, ""]).encode()


def drawn_crack(
    layers: DrawnLayers,
    depth_mm: float,
    *,
    outline: str | None = None,
    walls: tuple[str, str] | None = None,
    line: tuple[str, float] | None = None,
) -> DrawnCrack:
    """Cut a crack out of a block: inside an ``outline``, between ``walls``, or along a ``line`` with a width in mm.

    If none of the three is given, the layers of 'sealtwin export' are used. The block's sides are the closed line of
    the layer FACE, if there is one. Notes are added to the drawing. Raises InputError if a layer is missing or its
    lines are of the wrong kind, and ShapeError if the lines bound no crack.
    """
    drawing, centre_mm = layers.drawing, None
    if line is not None:
        centre_mm = layers.way(line[0])
        _require_long(drawing, centre_mm)
        if len(centre_mm) > MOST_SWEPT:
            raise InputError(
                f"{drawing.file}, layer {line[0]}: the line has {len(centre_mm)} points; a line that is given with a "
                f"width may have at most {MOST_SWEPT}. Simplify it, or draw the edge and give it as --outline."
            )
        disc = CrossSection.circle(line[1] / 2, SEGMENTS)
        swept = [
            CrossSection.batch_hull([disc.translate(first), disc.translate(last)])
            for first, last in pairwise(centre_mm)
        ]
        crack = CrossSection.batch_boolean(swept, OpType.Add)
    elif walls is not None or (outline is None and not layers.has(OUTLINE) and all(map(layers.has, WALLS))):
        left_mm, right_mm = map(layers.way, walls or WALLS)
        drawing.require_level(*(walls or WALLS))
        if np.linalg.norm(left_mm[-1] - right_mm[-1]) > np.linalg.norm(left_mm[-1] - right_mm[0]):
            right_mm = right_mm[::-1]
        _require_long(drawing, np.vstack([left_mm, right_mm]))
        crack = _region(drawing, np.vstack([left_mm, right_mm[::-1]]))
    else:
        largest, *islands = layers.outline(outline or OUTLINE)
        islands += layers.islands(largest, ISLANDS) if outline is None and layers.has(ISLANDS) else []
        _require_long(drawing, largest)
        crack = _region(drawing, largest, islands)
    extent_mm = np.reshape(crack.bounds(), (2, 2))
    drawing.notes.append(
        f"unit of the drawing: {drawing.unit} ({drawing.unit_source}); the crack is {drawing.size(extent_mm)}"
    )
    drawing.notes += doubts_of(CrackShape(depth_mm=depth_mm), width_mm=strip_width_mm(crack))
    if layers.has(FACE):
        sides = _region(drawing, layers.one_ring(FACE))
        if not (sides ^ crack).area() > 0:
            raise InputError(
                f"{drawing.file}, layer {FACE}: the sample's edge, "
                f"{drawing.size(np.reshape(sides.bounds(), (2, 2)))}, is outside the crack, "
                f"{drawing.size(extent_mm)}. Draw it around the crack, or delete it."
            )
    else:
        x_min, y_min, x_max, y_max = crack.bounds()
        sides = box_region((x_min - MARGIN_MM, y_min - MARGIN_MM, x_max + MARGIN_MM, y_max + MARGIN_MM))
    if np.ptp(bounds_mm := np.reshape(sides.bounds(), (2, 2)), axis=0).max() > MOST_MM:
        what = f"the sample is {drawing.size(bounds_mm)}, but at most {MOST_MM:g} mm"
        raise _of_another_unit(drawing, what, extent_mm)
    block = prism(sides, -depth_mm - FLOOR_MM, 0.0) - prism(crack, -depth_mm, ABOVE_MM)
    mesh = block.to_mesh64()
    vertices_mm = np.asarray(mesh.vert_properties, dtype=float)[:, :3]
    return DrawnCrack(vertices_mm, np.asarray(mesh.tri_verts, dtype=np.int64), centre_mm)


def _region(drawing: Drawing, ring_mm: Floats, islands_mm: Sequence[Floats] = ()) -> CrossSection:
    region, warnings = traced_region(ring_mm, islands_mm)
    drawing.notes.extend(warnings)
    return region


def _require_long(drawing: Drawing, crack_mm: Floats) -> None:
    """Raise InputError for a crack that is too short. A wrong unit may be the cause."""
    if np.ptp(crack_mm, axis=0).max() < LEAST_CRACK_MM:
        what = f"the crack is {drawing.size(crack_mm)}, but at least {LEAST_CRACK_MM:g} mm"
        raise _of_another_unit(drawing, what, crack_mm)


def _of_another_unit(drawing: Drawing, what: str, crack_mm: Floats) -> InputError:
    longest = float(np.ptp(crack_mm, axis=0).max()) / drawing.per_unit_mm
    fitting = [unit for unit in MM if LEAST_CRACK_MM <= longest * MM[unit] <= MOST_MM - 2 * MARGIN_MM]
    units = " or ".join(f"--units {unit}" for unit in fitting)
    remedy = f"Give {units} if it is drawn in that unit." if fitting else "Draw it to scale."
    return InputError(
        f"{drawing.file}: {what} are expected. The unit is {drawing.unit}, {drawing.unit_source}. {remedy}"
    )
