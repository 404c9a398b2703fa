"""Write a traced crack and its nozzle path as a DXF drawing in millimetres, with one layer for each kind of line."""

import io

import ezdxf.filemanagement
from ezdxf import units
from ezdxf.layouts.layout import Modelspace

from digitise.geometry.polyline import rectangle
from sealtwin.core.records import Floats, Outline, Trajectory

LAYERS = {
    "OUTLINE": 1,
    "ISLANDS": 2,
    "WALL_LEFT": 3,
    "WALL_RIGHT": 4,
    "CENTRELINE": 5,
    "SIDE_CRACKS": 6,
    "FACE": 8,
    "NOZZLE_PATH": 30,
}
"""AutoCAD colour index of each layer."""


def dxf_text(outline: Outline, trajectory: Trajectory | None) -> str:
    """Return a DXF (R2010) in mm. x and y are the outline's, z = 0 is the face, and the path is a line in space."""
    drawing = ezdxf.filemanagement.new("R2010", units=units.MM)
    for name, colour in LAYERS.items():
        drawing.layers.add(name, color=colour)
    space = drawing.modelspace()
    # A path alone has neither edge nor walls.
    if outline.width_source != "none":
        _line(space, "OUTLINE", outline.outline_mm, closed=True)
        _line(space, "WALL_LEFT", outline.left_wall_mm)
        _line(space, "WALL_RIGHT", outline.right_wall_mm)
    for ring_mm in outline.islands_mm:
        _line(space, "ISLANDS", ring_mm, closed=True)
    _line(space, "CENTRELINE", outline.centreline_mm)
    for branch_mm in outline.branches_mm:
        _line(space, "SIDE_CRACKS", branch_mm)
    if outline.face_mm is not None:
        _line(space, "FACE", rectangle(outline.face_mm), closed=True)
    if trajectory is not None:
        space.add_polyline3d(trajectory.position_mm.tolist(), dxfattribs={"layer": "NOZZLE_PATH"})
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue()


def _line(space: Modelspace, layer: str, points_mm: Floats, *, closed: bool = False) -> None:
    space.add_lwpolyline(points_mm.tolist(), close=closed, dxfattribs={"layer": layer})
